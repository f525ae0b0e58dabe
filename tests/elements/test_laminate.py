"""Laminates: published stiffness, closed forms of beams and plates, stresses and reserves of plies."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.elements import (
    Laminate,
    LayeredQuadrilateral,
    LayeredTriangle,
    hill_reserve,
    orthotropic,
    tsai_wu_reserve,
)
from jaxmbs.fem import Structure, assemble_dense, gather_rows, pressure_load, scatter_rows

#: Graphite-epoxy T300/5208 of Tsai and Hahn, Introduction to composite materials (1980), table 1.7 [Pa].
GRAPHITE = orthotropic(181e9, 10.3e9, 0.28, 7.17e9)
STRENGTHS = np.array([1500e6, 1500e6, 40e6, 246e6, 68e6])  # its table 7.1


def laminate(degrees, thickness=0.125e-3, **more):
    count = len(degrees)
    shear = np.tile(np.diag([7.17e9, 3.5e9]), (count, 1, 1))
    moduli = jnp.broadcast_to(GRAPHITE, (count, 3, 3))
    return Laminate(np.full(count, thickness), np.deg2rad(degrees), moduli, shear, np.full(count, 1600.0), **more)


def test_ply_of_graphite():
    """Q of table 1.7 of Tsai and Hahn: 181.81, 10.346, 2.897, 7.17 GPa."""
    expected = [[181.81, 2.897, 0], [2.897, 10.346, 0], [0, 0, 7.17]]
    np.testing.assert_allclose(np.asarray(GRAPHITE) / 1e9, expected, rtol=2e-4)


def test_ply_off_its_axes():
    """Q at 45 degrees of table 3.7 of Tsai and Hahn: 56.66, 42.32, 42.87, 46.59 GPa."""
    found = np.asarray(laminate([45.0]).turned_moduli())[0] / 1e9
    np.testing.assert_allclose(
        found, [[56.66, 42.32, 42.87], [42.32, 56.66, 42.87], [42.87, 42.87, 46.59]], rtol=3e-4
    )


def test_symmetric_and_angle_ply_laminates():
    """B vanishes under symmetry; of [t, -t] A16 does, and B16 = -t^2 Q16 / 4 (Jones 1999, 4.3 and 4.4)."""
    assert np.abs(laminate([0, 45, -45, 90, 90, -45, 45, 0]).section().coupling).max() < 1e-6
    found, t = laminate([30.0, -30.0]).section(), 2 * 0.125e-3
    Q = np.asarray(laminate([30.0]).turned_moduli())[0]
    np.testing.assert_allclose(found.membrane[0, 2], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.coupling[0, 2], -(t**2) / 4 * Q[0, 2], rtol=1e-12)
    np.testing.assert_allclose(found.bending[0, 0], t**3 / 12 * Q[0, 0], rtol=1e-12)
    np.testing.assert_allclose(found.area_mass, 1600.0 * t, rtol=1e-12)


def test_transverse_shear():
    """5/6 of one layer; of a sandwich with soft core `G d^2 / c`, faces thin (Allen, Structural sandwich panels)."""
    t = 0.01
    single = laminate([0.0], t).section()
    np.testing.assert_allclose(np.diag(single.shear), 5 / 6 * t * np.array([7.17e9, 3.5e9]), rtol=1e-12)
    face, core = np.diag([70e9, 70e9, 27e9]), np.diag([1e3, 1e3, 5e2])
    shear = np.array([np.eye(2) * G for G in (27e9, 50e6, 27e9)])
    sandwich = Laminate([1e-5, 0.02, 1e-5], np.zeros(3), [face, core, face], shear, np.zeros(3))
    np.testing.assert_allclose(np.diag(sandwich.section().shear), 50e6 * 0.02001**2 / 0.02, rtol=1e-4)


def test_offset_laminate():
    """The same layers over the nodes: strains there are e + z k."""
    middle, above = laminate([0, 60.0]).section(), laminate([0, 60.0], bottom=1e-3).section()
    moved = middle.shift(1e-3 + 0.125e-3)
    for name in ("membrane", "coupling", "bending", "area_mass", "turning_mass"):
        np.testing.assert_allclose(getattr(moved, name), getattr(above, name), rtol=1e-9, err_msg=name)


def test_stresses_of_plies():
    """Work of the plies is that of the resultants; a single ply under Nxx alone carries it along its fibres."""
    forces = jnp.asarray([1e4, 2e3, -3e3, 2.0, 1.0, 0.5])
    one = laminate([0.0], 1e-3)
    np.testing.assert_allclose(one.ply_stresses(forces)[0, 1], np.asarray(forces[:3]) / 1e-3, rtol=1e-12)
    above = np.asarray(forces[:3]) / 1e-3 + 6 * np.asarray(forces[3:]) / 1e-6
    np.testing.assert_allclose(one.ply_stresses(forces)[0, 2], above, rtol=1e-12, atol=1e-6)
    found = laminate([90.0], 1e-3).ply_stresses(forces)[0, 1]
    np.testing.assert_allclose(found, np.asarray(forces)[[1, 0, 2]] / 1e-3 * [1, 1, -1], rtol=1e-9)


def test_reserves():
    """Strengths have reserve one, and scale; Hill of a shear and a tension by hand; no stress has an infinite one."""
    for k, sign in ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1)):
        stress = np.zeros(3)
        stress[k] = sign * STRENGTHS[min(2 * k + (sign < 0), 4)]
        for reserve in (tsai_wu_reserve, hill_reserve):
            np.testing.assert_allclose(reserve(stress, STRENGTHS), 1.0, rtol=1e-12)
            np.testing.assert_allclose(reserve(stress / 4, STRENGTHS), 4.0, rtol=1e-12)
    np.testing.assert_allclose(hill_reserve([0.0, 20e6, 34e6], STRENGTHS), 1 / np.sqrt(0.25 + 0.25), rtol=1e-12)
    assert hill_reserve(np.zeros(3), STRENGTHS) == np.inf
    assert np.all(np.isfinite(jax.grad(lambda s: tsai_wu_reserve(s, STRENGTHS))(jnp.asarray([1e6, -2e6, 3e6]))))


def plate(kind, section, n, side):
    """A quarter of a simply supported square under 1 Pa: the deflection of its middle."""
    a, b = np.meshgrid(np.linspace(0, side / 2, n + 1), np.linspace(0, side / 2, n + 1), indexing="ij")
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    cells = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    element = LayeredQuadrilateral(section)
    if kind == "triangle":  # the x axis of each along its first side: the layers are turned back
        cells = np.concatenate([cells[:, [0, 1, 2]], cells[:, [2, 3, 0]]])
        element = [LayeredTriangle(section, angle) for angle in np.repeat([0.0, np.pi], len(cells) // 2)]
    held = {int(i): ["x", "y", "rz"] for i in index.ravel()}
    for rows, names in (
        (index[0], ["ry"]),
        (index[:, 0], ["rx"]),
        (index[-1], ["z", "rx"]),
        (index[:, -1], ["z", "ry"]),
    ):
        for i in rows:
            held[int(i)] = list(dict.fromkeys([*held[int(i)], *names]))
    structure = Structure(np.stack([a.ravel(), b.ravel(), 0 * a.ravel()], axis=1), {"p": (element, cells)}, held)
    load = gather_rows(structure, pressure_load(structure, "p", 1.0))
    return scatter_rows(structure, jnp.linalg.solve(assemble_dense(structure)[0], load))[0, 2]


def navier(section, side):
    """Middle of a specially orthotropic square plate under 1 Pa (Reddy, Mechanics of laminated composite plates and
    shells (2004), 5.2 and 6.2), by Navier's series, with transverse shear."""
    D, S, w = np.asarray(section.bending), np.asarray(section.shear), 0.0
    for m in range(1, 60, 2):
        for n in range(1, 60, 2):
            a, b = m * np.pi / side, n * np.pi / side
            q = 16 / (np.pi**2 * m * n)
            s = np.zeros((3, 3))
            s[0, 0] = S[0, 0] * a**2 + S[1, 1] * b**2
            s[0, 1], s[0, 2] = S[0, 0] * a, S[1, 1] * b
            s[1, 1] = D[0, 0] * a**2 + D[2, 2] * b**2 + S[0, 0]
            s[1, 2] = (D[0, 1] + D[2, 2]) * a * b
            s[2, 2] = D[2, 2] * a**2 + D[1, 1] * b**2 + S[1, 1]
            s = s + np.triu(s, 1).T
            w += np.linalg.solve(s, [q, 0, 0])[0] * np.sin(m * np.pi / 2) * np.sin(n * np.pi / 2)
    return w


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "thickness"), [("quadrilateral", 0.02), ("quadrilateral", 1e-3), ("triangle", 1e-3)]
)
def test_cross_ply_plate(kind, thickness):
    """[0 90 90 0], thick and thin, against Navier's series; what differs falls with the square of the mesh."""
    section, side = laminate([0, 90, 90, 0], thickness / 4).section(), 0.2
    exact = navier(section, side)
    errors = [abs(float(plate(kind, section, n, side)) / exact - 1) for n in (4, 8)]
    assert errors[1] < 0.01 and errors[1] < errors[0] / 2.5


