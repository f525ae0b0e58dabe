"""Adapters: models of this library as components of other programs, one module for each program."""

__all__ = []
