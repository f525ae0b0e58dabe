"""Encoded arrays, colours and solids of a scene: arrays are base64 of float32, each solid is stored once."""

import base64
from typing import Any

import numpy as np

from ._solids import Solid, icosphere, unit_cone, unit_cylinder


def encode_array(values: Any, kind: str = "<f4") -> str:
    """Encode an array as base64."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def rgba(color: str, alpha=1.0) -> list[float]:
    """Red, green, blue and opacity between 0 and 1 of a colour "#rrggbb"."""
    return [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)] + [alpha]


class SolidLibrary:
    """All solids of a scene, each stored once."""

    def __init__(self):
        self.stored: list[dict] = []
        self.numbers: dict = {}
        self.cylinder, self.cone = self(unit_cylinder()), self(unit_cone())
        points, faces = icosphere(3)
        self.ball = self(Solid(points, points, faces))

    def __call__(self, solid: Solid) -> int:
        """Store a solid and return its index."""
        faces = np.asarray(solid.faces)
        made = {
            "vertices": encode_array(solid.vertices),
            "normals": encode_array(solid.normals),
            "faces": encode_array(faces, "<u4"),
        }
        key = tuple(made.values())
        if key not in self.numbers:
            self.numbers[key] = len(self.stored)
            self.stored.append(made)
        return self.numbers[key]
