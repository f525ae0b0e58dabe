"""From declarations by name to a system: validation, spanning tree, arrays, count of freedoms."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._builder import SystemBuilder

__all__ = [
    "SystemBuilder",
]

import_when_asked(__name__, explain_arguments)
