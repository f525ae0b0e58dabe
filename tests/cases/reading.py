"""Reading motions in the tests of the cases: a function of one state, evaluated along a motion."""

import jax
import numpy as np

import jaxmbs as mbs


def along(function, system, motion, *args):
    """`function(system, state, *args)` at every saved state: numpy array with a leading axis of time."""
    return np.asarray(jax.vmap(lambda state: function(system, state, *args))(motion.states))


def coordinates(system, motion, *names):
    """Coordinates of one-freedom joints, (T, number of names)."""
    values = system.coordinates(motion.states)
    return np.stack([np.reshape(values[name], (len(motion.ts),)) for name in names], axis=1)


def rates(system, motion, *names):
    """Rates of one-freedom joints, (T, number of names)."""
    values = system.velocities(motion.states)
    return np.stack([np.reshape(values[name], (len(motion.ts),)) for name in names], axis=1)


def run(system, state, ts, **options):
    """Simulate to the last of `ts` with tight tolerances; saves exactly at `ts`."""
    options = {"rtol": 1e-11, "atol": 1e-11} | options
    return mbs.simulate(system, state, t1=float(ts[-1]), ts=np.asarray(ts, float), **options)


def check(actual, expected, tol):
    """Largest absolute difference within `tol` (a number, or one per entry)."""
    actual, expected = np.asarray(actual), np.asarray(expected)
    assert actual.shape == expected.shape, f"{actual.shape} against {expected.shape}"
    message = f"actual   {actual}\nexpected {expected}\ntolerance {tol}"
    parts = (actual - expected) / tol  # of a tolerance for each entry, which assert_allclose does not take
    np.testing.assert_allclose(parts, np.zeros_like(parts), atol=1.0, equal_nan=False, err_msg=message)
