"""Inertias against sums over sampled bodies, and against each other."""

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from scipy.spatial.transform import Rotation

from jaxmbs.model import inertia


def _integral(points):
    """Inertia of a unit mass spread evenly over points about the origin."""
    return np.mean(np.sum(points**2, axis=1)) * np.eye(3) - points.T @ points / len(points)


def _grid(*counts):
    axes = [(np.arange(n) + 0.5) / n - 0.5 for n in counts]
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)


def _around(radius, angle, height):
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def test_box():
    size = np.array([0.2, 0.5, 1.1])
    expected = 3 * _integral(size * _grid(60, 60, 60))
    np.testing.assert_allclose(inertia.box(3.0, tuple(size)), expected, rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(inertia.box(3.0, jnp.array(size)), inertia.box(3.0, size.tolist()))


def test_rod():
    line = _grid(500, 1, 1) * np.array([0.8, 0, 0])
    np.testing.assert_allclose(inertia.rod(2.0, 0.8), 2 * _integral(line), rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(inertia.rod(2, 0.8, axis="y"), np.diag([1, 0, 1]) * 2 * 0.64 / 12, atol=1e-15)


@pytest.mark.parametrize("inner", [0.0, 0.2, 0.3])
def test_cylinder_and_tube(inner):
    outer, length = 0.3, 0.7
    u = _grid(60, 12, 60) + 0.5
    radius = np.sqrt(inner**2 + (outer**2 - inner**2) * u[:, 0])
    points = _around(radius, 2 * np.pi * u[:, 1], length * (u[:, 2] - 0.5))
    tube = inertia.tube(2.0, inner, outer, length)
    np.testing.assert_allclose(tube, 2 * _integral(points), rtol=1e-3, atol=1e-9)
    if inner == 0.0:
        np.testing.assert_allclose(inertia.cylinder(2.0, outer, length), tube)


@pytest.mark.parametrize("solid", [True, False])
def test_sphere_and_shell(solid):
    u = _grid(40, 12, 40) + 0.5
    r = 0.4 * (np.cbrt(u[:, 0]) if solid else 1.0)
    z = 2 * u[:, 2] - 1
    points = _around(r * np.sqrt(1 - z**2), 2 * np.pi * u[:, 1], r * z)
    function = inertia.sphere if solid else inertia.spherical_shell
    np.testing.assert_allclose(function(2.0, 0.4), 2 * _integral(points), rtol=1e-3, atol=1e-9)


def test_slanted_axis_is_a_turned_inertia():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    slanted = inertia.cylinder(2.0, 0.1, 0.6, axis=tuple(turn[:, 2]))
    expected = inertia.rotate(inertia.cylinder(2.0, 0.1, 0.6), jnp.array(turn))
    np.testing.assert_allclose(slanted, expected, atol=1e-15)


def test_two_halves_make_a_whole():
    half = inertia.rod(1.0, 0.5)
    whole = inertia.combine([(1.0, (1.25, 0, 2), half), (1.0, (1.75, 0, 2), half)])
    np.testing.assert_allclose(whole["mass"], 2.0)
    np.testing.assert_allclose(whole["com"], [1.5, 0, 2])
    np.testing.assert_allclose(whole["inertia"], inertia.rod(2.0, 1.0), atol=1e-15)


def test_point_masses_principal_values_and_holes():
    dumbbell = inertia.combine([(1.0, (0, 0.2, 0), 0), (3.0, (0, -0.2, 0), inertia.point())])
    np.testing.assert_allclose(dumbbell["inertia"], np.diag([1, 0, 1]) * 0.75 * 0.16, atol=1e-15)
    ball = inertia.combine([(2.0, (0, 0, 0), [0.1, 0.1, 0.1]), (-1.0, (0, 0, 0), [-0.02, -0.02, -0.02])])
    np.testing.assert_allclose(ball["inertia"], 0.08 * np.eye(3), atol=1e-15)


def test_faults():
    with pytest.raises(ValueError, match="at least one"):
        inertia.combine([])
    with pytest.raises(ValueError, match="shape"):
        inertia.as_matrix([1.0, 2.0])


def test_gradient_with_respect_to_dimensions():
    def total(length):
        parts = [(length, (length / 2, 0.0, 0.0), inertia.rod(length, length)), (1.0, (length, 0, 0), 0)]
        return inertia.combine(parts)["inertia"][2, 2]

    gradient = jax.jit(jax.grad(total))(0.7)
    np.testing.assert_allclose(gradient, (total(0.7 + 1e-6) - total(0.7 - 1e-6)) / 2e-6, rtol=1e-7)
