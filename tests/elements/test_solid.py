"""Solids of every shape: patch test, thick plate of NAFEMS, warmth, forces on faces."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import elements as el
from jaxmbs.fem import Structure, assemble_dense, gather_rows, pressure_load, scatter_rows

TETRAHEDRA = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]
CELLS = {  # corners by their number x + 2 y + 4 z in a cube
    "Hexahedron": [(0, 1, 3, 2, 4, 5, 7, 6)],
    "Wedge": [(0, 1, 3, 4, 5, 7), (0, 3, 2, 4, 7, 6)],
    "Tetrahedron": TETRAHEDRA,
}
CELLS |= {f"Quadratic{name}": cells for name, cells in CELLS.items()}
SOLIDS = [pytest.param(kind, marks=[pytest.mark.slow] if kind.startswith("Quadratic") else []) for kind in CELLS]


def block(kind, counts):
    """Places in the unit cube of the nodes of a block, and its elements, whose edges have their middles as nodes."""
    rule = getattr(el, kind).rule
    fine = 2 * np.array(counts) + 1
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, n) for n in fine], indexing="ij"), axis=-1).reshape(-1, 3)
    bits = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)])
    places = [2 * np.array(cube) + 2 * bits[list(cell)] for cube in np.ndindex(*counts) for cell in CELLS[kind]]
    places = [[*at, *((at[a] + at[b]) // 2 for a, b in rule.edges)] for at in places]
    cells = np.ravel_multi_index(np.moveaxis(np.array(places), -1, 0), fine)
    used, cells = np.unique(cells, return_inverse=True)
    return grid[used], cells.reshape(len(places), -1)


@jax.jit
def solve(structure, load):
    return scatter_rows(structure, jnp.linalg.solve(assemble_dense(structure)[0], gather_rows(structure, load)))


@jax.jit
def corner_stresses(structure, u):
    group = structure.groups["p"]
    return group.map(lambda e, n, u: e.corner_stresses(n, u), structure.positions, u[group.connections, :3])


@pytest.mark.parametrize("kind", SOLIDS)
def test_patch(kind):
    """Stresses 2000 2000 2000 400 400 400 at all corners (MacNeal and Harder 1985), with inner nodes anywhere."""
    nodes, cells = block(kind, (2, 2, 2))
    rule, shift = getattr(el, kind).rule, np.random.default_rng(2).uniform(-0.15, 0.15, nodes.shape)
    nodes = nodes + np.all((nodes > 0) & (nodes < 1), axis=1, keepdims=True) * shift
    for k, (a, b) in enumerate(rule.edges):  # straight edges
        nodes[cells[:, rule.corners + k]] = (nodes[cells[:, a]] + nodes[cells[:, b]]) / 2
    structure = Structure(nodes, {"p": (getattr(el, kind)(1e6, 0.25), cells)})
    u = 1e-3 * nodes @ (np.ones((3, 3)) + np.eye(3)) / 2
    free = np.repeat(np.all((nodes > 1e-9) & (nodes < 1 - 1e-9), axis=1), 3)
    K, x = np.asarray(assemble_dense(structure)[0]), u.reshape(-1).copy()
    x[free] = np.linalg.solve(K[np.ix_(free, free)], -K[np.ix_(free, ~free)] @ x[~free])
    np.testing.assert_allclose(x.reshape(-1, 3), u, atol=1e-14)
    found = corner_stresses(structure, x.reshape(-1, 3))
    np.testing.assert_allclose(found, np.broadcast_to([2000.0] * 3 + [400.0] * 3, found.shape), rtol=1e-9)


def thick_plate(kind, counts):
    """A quarter of an elliptic plate, 0.6 m thick, held round its rim, under 1 MPa; sigma_yy [MPa] in D."""
    x, cells = block(kind, counts)
    radius, angle, height = x[:, :1], x[:, 1] * np.pi / 2, x[:, 2]
    ellipse = lambda a, b: np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1)
    nodes = np.column_stack([(1 - radius) * ellipse(2, 1) + radius * ellipse(3.25, 2.75), 0.6 * height])
    held = {}
    for n, (r, a, z) in enumerate(x.tolist()):
        names = ["y"] * (a == 0) + ["x"] * (a == 1) + ["x", "y"] * (r == 1) + ["z"] * (r == 1 and z == 0.5)
        held |= {n: list(dict.fromkeys(names))} if names else {}
    solid = getattr(el, kind)(210e9, 0.3)
    structure, load = Structure(nodes, {"p": (solid, cells)}, held), 0.0
    for face, side in enumerate(solid.rule.faces):
        loaded = np.all(height[cells[:, side]] == 1, axis=1)
        if np.any(loaded):
            load += pressure_load(structure, "p", np.where(loaded, 1e6, 0.0), face=face)
    u, corner = solve(structure, load), np.argmin(np.abs(x - [0, 0, 1]).sum(axis=1))
    at = cells[:, : solid.rule.corners] == corner
    return np.asarray(corner_stresses(structure, u))[at][:, 1].mean() / 1e6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "counts", "tolerance"),
    [
        ("QuadraticHexahedron", (4, 6, 2), 0.04),
        ("QuadraticWedge", (4, 6, 2), 0.01),
        ("QuadraticTetrahedron", (4, 6, 2), 0.02),
    ],
)
def test_thick_plate_of_nafems(kind, counts, tolerance):
    """LE10 of The standard NAFEMS benchmarks (1990): sigma_yy = -5.38 MPa at D."""
    np.testing.assert_allclose(thick_plate(kind, counts), -5.38, rtol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SOLIDS)
def test_warm_block_expands_freely(kind):
    """Warmth makes the forces that stretch a block by alpha dT, with an anisotropic expansion."""
    nodes, cells = block(kind, (1, 1, 1))
    expansion = jnp.asarray([1e-5, 2e-5, 3e-5, 4e-6, 0.0, 0.0])
    solid = getattr(el, kind)(7e10, 0.33)
    strain = np.array([[1.0, 0.2, 0], [0.2, 2, 0], [0, 0, 3]]) * 1e-5 * 50.0
    warm = jax.vmap(lambda n: solid.thermal_load(n, expansion, jnp.full(len(n), 50.0)))(jnp.asarray(nodes[cells]))
    stretched = jax.vmap(lambda n, u: solid.stiffness(n) @ u)(
        nodes[cells], (nodes @ strain)[cells].reshape(len(cells), -1)
    )
    np.testing.assert_allclose(warm, stretched, rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("kind", [one for one in SOLIDS if one.values[0] not in ("Wedge", "Tetrahedron")])
def test_a_linear_temperature_strains_nothing(kind):
    """A block that is free bends without stress: `u = alpha (T x - g x.x / 2)` where T = g.x."""
    nodes, cells = block(kind, (1, 1, 1))
    g, solid = np.array([3.0, -2, 5]), getattr(el, kind)(7e10, 0.33)
    T = nodes @ g
    u = 1e-5 * (T[:, None] * nodes - g / 2 * np.sum(nodes**2, axis=1, keepdims=True))
    expansion = jnp.asarray([1e-5, 1e-5, 1e-5, 0, 0, 0])
    warm, moved = np.zeros((2, len(nodes), 3))
    for cell in cells:
        at = jnp.asarray(nodes[cell])
        warm[cell] += np.asarray(solid.thermal_load(at, expansion, jnp.asarray(T[cell]))).reshape(-1, 3)
        moved[cell] += np.asarray(solid.stiffness(at) @ u[cell].reshape(-1)).reshape(-1, 3)
    np.testing.assert_allclose(moved, warm, atol=1e-9 * np.max(np.abs(warm)))


@pytest.mark.parametrize("kind", SOLIDS)
def test_moduli_of_an_isotropic_material(kind):
    """The matrix of an isotropic material makes the same stiffness as its two numbers."""
    nodes, cells = block(kind, (1, 1, 1))
    plain = getattr(el, kind)(7e10, 0.33)
    whole = getattr(el, kind)(1.0, 0.0, moduli=plain.elasticity())
    at = jnp.asarray(nodes[cells[0]])
    np.testing.assert_allclose(whole.stiffness(at), plain.stiffness(at), rtol=1e-12, atol=1e-2)


@pytest.mark.parametrize("kind", SOLIDS)
def test_pressure_on_all_faces_balances(kind):
    """Into a block from everywhere: each face has its area along its inward normal, the sum is zero."""
    nodes, cells = block(kind, (1, 1, 1))
    structure = Structure(nodes, {"p": (getattr(el, kind)(1.0, 0.3), cells)})
    total = 0.0
    for face in range(len(getattr(el, kind).rule.faces)):
        load = np.asarray(pressure_load(structure, "p", 2.0, face=face))[:, :3]
        total = total + load.sum(axis=0)
    np.testing.assert_allclose(total, 0.0, atol=1e-14)
    element = getattr(el, kind)(1.0, 0.3)
    side = np.array(element.rule.faces[0])
    own, at = element.pressure_load(jnp.asarray(nodes[cells[0]]), 2.0, 0).reshape(-1, 3), nodes[cells[0]][side]
    normal = np.cross(at[1] - at[0], at[2] - at[0])
    assert np.sum(own, axis=0) @ normal < 0
