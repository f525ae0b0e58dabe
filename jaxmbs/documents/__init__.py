"""Documents: what was asked of a machine and what came out, as one HTML file that needs no network."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._report import report

__all__ = ["report"]

import_when_asked(__name__, explain_arguments)
