"""Interface forces and shapes of a reduced beam against the whole one; error estimates against true errors."""

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.coupling._primal_assembly import interface_reactions, join
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble_dense, element_forces, element_stresses, recover_history
from jaxmbs.reductions import (
    Characteristic,
    CraigBampton,
    Unreduced,
    averaged_motion,
    averaged_transformation,
    reduce,
    rigid_body_motions,
    rigid_transformation,
    transform_interface,
)
from jaxmbs.reductions._accuracy import force_errors, frequency_errors, num_modes_below
from jaxmbs.reductions._base import numbered_labels, project
from jaxmbs.reductions._recovery import (
    element_loads,
    harmonic_amplitudes,
    interface_forces,
    mode_acceleration,
    mode_acceleration_free,
)
from jaxmbs.vibration._modes import natural_modes
from tests.structural_matrices import beam, beam_element, component

K, M = beam(10)
modes_of = jax.jit(lambda K, M, num=None: natural_modes(K=K, M=M, num=num), static_argnums=2)
held_modes = jax.jit(lambda K, M, at, num: reduce(component(K, M, at), CraigBampton(num)), static_argnums=(2, 3))
BASE, TIP = (0, 1), 20
BEAM = component(K, M, BASE)
OMEGA = jnp.array([3.0, 15.0])
LOAD = jnp.zeros((2, 22)).at[:, TIP].set(1.0)


@lru_cache
def harmonic_case(num_modes, held=True):
    """Amplitudes by the reduced and by the whole beam, base held or free, tip loaded at two frequencies."""
    shapes = modes_of(K, M, num_modes).shapes
    free = project(component(K, M, ()), shapes, numbered_labels("normal", num_modes))
    reduced = held_modes(K, M, BASE, num_modes) if held else free
    keep = slice(2, None) if held else slice(None)

    def solve(K, M, F):
        return jnp.stack([jnp.linalg.solve(K - w**2 * M, F[i]) for i, w in enumerate(OMEGA)])

    F = reduced.generalised_forces(LOAD)[:, keep]
    rho = solve(reduced.stiffness[keep, keep], reduced.mass[keep, keep], F)
    x = solve(K[keep, keep], M[keep, keep], LOAD[:, keep])
    if held:
        rho, x = (jnp.concatenate([jnp.zeros((2, 2)), y], axis=1) for y in (rho, x))
    complex_ = [jax.lax.complex(y, jnp.zeros_like(y)) for y in (rho, x)]
    return reduced, *complex_


def forces(x, x_ddot):
    return interface_forces(BEAM, x, x_ddot, LOAD)


@pytest.mark.long
def test_mode_acceleration_beats_mode_displacement():
    """Base reactions with three modes: 5 % off by displacement, 0.3 % by acceleration."""
    reduced, rho, exact = harmonic_case(3)
    x, _, x_ddot = harmonic_amplitudes(reduced.expand(rho), OMEGA)
    better = mode_acceleration(BEAM, x, x_ddot, LOAD)
    true = forces(exact, harmonic_amplitudes(exact, OMEGA)[2])
    errors = [np.max(np.abs(forces(y, x_ddot) / true - 1)) for y in (x, better)]
    assert errors[0] > 0.05
    assert errors[1] < 5e-3
    assert (
        0.3
        < float(force_errors(BEAM, x, x_ddot, LOAD)) * np.max(np.abs(true)) / np.max(np.abs(forces(x, x_ddot) - true))
        < 3
    )
    assert np.max(np.abs(better - exact)) < 1e-2 * np.max(np.abs(x - exact))


@pytest.mark.long
def test_bond_reactions_are_those_of_mode_acceleration():
    reduced, rho, _ = harmonic_case(3)
    x, _, x_ddot = harmonic_amplitudes(reduced.expand(rho), OMEGA)
    assembly = join((reduced,), ((-1, -1),))
    xi, _, xi_ddot = harmonic_amplitudes(rho[:, 2:], OMEGA)
    found = interface_reactions(assembly, xi.T, xi_ddot.T, None, (reduced.generalised_forces(LOAD).T,))
    better = mode_acceleration(BEAM, x, x_ddot, LOAD)
    np.testing.assert_allclose(found.forces[0].T, forces(better, x_ddot), rtol=1e-8)


