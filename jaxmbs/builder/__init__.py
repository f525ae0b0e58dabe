"""From declarations by name to a system: validation, spanning tree, arrays, count of freedoms."""

from .builder import SystemBuilder

__all__ = [
    "SystemBuilder",
]
