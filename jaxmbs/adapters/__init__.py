"""Adapters: a mechanism as a component of other programs, and components of other programs in a mechanism."""
