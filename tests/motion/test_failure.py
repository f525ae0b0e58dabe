"""Designs of a batch that cannot be assembled or that fail: NaN there, nothing of it in the other lanes, no cost."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.status import Status
from tests.models import four_bar

HELD = {"velocities": {"A": 1.0}, "guess": {"B": -0.4, "D": 1.4}}
GOOD, SHORT = (0.85, 0.9, 0.95), 0.2  # couplers that close at A = 2.5, and one that does not


@pytest.fixture(scope="module")
def like():
    return four_bar()


def assembled(coupler, like):
    system = four_bar((1.0, 0.3, coupler, 0.7), like=like)
    return system, mbs.State.at(system, A=2.5, **HELD)


@pytest.fixture(scope="module")
def study(like):
    """Motion and pin force of one coupler; compiled for batches."""

    def run(coupler):
        system, state = assembled(coupler, like)
        motion = mbs.simulate(system, state, t1=0.3, gradient="forward")
        loads = mbs.reactions(system, motion)
        return {
            "state": state,
            "coordinates": motion.states.coordinates,
            "result": motion.result,
            "end": motion.end.t,
            "steps": motion.diagnostics.num_steps + motion.diagnostics.num_rejected,
            "force": loads["C"].force,
            "ok": loads.ok,
        }

    return jax.jit(jax.vmap(run))


@pytest.mark.long
def test_a_state_that_cannot_be_assembled_says_so_under_jit(like):
    def at(coupler):
        system, state = assembled(coupler, like)
        loads = mbs.reactions(system, state)
        return state, loads["C"].force, loads.residual, loads.ok, mbs.forward_dynamics(system, state)[0]

    state, force, residual, ok, acceleration = jax.jit(jax.vmap(at))(jnp.array([0.9, SHORT]))
    assert list(np.asarray(state.ok)) == list(np.asarray(ok)) == [True, False]
    assert state.residual[0] < 1e-12 and 0.1 < state.residual[1]
    for value in (state.coordinates, state.velocities, force, residual, acceleration):
        assert np.all(np.isfinite(value[0])) and np.all(np.isnan(value[1]))


@pytest.mark.long
def test_the_gradient_of_a_state_that_cannot_be_assembled_is_nan(like):
    def height(coupler):
        system, state = assembled(coupler, like)
        return jnp.sum(state.coordinates), jnp.sum(mbs.reactions(system, state)["C"].force)

    gradients = jax.jit(jax.vmap(jax.jacfwd(height)))(jnp.array([0.9, SHORT]))
    for gradient in gradients:
        assert np.isfinite(gradient[0]) and np.isnan(gradient[1])


@pytest.mark.long
def test_a_failed_lane_is_nan_and_takes_no_step(study):
    found = study(jnp.array([GOOD[0], SHORT, *GOOD[1:]]))
    assert list(np.asarray(found["result"])) == [Status.SUCCESS, Status.NOT_ASSEMBLED] + 2 * [Status.SUCCESS]
    assert found["steps"][1] == 0 and found["end"][1] == 0.0 and np.all(found["steps"][jnp.array([0, 2, 3])] > 50)
    assert np.all(np.isnan(found["coordinates"][1])) and np.all(np.isnan(found["force"][1]))
    assert not np.any(found["ok"][1]) and np.all(found["ok"][0])


@pytest.mark.long
def test_the_other_lanes_do_not_notice(study):
    """To the last bit as in a batch without it."""
    mixed, good = (study(jnp.array([GOOD[0], other, *GOOD[1:]])) for other in (SHORT, 0.8))
    for k in (0, 2, 3):
        for name in ("coordinates", "force"):
            np.testing.assert_array_equal(mixed[name][k], good[name][k])


@pytest.mark.long
def test_lanes_equal_the_design_alone(study):
    batch = study(jnp.array([GOOD[0], SHORT, *GOOD[1:]]))
    alone = study(jnp.array([GOOD[1]]))
    for name in ("coordinates", "force"):
        scale = np.abs(alone[name]).max()
        np.testing.assert_allclose(batch[name][2], alone[name][0], atol=1e-10 * scale, rtol=0)


def _drive(t):
    return 0.7 + t


@pytest.mark.long
def test_a_lane_that_locks_keeps_what_came_before(like):
    """A driven crank whose linkage locks on its way: NaN from there on, and in the gradient of a sum over all."""
    driven = four_bar(drive=_drive)

    def run(ground):
        system = four_bar((ground, 0.8, 0.5, 0.6), drive=_drive, like=driven)
        state = mbs.State.at(system, guess={"A": 0.7, "B": -0.4, "D": 1.4})
        motion = mbs.simulate(system, state, t1=1.0)
        return jnp.sum(motion.states.coordinates), (motion.states.coordinates, motion.result, motion.end.t)

    both = jax.jit(jax.vmap(jax.value_and_grad(run, has_aux=True)))
    (value, (coordinates, result, end)), gradient = both(jnp.array([0.6, 1.0]))
    assert list(np.asarray(result)) == [Status.SUCCESS, Status.INCONSISTENT]
    known = np.linspace(0.0, 1.0, 101) < float(end[1])
    assert np.all(np.isfinite(coordinates[1, known])) and np.all(np.isnan(coordinates[1, ~known]))
    assert np.isfinite(value[0]) and np.isfinite(gradient[0]) and np.isnan(value[1]) and np.isnan(gradient[1])


@pytest.mark.long
def test_nothing_runs_from_a_state_of_nan(like):
    state = mbs.State(jnp.zeros(()), jnp.full(3, jnp.nan), jnp.zeros(3))
    motion = mbs.simulate(like, state, t1=0.3, throw=False)
    assert motion.status in (mbs.Status.NOT_FINITE, mbs.Status.NOT_ASSEMBLED)
    assert int(motion.diagnostics.num_steps) == 0