@pytest.mark.long
def test_free_component_by_inertia_relief():
    """Five modes, two of them rigid: shape and curvature at the root of the loaded element."""
    reduced, rho, exact = harmonic_case(5, held=False)
    x, _, x_ddot = harmonic_amplitudes(reduced.expand(rho), OMEGA)
    better = mode_acceleration_free(BEAM, (0, 20), x, x_ddot, LOAD)
    k = beam_element(jnp.asarray(1.0), jnp.asarray(1.0), jnp.asarray(0.1))[0]
    T = jnp.eye(22)[16:20]
    moments = [np.asarray(element_loads(k, T, y))[:, 1] for y in (x, better, exact)]
    errors = [np.max(np.abs(m / moments[2] - 1)) for m in moments[:2]]
    assert errors[1] < 1e-3
    assert errors[1] < 0.02 * errors[0]


@pytest.mark.parametrize("element", range(3))
def test_loads_of_a_beams_element_in_closed_form(element):
    """A cantilever of EI = 2.5 under a force and a moment at its tip, exact for Hermite's beam: shear and moment."""
    EI, length, force, moment = 2.5, 1.2, 0.7, -0.3
    x = np.linspace(0.0, length, 4)
    w = (force * (3 * length - x) * x**2 / 6 + moment * x**2 / 2) / EI
    slope = (force * (2 * length - x) * x / 2 + moment * x) / EI
    k = beam_element(jnp.asarray(EI), jnp.asarray(1.0), jnp.asarray(length / 3))[0]
    T = jnp.eye(8)[2 * element : 2 * element + 4]
    bent = force * (length - x) + moment  # what the part beyond puts on the part before
    near, far = bent[element], bent[element + 1]
    shape = np.stack([w, slope], axis=1).ravel()
    exact = np.array([-force, -near, force, far])
    np.testing.assert_allclose(element_loads(k, T, jnp.asarray(shape)), exact, rtol=1e-10)
    cases = jnp.asarray(np.array([[1.0], [-2.0]])[..., None] * shape)  # (2, 1, 8): any axes come first
    np.testing.assert_allclose(element_loads(k, T, cases), np.array([1.0, -2.0])[:, None, None] * exact, rtol=1e-10)
    turned = element_loads(k, T, jnp.asarray((0.6 + 0.8j) * shape))
    np.testing.assert_allclose(turned, (0.6 + 0.8j) * exact, rtol=1e-10)


def test_loads_of_an_inclined_rod_in_closed_form():
    """EA / l = 50 N/m at 30 degrees, both ends moved: the pull along it on both, whatever moves across."""
    c, s, stiffness = np.cos(np.pi / 6), 0.5, 50.0
    T = jnp.array([[c, s, 0.0, 0.0], [0.0, 0.0, c, s]])
    k = stiffness * jnp.array([[1.0, -1.0], [-1.0, 1.0]])
    for along, across in ((0.01, 0.0), (-0.02, 0.3), (0.0, 0.1)):
        x = np.array([0.2, -0.1, 0.2 + along * c - across * s, -0.1 + along * s + across * c])
        pull = stiffness * along
        np.testing.assert_allclose(element_loads(k, T, jnp.asarray(x)), [-pull, pull], atol=1e-12)


