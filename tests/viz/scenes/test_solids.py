"""Solids: their volumes by the divergence theorem, and surfaces read from files."""

import struct

import numpy as np
import pytest

from jaxmbs.viz import Solid
from jaxmbs.viz.scenes._solids import rotation_to_axis, rounded_hull, sweep_tube, unit_cone


def volume(solid):
    """By tetrahedra about the origin, each with the sign of its face against the normals given."""
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    outward = np.sign(np.einsum("ij,ij->i", np.cross(b - a, c - a), solid.normals[solid.faces].mean(axis=1)))
    return np.sum(outward * np.einsum("ij,ij->i", a, np.cross(b, c))) / 6


@pytest.mark.parametrize(
    "solid, wanted",
    [
        (Solid.box((0.2, 0.3, 0.5)), 0.03),
        (Solid.cylinder(0.2, 0.5, "x"), np.pi * 0.2**2 * 0.5),
        (Solid.ball(0.3), 4 / 3 * np.pi * 0.3**3),
        (unit_cone(), np.pi / 3),
        (unit_cone(0.5), np.pi / 3 * (1 + 0.5 + 0.25)),
        (rounded_hull([(0, 0, 0), (1, 0, 0)], 0.1), np.pi * 0.01 + 4 / 3 * np.pi * 1e-3),
        (rounded_hull([(0, 0, 0)], 0.1), 4 / 3 * np.pi * 1e-3),
    ],
)
def test_volumes(solid, wanted):
    moved = solid.placed((0.3, -0.2, 0.1), rotation_to_axis(np.array([1.0, 2.0, -0.5])))
    assert np.isclose(volume(moved), wanted, rtol=0.06)
    assert volume(moved) <= wanted * (1 + 1e-9)  # corners lie on the surface
    assert np.allclose(np.linalg.norm(moved.normals, axis=1), 1.0)


def test_a_box_has_its_edges():
    box = Solid.box((0.2, 0.3, 0.5)).placed((1.0, 0.0, 0.0))
    assert np.allclose(np.ptp(box.vertices, axis=0), (0.2, 0.3, 0.5))
    assert np.allclose(box.vertices.mean(axis=0), (1.0, 0.0, 0.0))


def test_a_tube_keeps_its_radius():
    path = np.stack([np.linspace(0, 1, 9), np.linspace(0, 1, 9) ** 2, 0 * np.linspace(0, 1, 9)], axis=1)
    tube = sweep_tube(path, 0.1, sides=5)
    apart = np.linalg.norm(tube.vertices.reshape(9, 5, 3) - path[:, None], axis=-1)
    assert np.allclose(apart, 0.1)


TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def test_stl_text_and_binary(tmp_path):
    corners = 1000.0 * TETRAHEDRON[FACES]
    lines = ["solid part"]
    packed = b"\0" * 80 + struct.pack("<I", len(FACES))
    for face in corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {:e} {:.1f} {:g}".format(*corner) for corner in face] + ["endloop", "endfacet"]
        packed += struct.pack("<12fH", 0, 0, 0, *face.ravel(), 0)
    (tmp_path / "text.stl").write_text("\n".join(lines))
    (tmp_path / "binary.stl").write_bytes(packed)
    for name in ("text.stl", "binary.stl"):
        solid = Solid.stl(tmp_path / name, scale=1e-3)
        assert np.isclose(volume(solid), 1 / 6)
    (tmp_path / "empty.stl").write_text("solid nothing\nendsolid")
    with pytest.raises(ValueError, match="no triangles"):
        Solid.stl(tmp_path / "empty.stl")
