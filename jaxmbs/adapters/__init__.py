"""Adapters: mechanisms as components of other programs, and the reverse, one module for each program."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from . import fmi, openmdao, tesseract
    from ._system_block import SystemBlock, as_block

__all__ = [
    "SystemBlock",
    "as_block",
    "fmi",
    "openmdao",
    "tesseract",
]

import_when_asked(__name__, explain_arguments)
