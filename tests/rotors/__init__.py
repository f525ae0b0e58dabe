"""Rotors agree with closed forms, published numbers and another program."""