@pytest.mark.long
def test_mode_acceleration_in_time_and_with_damping():
    """Exact for an exact motion, whatever its damping; at three times at once."""
    rng = np.random.default_rng(1)
    C = 0.1 * M + 0.02 * K
    x, v, a = (jnp.asarray(rng.normal(size=(3, 22))) for _ in range(3))
    load = x @ K + v @ C + a @ M
    damped = component(K, M, BASE, C)
    np.testing.assert_allclose(mode_acceleration(damped, x, a, load, v), x, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(interface_forces(damped, x, a, load, v), 0.0, atol=1e-8)


@pytest.mark.long
def test_frequency_error_estimates():
    """Estimates of the free beam's frequency errors lie within a factor of two of the true ones."""
    interface = (0, 1, 20, 21)
    reduced = held_modes(K, M, interface, 4)
    exact = modes_of(K, M, 6).frequencies[2:]
    found = modes_of(reduced.stiffness, reduced.mass, 6).frequencies[2:]
    estimate = frequency_errors(component(K, M, interface), reduced, 6)
    assert np.all(np.asarray(estimate[:2]) == 0.0)
    ratio = np.asarray(estimate[2:] / (found / exact - 1))
    assert np.all((ratio > 0.5) & (ratio < 2.0))


@pytest.mark.long
def test_number_of_modes_up_to_a_frequency():
    """The helper's number gives one per cent up to that frequency."""
    interface = (0, 1, 20, 21)
    exact = np.asarray(modes_of(K, M).frequencies)
    limit = float(exact[5])
    num = num_modes_below(component(K, M, interface), limit, 1.5)
    assert 3 <= num <= 8
    reduced = held_modes(K, M, interface, num)
    found = modes_of(reduced.stiffness, reduced.mass).frequencies
    np.testing.assert_allclose(found[2:6], exact[2:6], rtol=0.01)


@pytest.mark.long
def test_characteristic_modes():
    """All of them change nothing; fewer come from above."""
    whole = held_modes(K, M, (0, 1, 8, 9, 20, 21), 5)
    values = modes_of(whole.stiffness, whole.mass).values
    all_ = reduce(whole, Characteristic(6))
    np.testing.assert_allclose(modes_of(all_.stiffness, all_.mass).values, values, rtol=1e-7, atol=1e-4)
    few = reduce(whole, Characteristic(4))
    assert few.num_interface == 4 and [few.label(i) for i in (0, 1)] == ["characteristic 0", "characteristic 1"]
    found = modes_of(few.stiffness, few.mass).values
    assert np.all(found >= values[: len(found)] - 1e-5 - 1e-9 * values[: len(found)])
    np.testing.assert_allclose(found[2:4], values[2:4], rtol=0.02)


NODES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.3]])


def cage():
    """Four interface nodes and one inner node, springs of every direction between all: free in space."""
    rng = np.random.default_rng(3)
    p = np.vstack([NODES, [[0.4, 0.5, 1.0]]])
    stiffness = np.zeros((15, 15))
    for a in range(5):
        for b in range(a):
            n = (p[a] - p[b]) / np.linalg.norm(p[a] - p[b])
            row = np.zeros(15)
            row[3 * a : 3 * a + 3], row[3 * b : 3 * b + 3] = n, -n
            stiffness += rng.uniform(1, 2) * np.outer(row, row)
    return jnp.asarray(stiffness), jnp.eye(15), p


