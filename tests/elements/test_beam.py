"""Beams against closed forms and printed frequencies."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.elements import Beam, PointMass, Spring
from jaxmbs.fem import (
    Structure,
    assemble_dense,
    body_load,
    element_forces,
    element_stresses,
    gather_rows,
    line_load,
    nodal_load,
    scatter_rows,
)
from jaxmbs.math._stress import von_mises

E, G, A, IY, IZ, J, RHO = 2e11, 8e10, 1e-3, 2e-7, 1e-7, 3e-7, 7800.0
Y = (0.0, 1.0, 0.0)
matrices = jax.jit(assemble_dense)


@partial(jax.jit, static_argnames="loads")
def static(structure, loads):
    """Displacements (nodes, 6) under the loads (functions of the structure)."""
    load = sum(f(structure) for f in loads)
    return scatter_rows(structure, jnp.linalg.solve(assemble_dense(structure)[0], gather_rows(structure, load)))


def frequencies(K, M):
    """[Hz], ascending."""
    return np.sqrt(np.maximum(scipy.linalg.eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi)


def line(n, length, element, **options):
    nodes = np.zeros((n + 1, 3))
    nodes[:, 0] = np.linspace(0, length, n + 1)
    return Structure(nodes, {"beam": (element, [(i, i + 1) for i in range(n)])}, **options)


def test_frequencies_of_euler_bernoulli_beams():
    """The roots of cos x cosh x = -1 (cantilever) and 1 (free), 100 elements; classical closed forms (case S1)."""
    plane = {i: "x z rx ry" for i in range(101)}
    structure = line(100, 2.0, Beam(E, G, A, IY, IZ, J, RHO, reference=Y), held=plane)
    K, M = (np.asarray(a) for a in matrices(structure))
    unit = np.sqrt(E * IZ / (RHO * A)) / 2.0**2 / (2 * np.pi)
    held = np.sqrt(frequencies(K[2:, 2:], M[2:, 2:])[:4] / unit)
    np.testing.assert_allclose(held, [1.87510407, 4.69409113, 7.85475744, 10.99554073], rtol=1e-7)
    free = np.sqrt(frequencies(K, M)[2:6] / unit)
    np.testing.assert_allclose(free, [4.73004074, 7.85320462, 10.99560784, 14.13716549], rtol=2e-7)


def test_deep_simply_supported_beam():
    """NAFEMS FV5 (case S12): bending pairs, torsion, axial; Timoshenko's beam within 1 %."""
    a, inertia = 2.0, 2.0**4 / 12
    young = 200e9
    beam = Beam(young, young / 2.6, a * a, inertia, inertia, 2 * inertia, 8000.0, shear=(5 / 6, 5 / 6))
    structure = line(10, 10.0, beam, held={0: "x y z rx", 10: "y z"})
    expected = [42.649, 42.649, 77.542, 125.0, 148.31, 148.31, 233.10, 284.55, 284.55]
    found = frequencies(*matrices(structure))[:9]
    np.testing.assert_allclose(found, expected, rtol=1e-2)
    np.testing.assert_allclose(found[:3], expected[:3], rtol=2e-3)


def test_double_cross():
    """NAFEMS FV2 (case S10): eight pin-ended arms, sevenfold frequencies in the plane."""
    nodes, arms = {"centre": np.zeros(3)}, []
    for k in range(8):
        row = ["centre"] + [f"{k}.{j}" for j in range(1, 5)]
        for j in range(1, 5):
            nodes[row[j]] = 1.25 * j * np.array([np.cos(k * np.pi / 4), np.sin(k * np.pi / 4), 0])
        arms += list(zip(row[:-1], row[1:], strict=True))
    side = 0.125
    beam = Beam(200e9, 80e9, side**2, side**4 / 12, side**4 / 12, side**4 / 6, 8000.0)
    held = {name: "z rx ry" for name in nodes} | {f"{k}.4": "x y z rx ry" for k in range(8)}
    found = frequencies(*matrices(Structure(nodes, {"arms": (beam, arms)}, held)))[:16]
    np.testing.assert_allclose(found, [11.336, *[17.709] * 7, 45.345, *[57.390] * 7], rtol=1e-2)


@pytest.fixture(scope="module")
def cantilever():
    beam = Beam(E, G, A, IY, IZ, J, RHO, reference=Y, fibres=((0.02, 0.0), (0.0, 0.03)))
    return line(3, 1.5, beam, held={0: "all"})


