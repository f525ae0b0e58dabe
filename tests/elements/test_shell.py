"""Shells and solids: patch tests and benchmarks of MacNeal and Harder, Finite Elem. Anal. Des. 1 (1985) 3-20."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.elements import Hexahedron, Quadrilateral, Triangle
from jaxmbs.fem import (
    Structure,
    assemble_dense,
    body_load,
    element_stresses,
    gather_rows,
    nodal_load,
    pressure_load,
    scatter_rows,
)

SHELLS = {"triangle": Triangle, "quadrilateral": Quadrilateral}


@jax.jit
def solve(structure, load):
    return scatter_rows(structure, jnp.linalg.solve(assemble_dense(structure)[0], gather_rows(structure, load)))


@partial(jax.jit, static_argnames="inner")
def patch(structure, u, inner):
    """Displacements with those of the boundary given, and the stresses."""
    K = assemble_dense(structure)[0]
    x, rows = gather_rows(structure, u), structure.index.table[np.array(inner)].ravel()
    rows = rows[rows >= 0]
    x = x.at[rows].set(0.0)
    x = x.at[rows].set(-jnp.linalg.solve(K[np.ix_(rows, rows)], (K @ x)[rows]))
    return scatter_rows(structure, x), element_stresses(structure, x)["p"]


PLATE = [[0, 0], [0.24, 0], [0.24, 0.12], [0, 0.12], [0.04, 0.02], [0.18, 0.03], [0.16, 0.08], [0.08, 0.08]]
PATCHES = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)]


def split(quads):
    return [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


@pytest.mark.long
@pytest.mark.parametrize("kind", SHELLS)
def test_patch_of_shells(kind):
    """Membrane 1333, 1333, 400; bending 0.667, 0.667, 0.200, on five distorted elements."""
    nodes = np.pad(np.array(PLATE, float), ((0, 0), (0, 1)))
    shell = SHELLS[kind](1e6, 0.25, 0.001)
    structure = Structure(nodes, {"p": (shell, PATCHES if kind == "quadrilateral" else split(PATCHES))})
    x, y, _ = nodes.T
    stretched, bent = np.zeros((2, 8, 6))
    stretched[:, 0], stretched[:, 1] = 1e-3 * (x + y / 2), 1e-3 * (y + x / 2)
    bent[:, 2] = 1e-3 * (x**2 + x * y + y**2) / 2
    bent[:, 3], bent[:, 4] = 1e-3 * (x / 2 + y), -1e-3 * (x + y / 2)
    for u, principal in ((stretched, (1733.3333333, 933.3333333)), (bent, (0.8666666667, 0.4666666667))):
        found, stress = patch(structure, jnp.asarray(u), (4, 5, 6, 7))
        np.testing.assert_allclose(found, u, atol=1e-12)
        top, sign = np.asarray(stress[:, :3]), 1.0 if u is stretched else -1.0  # a bowl upwards presses its top
        centre, radius = (top[:, 0] + top[:, 1]) / 2, np.hypot((top[:, 0] - top[:, 1]) / 2, top[:, 2])
        np.testing.assert_allclose(sign * centre + radius, principal[0], rtol=1e-8)  # element axes are turned
        np.testing.assert_allclose(sign * centre - radius, principal[1], rtol=1e-8)


INSIDE = [[0.249, 0.342, 0.192], [0.826, 0.288, 0.288], [0.850, 0.649, 0.263], [0.273, 0.750, 0.230]]
INSIDE += [[0.320, 0.186, 0.643], [0.677, 0.305, 0.683], [0.788, 0.693, 0.644], [0.165, 0.745, 0.702]]
CORNERS = [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def test_patch_of_solids():
    """Stresses 2000, 2000, 2000, 400, 400, 400 in seven distorted bricks."""
    nodes = np.array(INSIDE + CORNERS)
    bricks = [tuple(range(8))]
    for face in FACES:
        inner, outer = list(face), [i + 8 for i in face]
        volume = np.dot(
            np.cross(nodes[outer[1]] - nodes[outer[0]], nodes[outer[3]] - nodes[outer[0]]),
            nodes[inner[0]] - nodes[outer[0]],
        )
        bricks.append(tuple(outer + inner if volume > 0 else inner + outer))
    structure = Structure(nodes, {"p": (Hexahedron(1e6, 0.25), bricks)})
    u = np.zeros((16, 6))
    u[:, :3] = 1e-3 * nodes @ (np.ones((3, 3)) + np.eye(3)) / 2
    found, stress = patch(structure, jnp.asarray(u), tuple(range(8)))
    np.testing.assert_allclose(found, u, atol=1e-15)
    np.testing.assert_allclose(stress, np.tile([2000.0] * 3 + [400.0] * 3, (7, 1)), rtol=1e-9)


def grid(n, place):
    """Nodes of an n x n mesh, its squares, and node numbers (n + 1, n + 1)."""
    a, b = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    squares = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    return np.stack(place(a.ravel(), b.ravel()), axis=1), squares, index


def shell_structure(kind, n, place, held, *numbers, flip=False):
    nodes, squares, index = grid(n, place)
    squares = np.roll(squares, 1, axis=1) if flip else squares
    cells = squares if kind == "quadrilateral" else np.array(split(squares))
    directions = {}
    for rows, names in held(index):
        for node in np.ravel(rows):
            directions[int(node)] = f"{directions.get(int(node), '')} {names}"
    return Structure(nodes, {"p": (SHELLS[kind](*numbers), cells)}, directions), index


@pytest.mark.parametrize(
    ("kind", "tolerance"), [pytest.param("triangle", 0.055, marks=pytest.mark.long), ("quadrilateral", 0.02)]
)
def test_cooks_membrane(kind, tolerance):
    """Tip of the tapered panel in shear: 23.96 (Cook, J. Struct. Div. ASCE 100 (1974) 1851-1863)."""
    held = lambda index: [(index[0], "x y rz"), (index, "z rx ry")]
    place = lambda a, b: (48 * a, 44 * a + b * (44 - 28 * a), 0 * a)
    structure, index = shell_structure(kind, 8, place, held, 1.0, 1 / 3, 1.0, flip=True)
    share = np.full(9, 1 / 8)
    share[[0, -1]] /= 2
    load = nodal_load(structure, {int(i): {"y": s} for i, s in zip(index[-1], share, strict=True)})
    np.testing.assert_allclose(solve(structure, load)[index[-1, 4], 1], 23.96, rtol=tolerance)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "tolerance"), [("triangle", 0.02), ("quadrilateral", 0.005)])
def test_thin_clamped_plate_under_pressure(kind, tolerance):
    """0.00126532 p a^4 / D at the centre (Timoshenko and Woinowsky-Krieger), a/t = 1000: no shear locking."""

    def held(index):
        return [(index, "x y rz"), (index[0], "ry"), (index[:, 0], "rx"), (index[-1], "all"), (index[:, -1], "all")]

    D = 1e6 * 0.001**3 / 12 / (1 - 0.09)
    errors = []
    for n in (4, 8):
        structure, _ = shell_structure(kind, n, lambda a, b: (a / 2, b / 2, 0 * a), held, 1e6, 0.3, 0.001)
        centre = solve(structure, pressure_load(structure, "p", 1.0))[0, 2]
        errors.append(abs(float(centre) * D / 0.00126532 - 1))
    assert errors[1] < tolerance and errors[0] > 3.5 * errors[1]  # second order


@pytest.mark.slow
def test_a_strip_with_residual_bending_is_a_beam():
    """One element, a force at its end: P l^3 / 3 E I, of a rhombus as of a square; without it 25 % less."""
    held = {0: "all", 3: "all", **dict.fromkeys((1, 2), "x y rz")}
    for lean, tolerance in ((0.0, 1e-6), (0.2, 0.1)):
        nodes = np.array([[0.0, 0, 0], [1, lean, 0], [1, 1 + lean, 0], [0, 1, 0]])
        tips = []
        for residual in (True, False):
            shell = Quadrilateral(1e6, 0.0, 0.01, residual_bending=residual)
            structure = Structure(nodes, {"p": (shell, [(0, 1, 2, 3)])}, held)
            tips.append(solve(structure, nodal_load(structure, {1: {"z": 0.5}, 2: {"z": 0.5}}))[1:3, 2].mean())
        exact = 1.0 / (3 * 1e6 * 0.01**3 / 12) + 1.0 / (5 / 6 * 5e5 * 0.01)
        np.testing.assert_allclose(tips[0], exact, rtol=max(tolerance, 1e-5))
        assert tips[1] < 0.8 * exact


@pytest.mark.parametrize("kind", ["triangle", pytest.param("quadrilateral", marks=pytest.mark.slow)])
def test_thick_plate_with_supported_edges(kind):
    """w = 0.00406235 p a^4 / D + 0.0736713 p a^2 / (5/6 G t) (Wang, J. Eng. Mech. 121 (1995) 1211-1217); a/t = 4."""

    def held(index):
        return [(index, "x y rz"), (index[0], "ry"), (index[:, 0], "rx"), (index[-1], "z rx"), (index[:, -1], "z ry")]

    structure, _ = shell_structure(kind, 6, lambda a, b: (a / 2, b / 2, 0 * a), held, 1e6, 0.3, 0.25)
    D, S = 1e6 * 0.25**3 / 12 / (1 - 0.09), 5 / 6 * 0.25 * 1e6 / 2.6
    centre = solve(structure, pressure_load(structure, "p", 1.0))[0, 2]
    np.testing.assert_allclose(centre, 0.00406235 / D + 0.0736713 / S, rtol=0.015)


@pytest.mark.parametrize(("kind", "tolerance"), [("triangle", 0.02), ("quadrilateral", 0.01)])
def test_scordelis_lo_roof(kind, tolerance):
    """Middle of the free edge: 0.3024 down (MacNeal and Harder), bending and membrane in a curved shell."""

    def held(index):
        return [(index[0], "x ry rz"), (index[:, 0], "x z"), (index[:, -1], "y rx rz")]

    arc = lambda a, b: (25 * np.sin(np.radians(40) * a), 25 * b, 25 * np.cos(np.radians(40) * a))
    structure, index = shell_structure(kind, 8, arc, held, 4.32e8, 0.0, 0.25, 1.0)
    u = solve(structure, body_load(structure, (0.0, 0.0, -360.0)))  # 90 per unit of area
    np.testing.assert_allclose(u[index[-1, -1], 2], -0.3024, rtol=tolerance)


def block(nx, ny, nz, size):
    """Nodes and bricks of a block."""
    counts = (nx, ny, nz)
    axes = [np.linspace(0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    nodes = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    index = np.arange(len(nodes)).reshape(nx + 1, ny + 1, nz + 1)
    corners = [index[a : nx + a, b : ny + b, c : nz + c].ravel() for a, b, c in np.array(CORNERS, int)]
    return nodes, np.stack(corners, axis=1), index


def test_slender_brick_beam():
    """6 x 0.2 x 0.1, six elements (MacNeal and Harder's beam): 3e-5, 0.1081 and 0.4321 at the end."""
    nodes, bricks, index = block(6, 1, 1, (6.0, 0.2, 0.1))
    structure = Structure(
        nodes, {"p": (Hexahedron(1e7, 0.3, 2.0), bricks)}, {int(i): "x y z" for i in index[0].ravel()}
    )
    for direction, exact, tolerance in (("x", 3e-5, 0.02), ("y", 0.1081, 0.03), ("z", 0.4321, 0.03)):
        load = nodal_load(structure, {int(i): {direction: 0.25} for i in index[-1].ravel()})
        tip = solve(structure, load)[index[-1, 0, 0], "xyz".index(direction)]
        np.testing.assert_allclose(tip, exact, rtol=tolerance)


def test_pressure_on_a_face_and_weight_balance():
    """Resultants: pressure times area into the face; mass times field."""
    nodes, bricks, index = block(6, 1, 1, (6.0, 0.2, 0.1))
    structure = Structure(nodes, {"p": (Hexahedron(1e7, 0.3, 2.0), bricks)})
    for face, direction in enumerate(np.repeat(np.eye(3), 2, axis=0) * np.array([1, -1] * 3)[:, None]):
        area = (0.2 * 0.1 * 6, 0.1 * 6.0, 0.2 * 6.0)[face // 2]
        total = jnp.sum(pressure_load(structure, "p", 5.0, face=face), axis=0)
        np.testing.assert_allclose(total, [*(5.0 * area * direction), 0, 0, 0], atol=1e-12)
    weight = jnp.sum(body_load(structure, (1.0, 2.0, 3.0)), axis=0)
    np.testing.assert_allclose(weight, np.array([1.0, 2, 3, 0, 0, 0]) * 2.0 * 0.12, rtol=1e-12)