@pytest.mark.long
def test_rigid_and_averaged_interfaces():
    """Both see a rigid motion as it is; the averaged one lets its nodes strain, the rigid one does not."""
    K, M, p = cage()
    interface, reference = tuple(range(12)), jnp.array([0.5, 0.5, 0.0])

    @jax.jit
    def made(K, M, nodes):
        motions = rigid_body_motions(nodes, reference, rotations=False)
        rows = averaged_motion(nodes, reference, jnp.array([1.0, 2.0, 1.0, 1.0]), rotations=False)
        W = rigid_transformation(15, interface, motions)
        V = averaged_transformation(15, interface, rows, (0, 1, 2, 4, 5, 8))
        whole = component(K, M, interface)
        rigid, averaged = (reduce(transform_interface(whole, A, 6), CraigBampton(n)) for A, n in ((W, 3), (V, 9)))
        return motions, rows, rigid, averaged

    motions, rows, rigid, averaged = made(K, M, jnp.asarray(NODES))
    np.testing.assert_allclose(rows @ motions, np.eye(6), atol=1e-12)
    moved, root = np.random.default_rng(6).normal(size=12), np.sqrt(np.repeat([1.0, 2.0, 1.0, 1.0], 3))
    nearest = np.linalg.lstsq(root[:, None] * np.asarray(motions), root * moved, rcond=None)[0]
    np.testing.assert_allclose(rows @ moved, nearest, rtol=1e-9)  # the heavier node counts twice
    everywhere = np.asarray(rigid_body_motions(jnp.asarray(p), reference, rotations=False))
    for reduced in (rigid, averaged):
        b = slice(0, 6)
        np.testing.assert_allclose(reduced.basis[:, b] @ jnp.eye(6), everywhere, atol=1e-9)
        np.testing.assert_allclose(reduced.stiffness[b, b], 0.0, atol=1e-9)
        np.testing.assert_allclose(reduced.mass[b, b], everywhere.T @ M @ everywhere, atol=1e-9)
    np.testing.assert_allclose(rows @ averaged.basis[:12], np.eye(6, 15), atol=1e-9)
    exact = modes_of(K, M).values[6:]
    np.testing.assert_allclose(modes_of(averaged.stiffness, averaged.mass).values[6:], exact, rtol=1e-8)
    assert np.all(modes_of(rigid.stiffness, rigid.mass).values[6:] >= exact[:3] - 1e-9)
    whole = reduce(component(K, M, interface), Unreduced())
    np.testing.assert_allclose(modes_of(whole.stiffness, whole.mass).values[6:], exact, rtol=1e-9)


@pytest.mark.long
def test_stresses_of_elements_over_frequencies_and_times():
    """Stress at the root of a shaken beam by three modes: 1.5 % off by displacement, 1e-5 by acceleration.

    Times are phases of the same amplitudes, forces agree with stresses.
    """
    nodes = np.stack([np.linspace(0.0, 2.0, 7), np.zeros(7), np.zeros(7)], axis=1)
    beam_of = Beam(4.0, 1.0, 0.5, 0.2, 0.2, 0.1, density=2.0, fibres=((0.1, 0.0),))
    held = {k: "x z rx ry" for k in range(7)}
    structure = Structure(nodes, {"beam": (beam_of, [(k, k + 1) for k in range(6)])}, held=held)
    K, M = assemble_dense(structure)
    reduced, w = held_modes(K, M, (0, 1), 3), jnp.array([0.4, 0.9])
    load = jnp.zeros((2, 14)).at[:, 12].set(1.0)

    def solve(K, M, F):
        return jnp.stack([jnp.linalg.solve(K - v**2 * M, F[i]) for i, v in enumerate(w)])

    exact = jnp.zeros((2, 14)).at[:, 2:].set(solve(K[2:, 2:], M[2:, 2:], load[:, 2:]))
    own = reduced.generalised_forces(load)[:, 2:]
    rho = jnp.zeros((2, 5)).at[:, 2:].set(solve(reduced.stiffness[2:, 2:], reduced.mass[2:, 2:], own))
    phase = jnp.exp(0.3j)
    x, _, x_ddot = harmonic_amplitudes(phase * reduced.expand(rho).astype(complex), w)
    better = mode_acceleration(component(K, M, (0, 1)), x, x_ddot, phase * load.astype(complex))
    motions = jnp.stack([x, better, phase * exact.astype(complex)])
    stresses = recover_history(element_stresses, structure, motions)["beam"]
    assert stresses.shape == (3, 2, 6, 2)
    off, less = (np.max(np.abs(stresses[k, :, 0, 0] / stresses[2, :, 0, 0] - 1)) for k in (0, 1))
    assert off > 0.01 and less < 1e-4
    np.testing.assert_allclose(recover_history(element_stresses, structure, motions.real)["beam"], stresses.real)
    moments = recover_history(element_forces, structure, motions.real)["beam"][..., 5]
    np.testing.assert_allclose(stresses[..., 0].real, moments * 0.1 / 0.2, rtol=1e-9, atol=1e-12)
