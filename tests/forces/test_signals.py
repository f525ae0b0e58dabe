"""Functions of time: values, two derivatives, parameters, stacking."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.interpolate

from jaxmbs import forces as F
from jaxmbs.forces._signals import as_signal, value_and_rate
from tests.marks import cases

TIMES, VALUES = [0.0, 0.5, 0.9, 2.0, 2.5], [0.0, 1.0, -0.5, 0.3, 0.2]
SIGNALS = {
    "constant": F.Constant(2.0),
    "ramp": F.Ramp(1.0, -0.5),
    "harmonic": F.Harmonic(0.1, 2.0, 3.0, 0.4),
    "vector": F.Harmonic(amplitude=[1.0, 2.0, 0.0], omega=2.0),
    "polynomial": F.Polynomial([1.0, -2.0, 0.5, 0.3]),
    "step": F.Step(0.2, 0.9, -1.0, 2.0),
    "spline": F.Spline(TIMES, VALUES),
    "clamped": F.Spline(TIMES, VALUES, end_slopes=(1.0, -0.3)),
    "path": F.Spline(TIMES, np.stack([VALUES, TIMES], axis=1)),
}


def value_rate_acceleration(signal, t):
    t = jnp.asarray(t, float)
    (value, rate), (_, acceleration) = jax.jvp(lambda s: value_and_rate(signal, s), (t,), (jnp.ones_like(t),))
    return value, rate, acceleration


parametrise = pytest.mark.parametrize("name", SIGNALS)


@pytest.mark.parametrize("name", cases(SIGNALS, long=["polynomial"], rest=pytest.mark.slow))
def test_derivatives_in_time(name):
    signal, h = SIGNALS[name], 1e-5
    for t in (-0.4, 0.1, 0.21, 0.7, 1.3, 2.2, 3.0):
        value, rate, acceleration = value_rate_acceleration(signal, t)
        below, above = (value_and_rate(signal, t + s) for s in (-h, h))
        np.testing.assert_allclose(value, signal(jnp.array(t)))
        np.testing.assert_allclose(rate, (above[0] - below[0]) / (2 * h), rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(acceleration, (above[1] - below[1]) / (2 * h), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", cases(SIGNALS, long=["spline", "path"], rest=pytest.mark.slow))
def test_derivatives_in_the_numbers_and_stacking(name):
    signal, t = SIGNALS[name], jnp.array(0.7)
    slopes = jax.jacrev(lambda signal: value_rate_acceleration(signal, t))(signal)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(slopes))
    other = jax.tree.map(lambda leaf: 1.1 * leaf, signal)
    stack = jax.tree.map(lambda *leaves: jnp.stack(leaves), signal, other)
    together = jax.jit(jax.vmap(lambda signal: signal(t)))(stack)
    np.testing.assert_allclose(together, jnp.stack([signal(t), other(t)]), rtol=1e-13, atol=1e-15)
    assert signal.faults() == []


def test_values():
    t = 0.65
    np.testing.assert_allclose(SIGNALS["ramp"](t), 1 - 0.5 * t)
    np.testing.assert_allclose(SIGNALS["harmonic"](t), 0.1 + 2 * np.sin(3 * t + 0.4))
    np.testing.assert_allclose(SIGNALS["polynomial"](t), np.polyval([0.3, 0.5, -2.0, 1.0], t))
    np.testing.assert_allclose(SIGNALS["step"](t), 0.5)
    assert SIGNALS["step"](0.0) == -1.0 and SIGNALS["step"](5.0) == 2.0
    np.testing.assert_allclose(value_rate_acceleration(SIGNALS["step"], 0.2), (-1.0, 0.0, 0.0), atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("name, ends", [("spline", "natural"), ("clamped", ((1, 1.0), (1, -0.3)))])
def test_spline_is_scipys(name, ends):
    oracle, ts = scipy.interpolate.CubicSpline(TIMES, VALUES, bc_type=ends), np.linspace(0.0, 2.5, 41)
    parts = jax.vmap(lambda t: value_rate_acceleration(SIGNALS[name], t))(jnp.asarray(ts))
    for order, part in enumerate(parts):
        np.testing.assert_allclose(part, oracle(ts, order), rtol=1e-10, atol=1e-10)


@pytest.mark.long
def test_spline_follows_traced_values():
    def value(values):
        return F.Spline(TIMES, values, end_slopes=(values[0], 0.0))(jnp.array(0.3))

    values, h = jnp.array(VALUES), 1e-6
    ends = [(value(values + h * row) - value(values - h * row)) / (2 * h) for row in jnp.eye(5)]
    np.testing.assert_allclose(jax.jit(jax.grad(value))(values), jnp.stack(ends), rtol=1e-8, atol=1e-9)


def test_as_signal_and_faults():
    assert as_signal(3.0)(0.0) == 3.0 and as_signal(jnp.sin)(0.0) == 0.0
    assert value_rate_acceleration(as_signal(lambda t: 3), 0.0) == (3.0, 0.0, 0.0)
    assert as_signal(SIGNALS["ramp"]) == SIGNALS["ramp"]
    assert F.Spline([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], (0.0, 0.0)).faults()[-1] == "times must increase"
    with pytest.raises(ValueError):
        F.Spline([0.0, 1.0], [1.0])


@pytest.mark.parametrize("name, shape", [("values", (1, 3)), ("slopes", (2, 3)), ("times", (3, 1)), ("times", (1,))])
def test_parts_of_a_spline_that_do_not_go_together(name, shape):
    """As a damaged file gives them; the force that holds the spline says so, and does not evaluate it."""
    spline = F.Spline([0.0, 1.0, 2.0], np.eye(3))
    broken = eqx.tree_at(lambda spline: getattr(spline, name), spline, jnp.zeros(shape))
    for faults in (broken.faults(), F.Force(broken).faults()):
        assert len(faults) == 1 and "do not go together" in faults[0]
