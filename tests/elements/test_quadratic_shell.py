"""Shells of six and eight nodes: patch test, plates and roof that are published, thermal forces."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.elements import QuadraticQuadrilateral, QuadraticTriangle, ShellSection
from jaxmbs.fem import Structure, assemble_dense, body_load, gather_rows, pressure_load, scatter_rows

KINDS = {"triangle": QuadraticTriangle, "quadrilateral": QuadraticQuadrilateral}


@jax.jit
def solve(structure, load):
    return scatter_rows(structure, jnp.linalg.solve(assemble_dense(structure)[0], gather_rows(structure, load)))


def mesh(kind, n, place):
    """Nodes of n x n squares with middles of sides, elements, node numbers (2 n + 1, 2 n + 1), -1 for none."""
    fine = 2 * n + 1
    a, b = np.meshgrid(np.linspace(0, 1, fine), np.linspace(0, 1, fine), indexing="ij")
    index, cells = np.arange(fine**2).reshape(fine, fine), []
    corners = [((0, 0), (2, 0), (2, 2), (0, 2))]
    if kind == "triangle":
        corners = [((0, 0), (2, 0), (2, 2)), ((0, 0), (2, 2), (0, 2))]
    for i, j in np.ndindex(n, n):
        for cell in corners:
            at = np.array(cell) + 2 * np.array([i, j])
            at = np.concatenate([at, (at + np.roll(at, -1, axis=0)) // 2])
            cells.append(index[tuple(at.T)])
    used, cells = np.unique(np.array(cells), return_inverse=True)
    number = np.full(fine**2, -1)
    number[used] = np.arange(len(used))
    nodes = np.stack(place(a.ravel(), b.ravel()), axis=1)[used]
    return nodes, cells.reshape(-1, KINDS[kind].num_nodes), number[index]


def structure_of(kind, n, place, held, section):
    nodes, cells, index = mesh(kind, n, place)
    directions = {}
    for rows, names in held(index):
        for node in np.ravel(rows)[np.ravel(rows) >= 0]:
            directions[int(node)] = f"{directions.get(int(node), '')} {names}"
    return Structure(nodes, {"p": (KINDS[kind](section), cells)}, directions), index


@pytest.mark.parametrize("kind", KINDS)
def test_uniform_strain_and_curvature(kind):
    """Flat elements with sides at any angle: exact forces of linear displacements and of a quadratic deflection."""
    section = ShellSection.isotropic(1e6, 0.25, 0.1)
    corners = np.array([[0, 0], [1.2, 0.1], [1.3, 1.0], [0.1, 0.9]])[: 3 if kind == "triangle" else 4]
    xy = np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
    nodes, (x, y) = np.pad(xy, ((0, 0), (0, 1))), xy.T
    element = KINDS[kind](section)
    axis = np.asarray(element.axes(jnp.asarray(nodes)))[0]
    element = KINDS[kind](section, -np.arctan2(axis[1], axis[0]))
    for strain, curvature in (
        (np.array([2e-3, -1e-3, 3e-3]), np.zeros(3)),
        (np.zeros(3), np.array([0.3, -0.2, 0.4])),
    ):
        u = np.zeros((len(nodes), 6))
        u[:, 0], u[:, 1] = strain[0] * x + strain[2] * y / 2, strain[1] * y + strain[2] * x / 2
        u[:, 2] = -(curvature[0] * x**2 + curvature[1] * y**2 + curvature[2] * x * y) / 2
        u[:, 3], u[:, 4] = -(curvature[1] * y + curvature[2] * x / 2), curvature[0] * x + curvature[2] * y / 2
        found = np.asarray(jax.jit(lambda e, n, u: e.forces(n, u))(element, jnp.asarray(nodes), jnp.asarray(u)))
        c, s = axis[:2]
        turn = np.array([[c * c, s * s, 2 * c * s], [s * s, c * c, -2 * c * s], [-c * s, c * s, c * c - s * s]])
        np.testing.assert_allclose(found[:3], turn @ np.asarray(section.membrane) @ strain, atol=1e-9 * 1e5)
        np.testing.assert_allclose(found[3:6], turn @ np.asarray(section.bending) @ curvature, atol=1e-9 * 1e2)
        np.testing.assert_allclose(found[6:], 0.0, atol=1e-8 * 1e5)
        K = np.asarray(jax.jit(lambda e, n: e.stiffness(n))(element, jnp.asarray(nodes)))
        area = 0.5 * abs(
            np.sum(corners[:, 0] * np.roll(corners[:, 1], -1) - np.roll(corners[:, 0], -1) * corners[:, 1])
        )
        work = strain @ np.asarray(section.membrane) @ strain + curvature @ np.asarray(section.bending) @ curvature
        np.testing.assert_allclose(u.ravel() @ K @ u.ravel(), area * work, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "tolerance"), [("triangle", 0.045), ("quadrilateral", 0.003)])
def test_clamped_plate(kind, tolerance):
    """0.00126532 p a^4 / D at the centre (Timoshenko and Woinowsky-Krieger), a/t = 100."""

    def held(index):
        return [(index, "x y rz"), (index[0], "ry"), (index[:, 0], "rx"), (index[-1], "all"), (index[:, -1], "all")]

    D = 1e6 * 0.01**3 / 12 / (1 - 0.09)
    section = ShellSection.isotropic(1e6, 0.3, 0.01)
    structure, _ = structure_of(kind, 8, lambda a, b: (a / 2, b / 2, 0 * a), held, section)
    centre = solve(structure, pressure_load(structure, "p", 1.0))[0, 2]
    np.testing.assert_allclose(float(centre) * D, 0.00126532, rtol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "tolerance"), [("triangle", 0.015), ("quadrilateral", 0.002)])
def test_scordelis_lo_roof(kind, tolerance):
    """Middle of the free edge: 0.3024 down (MacNeal and Harder 1985)."""

    def held(index):
        return [(index[0], "x ry rz"), (index[:, 0], "x z"), (index[:, -1], "y rx rz")]

    arc = lambda a, b: (25 * np.sin(np.radians(40) * a), 25 * b, 25 * np.cos(np.radians(40) * a))
    section = ShellSection.isotropic(4.32e8, 0.0, 0.25, 1.0)
    structure, index = structure_of(kind, 8, arc, held, section)
    u = solve(structure, body_load(structure, (0.0, 0.0, -360.0)))
    np.testing.assert_allclose(u[index[-1, -1], 2], -0.3024, rtol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_warm_shell_expands(kind):
    """Warmth makes the forces that stretch the element by alpha dT."""
    section = ShellSection.isotropic(7e10, 0.3, 0.01)
    nodes, cells, _ = mesh(kind, 1, lambda a, b: (a, 0.8 * b, 0 * a))
    at, element = jnp.asarray(nodes[cells[0]]), KINDS[kind](section)
    expansion = section.membrane @ jnp.asarray([1e-5, 1e-5, 0.0])
    warm = element.thermal_load(at, expansion, jnp.full(len(at), 40.0))
    u = np.zeros((len(at), 6))
    u[:, :3] = 1e-5 * 40.0 * np.asarray(at)
    np.testing.assert_allclose(warm, element.stiffness(at) @ u.ravel(), rtol=1e-9, atol=1e-6)
