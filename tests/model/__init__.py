"""Inertias, rotations and changed numbers are what they stand for; questions refuse states of other systems."""
