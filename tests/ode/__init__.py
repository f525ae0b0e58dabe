"""The loop over steps is diffrax's, its methods have their orders, its adjoint is that of the steps taken."""
