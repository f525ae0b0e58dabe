"""Shear panels: closed forms of rectangles and trapezoids, balance of warped ones."""

import jax.numpy as jnp
import numpy as np

from jaxmbs.elements import ShearPanel


def test_rectangle():
    """Flow G t gamma, forces of half of the flow on each side at the corners, work G t gamma^2 A / 2."""
    panel, gamma = ShearPanel(27e9, 0.002, 2700.0), 1e-3
    nodes = np.array([[0, 0, 0], [3, 0, 0], [3, 2, 0], [0, 2, 0.0]])
    u = np.zeros((4, 3))
    u[:, 0] = gamma * nodes[:, 1]
    flow = 27e9 * 0.002 * gamma
    np.testing.assert_allclose(panel.forces(jnp.asarray(nodes), jnp.asarray(u)), [flow], rtol=1e-12)
    np.testing.assert_allclose(panel.stresses(jnp.asarray(nodes), jnp.asarray(u)), [flow / 0.002], rtol=1e-12)
    loads = np.asarray(panel.stiffness(jnp.asarray(nodes)) @ u.ravel()).reshape(4, 3)
    expected = flow / 2 * np.array([[-3, -2, 0], [-3, 2, 0], [3, 2, 0], [3, -2, 0]])
    np.testing.assert_allclose(loads, expected, rtol=1e-12, atol=1e-9)
    M = np.asarray(panel.mass(jnp.asarray(nodes)))
    np.testing.assert_allclose(M[::3, ::3].sum(), 2700.0 * 0.002 * 6, rtol=1e-12)


def test_trapezoid():
    """Of parallel sides 1 and 2, their flows are as 4 to 1, the mean flow that of the others (Kuhn 1956, 3)."""
    panel = ShearPanel(1.0, 1.0)
    nodes = np.array([[-1, 0, 0], [1, 0, 0], [0.5, 3, 0], [-0.5, 3, 0.0]])
    f, area = panel._flow(jnp.asarray(nodes))
    f = np.asarray(f).reshape(4, 3)
    side = (nodes[2] - nodes[1]) / np.linalg.norm(nodes[2] - nodes[1])
    of_side = 2 * f[1, 1] / side[1] / np.linalg.norm(nodes[2] - nodes[1])
    lower = -2 * (f[1, 0] - of_side * np.linalg.norm(nodes[2] - nodes[1]) / 2 * side[0]) / 2.0
    upper = -2 * (f[2, 0] - of_side * np.linalg.norm(nodes[2] - nodes[1]) / 2 * side[0]) / 1.0
    np.testing.assert_allclose([abs(of_side), area], [1.0, 4.5], rtol=1e-12)
    np.testing.assert_allclose(abs(upper / lower), 4.0, rtol=1e-12)
    np.testing.assert_allclose(abs(upper * lower), 1.0, rtol=1e-12)