@pytest.mark.slow
def test_coupled_strip():
    """[0 90] pulled by Nxx, free to bend as the inverse of A, B, D says: no moment, in distorted elements."""
    section = laminate([0.0, 90.0], 1e-3).section()
    nodes = np.array([[0, 0, 0], [1, 0, 0], [1.2, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0.0]]) * 0.1
    A, B, D = map(np.asarray, (section.membrane, section.coupling, section.bending))
    whole = np.block([[A, B], [B, D]])
    e = np.linalg.solve(whole, [1e4, 0, 0, 0, 0, 0])
    x, y = nodes[:, 0], nodes[:, 1]
    u = np.zeros((6, 6))
    u[:, 0], u[:, 1] = e[0] * x + e[2] * y / 2, e[1] * y + e[2] * x / 2
    u[:, 2] = -(e[3] * x**2 + e[4] * y**2 + e[5] * x * y) / 2
    u[:, 3], u[:, 4] = -(e[4] * y + e[5] * x / 2), e[3] * x + e[5] * y / 2
    cells = np.array([(0, 1, 2, 3), (1, 4, 5, 2)])
    for cell in cells:
        at, moved = jnp.asarray(nodes[cell]), jnp.asarray(u[cell])
        c, s = np.asarray(LayeredQuadrilateral(section).axes(at))[0, :2]
        turned = LayeredQuadrilateral(section, -np.arctan2(s, c))
        forces = np.asarray(jax.jit(lambda e, n, u: e.forces(n, u))(turned, at, moved))
        np.testing.assert_allclose(forces[:3], 1e4 * np.array([c * c, s * s, -c * s]), rtol=1e-6, atol=1e-5)
        np.testing.assert_allclose(forces[3:6], 0.0, atol=1e-2)