@pytest.mark.long
def test_cantilever_under_every_load(cantilever):
    """Exact at the nodes whatever the mesh: end force, moment, torque, tension, line load, weight."""
    L, P = 1.5, 7.0
    u = static(cantilever, (lambda s: nodal_load(s, {"3": {"y": P}}),))
    np.testing.assert_allclose(
        u[3], [0, P * L**3 / (3 * E * IZ), 0, 0, 0, P * L**2 / (2 * E * IZ)], rtol=1e-10, atol=0
    )
    force = element_forces(cantilever, u)["beam"]
    np.testing.assert_allclose(force[0, [1, 5]], [-P, -P * L], rtol=1e-9)
    stress = element_stresses(cantilever, u)["beam"]
    np.testing.assert_allclose(
        stress[0], [-P * L * 0.02 / IZ, 0, -P * L * 2 / 3 * 0.02 / IZ, 0], rtol=1e-9, atol=1e-3
    )
    q = lambda s: line_load(s, "beam", (3.0, 0.0, P))
    u = static(cantilever, (q,))
    np.testing.assert_allclose(
        u[3, [0, 2, 4]], [3 * L**2 / (2 * E * A), P * L**4 / (8 * E * IY), -P * L**3 / (6 * E * IY)], rtol=1e-10
    )
    weight = lambda s: body_load(s, (0.0, 0.0, -9.81))
    v = static(cantilever, (weight, lambda s: nodal_load(s, {"3": (0, 0, 0, P, 0, 0)})))
    np.testing.assert_allclose(v[3, 2], -9.81 * RHO * A * L**4 / (8 * E * IY), rtol=1e-10)
    np.testing.assert_allclose(v[3, 3], P * L / (G * J), rtol=1e-10)
    amplitudes = jax.lax.complex(u + v, 2.0 * (u + v))
    loads = {"beam": np.array([3.0, 0.0, P]) * (1 + 2j)}, np.array([0.0, 0.0, -9.81]) * (1 + 2j)
    ends = element_forces(cantilever, amplitudes, *loads)["beam"]
    np.testing.assert_allclose(ends.imag, 2 * ends.real, rtol=1e-9, atol=1e-9)
    ends = ends.real
    q = P - 9.81 * RHO * A
    np.testing.assert_allclose(ends[0, [0, 2, 3, 4]], [-3 * L, -q * L, -P, q * L**2 / 2], rtol=1e-9)
    np.testing.assert_allclose(ends[2, 6:], [0, 0, 0, P, 0, 0], atol=1e-9 * abs(q))


@pytest.mark.parametrize(
    ("release", "arm", "expected"), [((), 0.0, (-6, -1, -6, 1)), (("rz2",), 0.3, (-7.5, -1.5, -4.5, 0))]
)
def test_one_clamped_beam_under_line_load(release, arm, expected):
    """Reactions q L / 2 and moments q L^2 / 12; propped, beside its nodes: 5/8, 3/8 and 1/8."""
    L, q = 1.5, 7.0
    offsets, fibres = np.full((2, 3), (0.0, 0.0, arm)), ((0.02, 0.0),)
    beam = Beam(E, G, A, IY, IZ, J, RHO, reference=Y, releases=release, offsets=offsets, fibres=fibres)

    @jax.jit
    def held(beam, nodes, q):
        u, load = jnp.zeros((2, 6)), beam.line_load(nodes, q)
        return beam.forces(nodes, u, load), beam.stresses(nodes, u, load)

    ends, stress = held(beam, jnp.array([[0.0, 0, 0], [L, 0, 0]]), jnp.array([0.0, q, 0.0]))
    units = q * L / 12 * np.array([1.0, L, 1.0, L])
    np.testing.assert_allclose(ends[np.array([1, 5, 7, 11])], units * expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(stress[0], units[1] * expected[1] * 0.02 / IZ, rtol=1e-12)


@pytest.mark.long
def test_shear_release_and_offset():
    """Timoshenko's tip deflection; a pin inside a clamped beam; a tip mass carried by an arm."""
    L, P, k = 1.5, 7.0, 0.6
    thick = Beam(E, G, A, IY, IZ, J, RHO, reference=Y, shear=(k, k))
    u = static(line(2, L, thick, held={0: "all"}), (lambda s: nodal_load(s, {"2": {"z": P}}),))
    np.testing.assert_allclose(u[2, 2], P * L**3 / (3 * E * IY) + P * L / (k * G * A), rtol=1e-10)
    halves = [
        Beam(E, G, A, IY, IZ, J, RHO, reference=Y),
        Beam(E, G, A, IY, IZ, J, RHO, reference=Y, releases=("ry1",)),
    ]
    nodes = {"a": (0.0, 0, 0), "pin": (L / 2, 0, 0), "b": (L, 0, 0)}
    elements = {"left": (halves[0], [("a", "pin")]), "right": (halves[1], [("pin", "b")])}
    structure = Structure(nodes, elements, {"a": "all", "b": "all"})
    u = static(structure, (lambda s: nodal_load(s, {"pin": {"z": P}}),))
    np.testing.assert_allclose(u[1, 2], P * (L / 2) ** 3 / (6 * E * IY), rtol=1e-10)
    np.testing.assert_allclose(element_forces(structure, u)["right"][0, 4], 0.0, atol=1e-10 * P)
    arm = ((0.0, 0.0, 0.2), (0.0, 0.0, 0.2))  # a beam beside its nodes: axial force bends it
    beside = line(1, L, Beam(E, G, A, IY, IZ, J, reference=Y, offsets=arm), held={0: "all"})
    u = static(beside, (lambda s: nodal_load(s, {"1": {"x": P}}),))
    np.testing.assert_allclose(u[1, 0], P * L / (E * A) + P * 0.2 * 0.2 * L / (E * IY), rtol=1e-10)


def test_mass_on_a_bushing():
    """A rigid body on a bushing: three frequencies of a body off its mount in closed form; damper in the assembly."""
    k, m, inertia = 4e4, 3.0, 0.02
    nodes = {"ground": (0.0, 0, 0), "body": (0.0, 0, 0)}
    bush = Spring((k, 2 * k, 3 * k, 50.0, 60.0, 70.0), damper=(1.0, 2, 3, 4, 5, 6))
    elements = {
        "bush": (bush, [("ground", "body")]),
        "body": (PointMass(m, inertia=inertia * np.eye(3)), [("body",)]),
    }
    structure = Structure(nodes, elements, {"ground": "all"})
    expected = np.sort(np.sqrt([k / m, 2 * k / m, 3 * k / m, 50 / inertia, 60 / inertia, 70 / inertia])) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(*matrices(structure)), expected, rtol=1e-12)
    (C,) = assemble_dense(structure, ("damping",))
    np.testing.assert_allclose(C, np.diag([1.0, 2, 3, 4, 5, 6]), atol=1e-15)


