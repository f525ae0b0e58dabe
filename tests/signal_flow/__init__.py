"""Measures, blocks and internal states at an instant are those of kinematics and of laws of equal effort."""
