"""Adapters: mechanisms as components of other programs, and the reverse, one module for each program."""

from ..arguments import explain_arguments
from . import fmi, openmdao, tesseract
from ._system_block import SystemBlock, as_block

__all__ = [
    "SystemBlock",
    "as_block",
    "fmi",
    "openmdao",
    "tesseract",
]

explain_arguments(globals())
