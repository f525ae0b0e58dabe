"""First- and second-order KIC against derivatives of positions and against one another."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.assembly._assembly import assemble_coordinates
from jaxmbs.constraints import _kic as first
from jaxmbs.constraints import _kic_second as second
from jaxmbs.kinematics._poses import node_parameters
from tests.models import OnCart, slopes

from ..zoo import SPECIMENS, of_all
from ..zoo.probes import kinematics

FOUR_BAR, LOOP = SPECIMENS["four_bar"], SPECIMENS["spatial_loop"]


def moved(system, state, phi):
    """Coordinates on the constraints at the independent values phi (simple joints)."""
    chosen = np.asarray(first.independent_columns(system))
    free = jnp.ones(system.topology.num_velocities).at[chosen].set(0.0)
    psi = state.coordinates.at[chosen].set(phi)
    return assemble_coordinates(system, node_parameters(system), psi, state.t, free)


def phi_of(system, state):
    return state.coordinates[np.asarray(first.independent_columns(system))]


@pytest.mark.long
def test_rows_and_their_slopes():
    """Where the loop is closed the residual is zero, and the rows of velocity are its slopes; Gi keeps them."""
    system, state = LOOP.system, LOOP.state

    @jax.jit
    def residual(psi):
        return mbs.constraints.constraint_residual(system, mbs.State(state.t, psi, state.velocities))

    A = np.asarray(mbs.constraints.constraint_jacobian(system, state))
    np.testing.assert_allclose(residual(state.coordinates), 0.0, atol=1e-10)
    np.testing.assert_allclose(A, slopes(residual, state.coordinates), atol=1e-9)
    p, q = first.independent_columns(system), first.dependent_columns(system)
    np.testing.assert_allclose(A[:, q] @ first.internal_kic(system, state), -A[:, p], atol=1e-12)


@pytest.mark.long
def test_internal_kic_is_the_derivative_of_the_closed_loop():
    system, state = FOUR_BAR.system, FOUR_BAR.state
    q = jax.jit(lambda phi: moved(system, state, phi)[first.dependent_columns(system)])
    phi = phi_of(system, state)
    finite = (q(phi + 1e-6) - q(phi - 1e-6)) / 2e-6
    np.testing.assert_allclose(first.internal_kic(system, state)[:, 0], finite, atol=1e-8)
    np.testing.assert_allclose(
        state.velocities[first.dependent_columns(system)],
        first.internal_kic(system, state) @ state.velocities[first.independent_columns(system)],
        atol=1e-10,
    )


def test_internal_kic_transposed_carries_efforts_without_loss_of_power():
    system, state = LOOP.system, LOOP.state
    tau = jnp.arange(1.0, 1.0 + len(first.dependent_columns(system)))
    Gi = first.internal_kic(system, state)
    phi_dot = state.velocities[first.independent_columns(system)]
    q_dot = state.velocities[first.dependent_columns(system)]
    np.testing.assert_allclose((Gi.T @ tau) @ phi_dot, tau @ q_dot, rtol=1e-10)


@of_all(without=("drive", "elastic"), quick=("tree",), slow=())
def test_body_kic_gives_the_bodies_velocities(specimen):
    found = kinematics(specimen)
    for name in specimen.system.topology.body_names:
        for kind, expected in (("translational", found.velocities), ("rotational", found.turning)):
            np.testing.assert_allclose(found.K[kind][name] @ found.phi_dot, expected[name], atol=1e-10)


@pytest.mark.parametrize(
    "specimen", [pytest.param(FOUR_BAR, marks=pytest.mark.long), LOOP, SPECIMENS["tree"]], ids=lambda s: s.name
)
def test_translational_kic_is_the_derivative_of_positions(specimen):
    system, state = specimen.system, specimen.state
    name, com = system.topology.body_names[-1], system.com[-1]

    @jax.jit
    def place(phi):
        psi = moved(system, state, phi)
        return mbs.position(system, mbs.State(state.t, psi, state.velocities), (name, com))

    phi, h = phi_of(system, state), 1e-6
    finite = [(place(phi.at[i].add(h)) - place(phi.at[i].add(-h))) / (2 * h) for i in range(len(phi))]
    np.testing.assert_allclose(mbs.constraints.kic(system, state).translational[name], np.stack(finite, 1), atol=1e-8)


@pytest.mark.long
def test_internal_kic_second_forms_agree():
    forms = (second.internal_kic_second, second.internal_kic_second_printed)
    both = jax.jit(lambda system, state: [form(system, state) for form in forms])
    for specimen in (FOUR_BAR, LOOP):
        forward, printed = both(specimen.system, specimen.state)
        assert np.max(np.abs(forward)) > 0.1
        np.testing.assert_allclose(forward, printed, atol=1e-11 * np.max(np.abs(forward)))


@pytest.mark.long
def test_internal_kic_second_is_the_second_derivative_of_the_loop():
    system, state = FOUR_BAR.system, FOUR_BAR.state
    q = jax.jit(lambda phi: moved(system, state, phi)[first.dependent_columns(system)])
    phi, h = phi_of(system, state), 1e-4
    finite = (q(phi + h) - 2 * q(phi) + q(phi - h)) / h**2
    np.testing.assert_allclose(second.internal_kic_second(system, state)[:, 0, 0], finite, rtol=1e-6)
    exact = jax.jit(jax.jacfwd(jax.jacfwd(q)))(phi)
    np.testing.assert_allclose(second.internal_kic_second(system, state), exact, rtol=1e-10)


@of_all(slow=("rolling",))
def test_body_kic_second_vector_form_equals_forward_mode(specimen):
    forward, vector = kinematics(specimen).forward, kinematics(specimen).vector
    assert np.max(np.abs(forward)) > 0.1
    np.testing.assert_allclose(forward, vector, atol=1e-12 * np.max(np.abs(forward)))


@of_all(without=("ball", "rolling"))
def test_second_kic_symmetries(specimen):
    """Of independent velocities that are rates of coordinates."""
    found = kinematics(specimen)
    for name in specimen.system.topology.body_names:
        t, r, g = found.H["translational"][name], found.H["rotational"][name], found.K["rotational"][name]
        np.testing.assert_allclose(t, np.swapaxes(t, 0, 2), atol=1e-11)
        turn = np.einsum("abc,bm,cn->nam", np.array(_LEVI_CIVITA), g, g)  # g_m x g_n
        np.testing.assert_allclose(r - np.swapaxes(r, 0, 2), turn, atol=1e-11)


@pytest.mark.long
def test_kic_rate_is_the_change_of_the_kic_along_the_motion():
    system, state = LOOP.system, LOOP.state
    K, H = mbs.constraints.kic(system, state), mbs.constraints.kic_second(system, state)
    phi_dot, h = state.velocities[np.asarray(K.independent)], 1e-6
    place = jax.jit(lambda phi: moved(system, state, phi))
    ahead, behind = (
        mbs.State(state.t, place(phi_of(system, state) + s * h * phi_dot), state.velocities) for s in (1.0, -1.0)
    )
    for name in system.topology.body_names:
        for kind in ("rotational", "translational"):  # the first is not symmetric in (n, m)
            ends = (getattr(mbs.constraints.kic(system, place), kind)[name] for place in (ahead, behind))
            finite = functools.reduce(np.subtract, ends) / (2 * h)
            np.testing.assert_allclose(mbs.constraints.kic_rate(getattr(H, kind)[name], phi_dot), finite, atol=1e-7)
    last = H.rotational[system.topology.body_names[-2]]
    assert np.max(np.abs(last - np.swapaxes(last, 0, 2))) > 0.1


_LEVI_CIVITA = np.zeros((3, 3, 3))
for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[i, j, k], _LEVI_CIVITA[i, k, j] = 1.0, -1.0


@pytest.mark.long
def test_point_kic_at_a_centre_of_mass_is_the_bodys():
    system, state = LOOP.system, LOOP.state
    K, H = mbs.constraints.kic(system, state), mbs.constraints.kic_second(system, state)
    name = system.topology.body_names[-1]
    G, second_order = mbs.constraints.point_kic(system, state, (name, system.com[-1]))
    np.testing.assert_allclose(G, np.concatenate([K.translational[name], K.rotational[name]]), atol=1e-12)
    both = np.concatenate([H.translational[name], H.rotational[name]], axis=1)
    np.testing.assert_allclose(second_order, both, atol=1e-11 * np.abs(both).max())


def test_transposed_kic_of_a_body_carries_force_and_moment_without_loss_of_power():
    """The efforts of a force at the centre of mass and of a moment, `G_t^T F` and `G_r^T T`: their power is that of
    the force on the moving centre and of the moment on the turning body, by hand, and loads exert just these."""
    hand, phi, phi_dot = OnCart(), np.array([0.3, 0.6]), np.array([1.1, -2.0])
    F, T, com = np.array([3.0, -2.0, 1.0]), np.array([0.1, 0.2, 0.7]), (0.0, -hand.length, 0.0)
    loads = [("push", mbs.Force(F), {"on": ("bob", com)}), ("turn", mbs.Torque(T), {"on": "bob"})]
    system = hand.build(forces=loads)
    state = mbs.State.at(system, slide=phi[0], swing=phi[1], velocities={"slide": phi_dot[0], "swing": phi_dot[1]})
    K = mbs.constraints.kic(system, state)
    velocity = slopes(lambda phi: hand.place(phi, com), phi) @ phi_dot
    from_force, from_moment = K.translational["bob"].T @ F, K.rotational["bob"].T @ T
    np.testing.assert_allclose(from_force @ phi_dot, F @ velocity, rtol=1e-9)  # (16)
    np.testing.assert_allclose(from_moment @ phi_dot, T[2] * phi_dot[1], rtol=1e-12)  # (13)
    np.testing.assert_allclose(mbs.dynamics.source_effort(system, state), from_force + from_moment, rtol=1e-12)
