"""Periodic motions, their multipliers and their derivatives are those of closed forms and published values."""
