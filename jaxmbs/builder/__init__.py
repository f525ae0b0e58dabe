"""From declarations by name to a system: validation, spanning tree, arrays, count of freedoms."""

from ..arguments import explain_arguments
from ._builder import SystemBuilder

__all__ = [
    "SystemBuilder",
]

explain_arguments(globals())
