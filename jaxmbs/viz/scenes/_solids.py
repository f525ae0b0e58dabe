"""Solids as triangle meshes: boxes, cylinders, balls, STL files, tubes, coils and rounded hulls."""

import re
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from ...math._rotation import axis_vector
from ...typing import ArrayLike, Axis, ScalarLike

_SIDES = 28  # of a circle: corners are not seen at the sizes of a screen
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])  # a triangle of a binary STL
_NUMBER = rb"([-+0-9.eE]+)"
_CORNER = re.compile(rb"vertex\s+" + rb"\s+".join([_NUMBER] * 3))


class Solid(NamedTuple):
    """A solid in the axes of a body: vertices (n, 3) [m], their outward normals (n, 3), triangles (k, 3) of vertices.

    `scene(..., shapes={"ram": [Solid.box((0.2, 0.1, 0.1))]})` draws it in place of what the joints suggest.
    """

    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    color: str | None = None

    @classmethod
    def box(cls, size: ArrayLike, color: str | None = None) -> "Solid":
        """A box with edges (3,) along x, y, z about the body's origin; `placed` puts it elsewhere."""
        parts = []
        for axis in range(3):
            for sign in (-1.0, 1.0):
                corners = np.zeros((4, 3))
                corners[:, axis] = sign
                corners[:, (axis + 1) % 3] = (-1, 1, 1, -1)
                corners[:, (axis + 2) % 3] = (-1, -1, 1, 1)
                parts.append((0.5 * corners, np.tile(sign * np.eye(3)[axis], (4, 1)), [[0, 1, 2], [0, 2, 3]]))
        return cls(*_merge_parts(parts))._replace(color=color).scaled(size)

    @classmethod
    def cylinder(cls, radius: ScalarLike, length: ScalarLike, axis: Axis = "z", color: str | None = None) -> "Solid":
        """A cylinder centred at the body's origin."""
        return unit_cylinder()._replace(color=color).placed((0, 0, -0.5)).scaled((radius, radius, length)).along(axis)

    @classmethod
    def ball(cls, radius: ScalarLike, color: str | None = None) -> "Solid":
        """A ball centred at the body's origin."""
        points, faces = icosphere(3)
        return cls(np.asarray(radius * points), points, faces, color)

    @classmethod
    def stl(cls, path: str | PathLike, scale: ScalarLike = 1.0, color: str | None = None) -> "Solid":
        """A surface from an STL file, text or binary; scale: metres per unit of the file.

        Raises: OSError; ValueError for a file that holds no triangles.
        """
        corners = scale * _read_stl_corners(Path(path))
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(size > 0.0, size, 1.0)
        faces = np.arange(3 * len(corners)).reshape(-1, 3)
        return cls(corners.reshape(-1, 3), np.repeat(normals, 3, axis=0), faces, color)

    def placed(self, position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> "Solid":
        """The solid rotated by a matrix (3, 3), then moved to a position (3,) [m]."""
        R = np.eye(3) if rotation is None else np.asarray(rotation)
        return self._replace(vertices=self.vertices @ R.T + np.asarray(position), normals=self.normals @ R.T)

    def along(self, axis: Axis) -> "Solid":
        """The solid rotated so that its z axis points along another one."""
        return self.placed(rotation=rotation_to_axis(np.asarray(axis_vector(axis), float)))

    def scaled(self, size: ArrayLike) -> "Solid":
        """The solid stretched along x, y, z."""
        size = np.asarray(size, float)
        normals = self.normals / np.where(size == 0.0, 1.0, size)
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        return self._replace(vertices=self.vertices * size, normals=normals)


def join_solids(solids: list[Solid]) -> Solid:
    """Several solids as one, of the first one's colour."""
    return solids[0]._replace(**dict(zip(("vertices", "normals", "faces"), _merge_parts(solids), strict=True)))


def _merge_parts(parts):
    """Merge vertices, normals and faces of several parts."""
    starts = np.cumsum([0, *(len(v) for v, *_ in parts)])
    vertices, normals = (np.concatenate([np.asarray(part[k], float) for part in parts]) for k in (0, 1))
    faces = [np.asarray(part[2], int) + start for part, start in zip(parts, starts, strict=False)]
    return vertices, normals, np.concatenate(faces)


def _read_stl_corners(path):
    """Corners (triangles, 3, 3)."""
    text = path.read_bytes()
    count = int.from_bytes(text[80:84], "little") if len(text) >= 84 else -1
    if len(text) == 84 + _RECORD.itemsize * count:
        corners = np.frombuffer(text, _RECORD, offset=84)["corners"].astype(float)
    else:
        corners = np.array(_CORNER.findall(text), float)
        corners = corners[: len(corners) // 3 * 3].reshape(-1, 3, 3)
    if len(corners) == 0 or not np.all(np.isfinite(corners)):
        raise ValueError(f"{path}: the file has no triangles of an STL surface")
    return corners


def rotation_to_axis(axis):
    """Rotation (3, 3) that takes z to an axis."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _unit_circle(sides):
    angle = 2 * np.pi * np.arange(sides) / sides
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


def unit_cone(top: ScalarLike = 0.0, sides: int = _SIDES) -> Solid:
    """Closed cone of radius one at z = 0 and `top` at z = 1."""
    ring, up, k = _unit_circle(sides), np.array([0.0, 0.0, 1.0]), np.arange(sides)
    slope = ring + (1.0 - top) * up
    slope = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    after = (k + 1) % sides
    sheet = np.concatenate([np.stack([k, after, k + sides], 1), np.stack([after, after + sides, k + sides], 1)])
    parts = [(np.concatenate([ring, top * ring + up]), np.concatenate([slope, slope]), sheet)]
    for height, radius in ((0.0, 1.0), (1.0, top)):
        if radius:
            cap = np.concatenate([radius * ring, np.zeros((1, 3))]) + height * up
            parts.append(
                (cap, np.tile((2 * height - 1) * up, (sides + 1, 1)), np.stack([k, after, 0 * k + sides], 1))
            )
    return Solid(*_merge_parts(parts))


def unit_cylinder(sides: int = _SIDES) -> Solid:
    """Closed cylinder of radius one from z = 0 to z = 1."""
    return unit_cone(1.0, sides)


def sweep_tube(points: ArrayLike, radius: ScalarLike, sides: int = 6) -> Solid:
    """A tube along points (n, 3)."""
    points = np.asarray(points, float)
    along = np.gradient(points, axis=0)
    size = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(size > 0, along / np.where(size > 0, size, 1.0), [0.0, 0.0, 1.0])
    side = np.cross(along, np.eye(3)[np.argmin(np.ptp(points, axis=0))])
    thin = np.linalg.norm(side, axis=1) < 1e-6
    side[thin] = np.cross(along[thin], [0.3, 0.5, 0.8])
    side = side / np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    circle = _unit_circle(sides)
    normals = circle[None, :, :1] * side[:, None] + circle[None, :, 1:2] * other[:, None]
    k, row = np.arange(sides), np.arange(len(points) - 1)[:, None] * sides
    near, far = row + k, row + (k + 1) % sides
    faces = np.concatenate([np.stack([near, far, near + sides], 2), np.stack([far, far + sides, near + sides], 2)])
    vertices = points[:, None] + radius * normals
    return Solid(vertices.reshape(-1, 3), normals.reshape(-1, 3), faces.reshape(-1, 3))


def unit_coil(slender: ScalarLike, wire: ScalarLike = 0.13) -> Solid:
    """Coil of radius one from z = 0 to z = 1, whose wire is round once it is stretched to `slender` times that."""
    turns = int(np.clip(0.6 * slender, 5, 16))
    s = np.linspace(0.0, 1.0, 16 * turns + 1)
    radius = np.minimum(1.0, 12.0 * np.minimum(s, 1.0 - s))  # its ends lead to the axis
    angle = 2 * np.pi * turns * s
    path = np.stack([radius * np.cos(angle), radius * np.sin(angle), slender * s], axis=1)
    return sweep_tube(path, wire).scaled((1.0, 1.0, 1.0 / slender))


def icosphere(divisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and triangles of a unit ball, from an icosahedron."""
    g = (1.0 + 5**0.5) / 2.0
    corners = np.array([p for a in (-1, 1) for b in (-g, g) for p in ((0, a, b), (a, b, 0), (b, 0, a))], float)
    n = 2 * divisions - 1
    faces = ConvexHull(corners).simplices
    weights = [(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]
    points = np.concatenate([np.array(weights) @ corners[face] / n for face in faces])
    points = np.unique(np.round(points / np.linalg.norm(points, axis=1, keepdims=True), 9), axis=0)
    return points, ConvexHull(points).simplices


def rounded_hull(points: ArrayLike, radius: ScalarLike, divisions: int = 3) -> Solid:
    """Convex hull of balls about points (n, 3): a capsule for two, a plate with round edges for more in a plane."""
    points, (ball, _) = np.asarray(points, float), icosphere(divisions)
    cloud = (points[:, None] + radius * ball[None]).reshape(-1, 3)
    hull = ConvexHull(cloud)
    kept = hull.vertices
    number = np.zeros(len(cloud), int)
    number[kept] = np.arange(len(kept))
    normals = np.tile(ball, (len(points), 1))[kept]
    return Solid(cloud[kept], normals, number[hull.simplices])
