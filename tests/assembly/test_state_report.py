"""Names and numbers of states as tables show them."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs.assembly._state_report import coordinate_names, shown_coordinates, velocity_names


def floating():
    b = mbs.SystemBuilder()
    b.body("hull", mass=1.0, inertia=(0.1, 0.2, 0.3))
    b.joint("float", mbs.Free(), "ground", "hull")
    b.body("bob", mass=1.0, inertia=(0.1, 0.2, 0.3))
    b.joint("ball", mbs.Spherical(), "hull", "bob")
    return b.build()


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (0.3, -0.2, 0.5), (0.0, 3.1, 0.0), (1e-9, 0.0, 2e-9)])
def test_a_ball_is_a_rotation_vector(vector):
    """Of either sign of the quaternion, against SciPy."""
    system, (x, y, z, w) = floating(), Rotation.from_rotvec(vector).as_quat()
    for sign in (1.0, -1.0):
        state = mbs.State.at(system, ball=jnp.array([w, x, y, z]) * sign)
        shown = {name: (float(value), unit) for name, value, unit in shown_coordinates(state)}
        found = [shown[f"ball r{d}"][0] for d in "xyz"]
        np.testing.assert_allclose(found, vector, atol=1e-12)
        assert shown["ball rx"][1] == "rad" and shown["float z"] == (0.0, "m") and len(shown) == 9


def test_names_of_numbers_and_of_rates():
    structure = floating().topology.structure
    assert coordinate_names(structure, 11)[3:8] == ["float qw", "float qx", "float qy", "float qz", "ball w"]
    assert velocity_names(structure, 9)[2:7] == ["float z", "float rx", "float ry", "float rz", "ball rx"]
    assert coordinate_names(None, 2) == velocity_names(None, 2) == ["0", "1"]


def test_a_plane_is_named_by_its_axes():
    """Also where the normal is traced: then as in the system that is built alike."""

    def plate(normal):
        b = mbs.SystemBuilder()
        b.body("plate", mass=1.0, inertia=0.1)
        b.joint("lie", mbs.Planar(normal), "ground", "plate")
        return b

    names = {n: plate(n).build().topology.joints[0].labels[:2] for n in ("x", "y", "z", "-y", (0.0, 1.0, 1.0))}
    expected = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y"), "-y": ("z", "-x"), (0.0, 1.0, 1.0): ("x", "y")}
    assert names == expected
    first = plate("y").build()
    assert plate((0.0, 1.0, 1.0)).build(like=first).topology == first.topology
    moved = mbs.State.at(first, lie=(1.0, 0.0, 0.0))  # the first of its two directions
    np.testing.assert_allclose(mbs.position(first, moved, "plate"), [0.0, 0.0, 1.0], atol=1e-15)
    assert "lie z" in str(moved)
