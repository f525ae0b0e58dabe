"""Adapters: mechanisms as components of other programs, and the reverse, one module for each program."""

from . import fmi, openmdao, tesseract

__all__ = [
    "fmi",
    "openmdao",
    "tesseract",
]
