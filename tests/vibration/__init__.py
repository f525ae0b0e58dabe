"""Modes, responses and transients of linear systems are those of closed forms, SciPy and direct solves."""
