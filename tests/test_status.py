"""Nothing wrong is called success: times that are no numbers, energy that is missing."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.status import Status
from tests.models import bar


@pytest.mark.parametrize(
    "times, text",
    [
        ({"ts": [np.nan, 1.0]}, "ts must be finite"),
        ({"t1": np.nan}, "t1=nan"),
        ({"t1": np.inf}, "t1=inf"),
        ({"t1": -1.0}, "not before the start of the motion"),
    ],
)
def test_times_that_are_known_are_asked_first(times, text):
    system = bar()
    with pytest.raises(ValueError, match=text):
        mbs.simulate(system, mbs.State.at(system, pin=0.3), **times)


@pytest.mark.long
def test_traced_times_that_are_no_numbers_have_a_status():
    system = bar()

    def run(end):
        motion = mbs.simulate(system, mbs.State.at(system, pin=0.3), ts=jnp.stack([0.5 * end, end]), throw=False)
        return motion.result, motion.states.coordinates

    code, angles = jax.jit(jax.vmap(run))(jnp.array([1.0, jnp.nan, jnp.inf]))
    np.testing.assert_array_equal(code, [Status.SUCCESS, Status.NOT_FINITE, Status.NOT_FINITE])
    assert np.isfinite(angles[0]).all() and np.isnan(angles[1:]).all()


@pytest.mark.long
def test_traced_times_that_do_not_rise_stop_no_other_lane():
    system = bar()

    def run(middle):
        times = jnp.stack([jnp.asarray(0.2), middle, jnp.asarray(0.6)])
        motion = mbs.simulate(system, mbs.State.at(system, pin=0.3), ts=times, throw=False)
        return motion.result, motion.states.coordinates

    code, angles = jax.jit(jax.vmap(run))(jnp.array([0.4, 0.1]))
    np.testing.assert_array_equal(code, [Status.SUCCESS, Status.NOT_FINITE])
    assert np.isfinite(angles[0]).all() and np.isnan(angles[1]).all()


@pytest.mark.long
def test_steps_that_blow_up_are_no_success():
    """D12: Euler at half a second whirls the pendulum up; dt = 2 s is no better with a good method."""
    system = bar()
    start = mbs.State.at(system, pin=0.3)
    for options in ({"dt": 0.5, "solver": diffrax.Euler(), "t1": 100.0}, {"dt": 2.0, "t1": 20.0}):
        motion = mbs.simulate(system, start, throw=False, **options)
        assert motion.result == Status.ENERGY and not motion.ok
        assert "energy account" in str(motion.status)
        assert np.isfinite(motion.states.coordinates).all()  # what was computed is kept
        with pytest.raises(mbs.SimulationError, match="energy account"):
            mbs.simulate(system, start, **options)


@pytest.mark.long
def test_small_errors_and_rest_are_success():
    system = bar()
    rest = mbs.State.at(system, pin=-np.pi / 2)
    assert mbs.simulate(system, rest, t1=1.0).result == Status.SUCCESS
    swing = mbs.simulate(system, mbs.State.at(system, pin=-np.pi / 2 + 1e-7), t1=1.0)
    assert swing.result == Status.SUCCESS
    coarse = mbs.simulate(system, mbs.State.at(system, pin=0.3), t1=2.0, rtol=1e-3, atol=1e-3)
    assert coarse.result == Status.SUCCESS