@pytest.mark.long
def test_gradients_and_batches_of_a_cantilever(cantilever):
    """Tip deflection by modulus and length, many lengths at once, in closed form."""
    nodes = np.asarray(cantilever.positions) / 1.5

    def tip(young, length):
        beam = Beam(young, G, A, IY, IZ, J, reference=Y)
        moved = Structure(nodes * length, {"beam": (beam, [(0, 1), (1, 2), (2, 3)])}, {0: "all"})
        load = gather_rows(moved, nodal_load(moved, {"3": {"y": 1.0}}))
        return scatter_rows(moved, jnp.linalg.solve(assemble_dense(moved)[0], load))[3, 1]

    lengths = jnp.array([1.0, 1.5, 2.0])
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(tip, (0, 1)), (None, 0)))(jnp.asarray(E), lengths)
    exact = lengths**3 / (3 * E * IZ)
    np.testing.assert_allclose(value, exact, rtol=1e-9)
    np.testing.assert_allclose(slope[0], -exact / E, rtol=1e-9)
    np.testing.assert_allclose(slope[1], 3 * exact / lengths, rtol=1e-9)


def test_von_mises_stress_of_a_shaft_under_torque_tension_and_shear():
    """`sqrt(sigma^2 + 3 tau^2)` of a round shaft: by torque at its surface, by shear, `4 Q / 3 A`, on its axis."""
    r, N, T, Q = 0.02, 5e3, 80.0, 2e3
    area, second = np.pi * r**2, np.pi * r**4 / 4
    shears = np.zeros((2, 2, 3))
    shears[0, 0, 2] = -r / (2 * second)  # torque at (0, r)
    shears[1, 0, 0] = 4 / (3 * area)  # shear force at (0, 0)
    fibres = [(0.0, r), (0.0, 0.0)]
    beam = Beam(E, G, area, second, second, 2 * second, fibres=fibres, fibre_shears=shears)
    end = np.array([N, Q, 0.0, T, 0.0, 0.0])

    @jax.jit
    def at(ends):
        tensors = beam.stress_tensors(beam.stresses_of_ends(ends))
        return tensors, von_mises(tensors)

    tensors, found = at(jnp.asarray(np.concatenate([-end, end])))
    axial, turn, push = N / area, T * r / (2 * second), 4 * Q / (3 * area)
    np.testing.assert_allclose(tensors[:2], [[axial, 0, 0, -turn, 0, 0], [axial, 0, 0, push, 0, 0]], rtol=1e-12)
    np.testing.assert_allclose(found, np.sqrt(axial**2 + 3 * np.array([turn, push, turn, push]) ** 2), rtol=1e-12)
    wrong = Beam(E, G, A, IY, IY, J, fibres=fibres, fibre_shears=shears[:1])
    assert "fibre_shears must be (2, 2, 3)" in wrong.faults()[0]
