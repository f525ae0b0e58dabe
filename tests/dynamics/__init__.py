"""Accelerations, momenta, energies and friction are those of Newton-Euler, Pinocchio and closed forms."""
