"""Equilibria, stiffness, linearisations and Campbell diagrams are those of closed forms, with their derivatives."""
