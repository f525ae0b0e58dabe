"""Adapters: models of this library as components of other programs, one module for each program."""

from . import openmdao, tesseract

__all__ = [
    "openmdao",
    "tesseract",
]
