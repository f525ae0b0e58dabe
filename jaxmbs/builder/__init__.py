"""From declarations by name to a system: validation, spanning tree, arrays, count of freedoms."""

from ._builder import SystemBuilder

__all__ = [
    "SystemBuilder",
]
