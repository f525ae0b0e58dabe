"""Scenes in three dimensions: one HTML file that plays a motion in a browser."""

from ._page import Scene, scene
from ._solids import Solid

__all__ = [
    "Scene",
    "Solid",
    "scene",
]
