"""Masses beside their nodes: turns about the mass have none, and are condensed, which is exact."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs import elements, fem
from jaxmbs.reductions import CraigBampton, Guyan, reduce
from jaxmbs.vibration import ModalSuperposition

NODES = ("b", "c")
NAMES = [f"{node} {direction}" for node in NODES for direction in elements.DIRECTIONS]
TURNS = [k for k, name in enumerate(NAMES) if " r" in name]


def point_mass(m, c):
    """Mass matrix (6, 6) at a node of a mass m at c from it, by the velocity of the mass `v + w x c`."""
    x, y, z = c
    J = jnp.stack([jnp.array(row) for row in ([1.0, 0, 0, 0, z, -y], [0, 1.0, 0, -z, 0, x], [0, 0, 1.0, y, -x, 0])])
    return m * J.T @ J


def mass_of(m=3.0, e=0.2):
    first, second = point_mass(m, (e, 0.05, -0.1)), point_mass(2.0 * m, (0.0, e, 0.0))
    return jax.scipy.linalg.block_diag(first, second)


def stiffness(seed=0):
    A = np.random.default_rng(seed).standard_normal((12, 12))
    return 1e3 * (A @ A.T + np.eye(12))


def system(M=None, **options):
    return mbs.LinearSystem(mass=mass_of() if M is None else M, stiffness=stiffness(), coordinates=NAMES, **options)


def finite_values(K, M):
    """Finite eigenvalues, from SciPy's of the inverse problem, whose matrix on the left is regular."""
    inverse = scipy.linalg.eigh(M, K, eigvals_only=True)
    return np.sort(1.0 / inverse[inverse > 1e-12 * inverse[-1]])


def test_modes_are_the_finite_ones_of_the_pencil():
    K, M = stiffness(), np.asarray(mass_of())
    found = mbs.modes(system())
    np.testing.assert_allclose(found.values, finite_values(K, M), rtol=1e-10)
    X = np.asarray(found.shapes)
    assert X.shape == (12, np.linalg.matrix_rank(M))
    np.testing.assert_allclose(X.T @ M @ X, np.eye(X.shape[1]), atol=1e-12)
    residual = K @ X - M @ X * np.asarray(found.values)
    assert np.max(np.abs(residual)) < 1e-12 * np.max(np.abs(K)) * np.max(np.abs(X))
    with pytest.raises(ValueError, match="there are 6 modes, as many as the rank of the mass matrix"):
        mbs.modes(system(), 7)


def test_a_massless_beam_with_a_mass_beside_its_tip():
    """`w^2 m (L^3 / 3 + L^2 e + L e^2) = E I`: the force of the mass bends the beam, and its arm turns the tip."""
    E, I, A, L, m, e = 210e9, 1e-8, 1e-4, 1.0, 3.0, 0.2
    beam, mass = elements.Beam(E, 80e9, A, I, I, 2 * I), elements.PointMass(m, offset=(e, 0.0, 0.0))
    nodes = {"a": (0, 0, 0), "b": (L / 2, 0, 0), "c": (L, 0, 0)}
    s = fem.assemble(
        fem.Structure(nodes, {"b": (beam, [("a", "b"), ("b", "c")]), "m": (mass, [("c",)])}, {"a": "all"})
    )
    exact = np.sqrt(E * I / (L**3 / 3 + L**2 * e + L * e**2) / m)
    np.testing.assert_allclose(mbs.modes(s, 2).omega, exact, rtol=1e-9)


@pytest.mark.parametrize("into", ["b rz", pytest.param("c y", marks=pytest.mark.long)])
def test_modal_responses_are_the_direct_ones(into):
    K, M, omega = stiffness(), np.asarray(mass_of()), np.array([0.0, 3.0, 20.0, 400.0])
    found = mbs.frequency_response(system(), omega, into=[into], out=NODES, method="modal", loss=0.03).values
    load = np.eye(12)[NAMES.index(into)]
    exact = [np.linalg.solve(K * (1 + 0.03j) - w**2 * M, load) for w in omega]
    np.testing.assert_allclose(found[:, :, 0], exact, rtol=1e-9, atol=1e-15)


def test_motions_in_modes_satisfy_the_equations_in_all_rows():
    ts = jnp.linspace(0.0, 0.5, 201)
    forces = {"b rx": jnp.sin(9.0 * ts), "c z": jnp.sin(7.0 * ts) ** 2}
    motion = mbs.simulate(system(), ts=ts, forces=forces, solver=ModalSuperposition())
    inner = np.asarray(motion.acceleration) @ mass_of() + np.asarray(motion.displacement) @ stiffness()
    np.testing.assert_allclose(inner, system().load(forces), atol=1e-10)


@pytest.mark.long
def test_motions_by_steps_are_those_in_modes():
    ts = jnp.linspace(0.0, 0.5, 201)
    forces = {"b rx": jnp.sin(9.0 * ts), "c z": jnp.sin(7.0 * ts) ** 2}
    modal = mbs.simulate(system(), ts=ts, forces=forces, solver=ModalSuperposition())
    steps = mbs.simulate(system(), ts=ts, forces=forces, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(steps.displacement, modal.displacement, atol=1e-9)


@pytest.mark.long
def test_reductions_with_all_modes_are_exact():
    K, M = stiffness(), np.asarray(mass_of())
    whole = reduce(system().with_interface("b"), CraigBampton(3))
    np.testing.assert_allclose(mbs.modes(whole).values, finite_values(K, M), rtol=1e-9)
    static = reduce(system().with_interface("b", "c x", "c y", "c z"), Guyan())
    assert static.num_rows == 9
    with pytest.raises(ValueError, match="num_modes = 4 must be between 0 and 3"):
        reduce(system().with_interface("b"), CraigBampton(4))


@pytest.mark.parametrize("compiled", [pytest.param(False, marks=pytest.mark.long), True])
def test_derivatives_by_mass_and_place_with_declared_rows(compiled):
    def lowest(m, e):
        return mbs.modes(system(mass_of(m, e), massless=TURNS), 2).values

    by = jax.jacfwd(lowest, argnums=(0, 1))
    slopes = (jax.jit(by) if compiled else by)(3.0, 0.2)
    h = 1e-5
    exact = lambda m, e: finite_values(stiffness(), np.asarray(mass_of(m, e)))[:2]
    np.testing.assert_allclose(slopes[0], (exact(3.0 + h, 0.2) - exact(3.0 - h, 0.2)) / 2 / h, rtol=1e-6)
    np.testing.assert_allclose(slopes[1], (exact(3.0, 0.2 + h) - exact(3.0, 0.2 - h)) / 2 / h, rtol=1e-6)


def test_bare_matrices_are_refused_with_their_rows():
    with pytest.raises(ValueError, match=r"coordinates \[3, 4, 5, 9, 10, 11\] have no mass of their own"):
        mbs.vibration.natural_modes(K=stiffness(), M=mass_of())
