"""Measured components: coupling, decoupling and updating give back the structure that was measured."""
