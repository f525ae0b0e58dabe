"""Rotations, eigenproblems, Lyapunov equations and splines are SciPy's, with derivatives at their hard places."""
