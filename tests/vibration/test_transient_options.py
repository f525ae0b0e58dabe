"""Options of a linear transient that a mechanism's motion has too: events, fixed steps, both modes of derivative."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.linear import LinearSystem
from jaxmbs.vibration import LinearState, ModalSuperposition

START = (np.array([1.0]), None)


def oscillator(stiffness=4.0):
    """x = cos 2t from a unit displacement."""
    return LinearSystem(mass=[[1.0]], stiffness=jnp.reshape(stiffness, (1, 1)), interface=[0], coordinates=["a x"])


@pytest.mark.long
def test_an_event_ends_the_motion_on_it():
    """x = 0 at t = pi / (2 w); the time moves with the stiffness by -t / (2 k)."""

    def ending(k):
        motion = mbs.simulate(oscillator(k), START, ts=jnp.linspace(0.0, 2.0, 5), event=lambda s: s.displacement[0])
        return motion.end.t, motion

    (t, motion), slope = jax.jit(jax.value_and_grad(ending, has_aux=True))(4.0)
    np.testing.assert_allclose(t, np.pi / 4, rtol=1e-8)
    np.testing.assert_allclose(slope, -np.pi / 32, rtol=1e-6)
    assert motion.status == mbs.Status.EVENT and motion.ok and motion.ts.shape == (6,)
    np.testing.assert_allclose(motion.ts, [0.0, 0.5, np.pi / 4, *[np.inf] * 3], rtol=1e-8)
    np.testing.assert_allclose(motion.displacement[:3, 0], np.cos(2 * motion.ts[:3]), atol=1e-8)
    assert np.isnan(motion.displacement[3:]).all()
    np.testing.assert_allclose(motion.end.velocity, -2.0, rtol=1e-8)


@pytest.mark.long
def test_both_modes_of_derivative_and_the_end():
    """x(t1) and its derivatives by the stiffness and by the end time; a motion goes on from its end."""

    def at_end(k, t1, gradient):
        return mbs.simulate(oscillator(k), START, t1, gradient=gradient).end.displacement[0]

    exact = -np.sin(2 * 0.7) * 0.7 / 4, -2 * np.sin(2 * 0.7)
    for gradient, derive in (("reverse", jax.grad), ("forward", jax.jacfwd)):
        found = jax.jit(derive(lambda *x, mode=gradient: at_end(*x, mode), argnums=(0, 1)))(4.0, 0.7)
        np.testing.assert_allclose(found, exact, rtol=1e-7)
    half = mbs.simulate(oscillator(), START, t1=0.7)
    rest = mbs.simulate(oscillator(), half.end, ts=[1.0, 1.5])
    assert isinstance(half.end, LinearState) and len(half.ts) == 101
    np.testing.assert_allclose(rest.displacement[:, 0], np.cos(2 * rest.ts), atol=1e-8)


@pytest.mark.parametrize("solver", [mbs.ode.Gauss4(), mbs.ode.SemiImplicitEuler()], ids=["gauss", "euler"])
def test_fixed_steps(solver):
    order = 4 if isinstance(solver, mbs.ode.Gauss4) else 1
    errors = [
        abs(float(mbs.simulate(oscillator(), START, 1.0, dt=dt, solver=solver).end.displacement[0]) - np.cos(2.0))
        for dt in (0.05, 0.025)
    ]
    np.testing.assert_allclose(errors[0] / errors[1], 2.0**order, rtol=0.15)


def test_what_contradicts_itself_is_refused():
    push = {"a x": np.ones(3)}
    for options, message in (
        ({"ts": [0.0, 1.0], "solver": diffrax.Euler()}, "Euler has no error estimate: give dt="),
        ({"ts": [0.0, 1.0], "gradient": "both"}, "gradient='both' must be one of reverse, forward"),
        ({"ts": [0.0, 1.0], "dt": -0.1}, "dt must be positive"),
        ({}, "give t1= .* or ts="),
        ({"ts": [0.0, 0.5, 1.0], "t1": 2.0, "forces": push}, "give them as a function of time"),
        ({"ts": [0.0, 0.5, 0.5], "forces": push}, "ts must increase without repetition"),
        ({"ts": [0.0, 0.5, 1.0], "forces": push, "solver": ModalSuperposition(), "dt": 0.1}, "takes no steps"),
    ):
        with pytest.raises(ValueError, match=message):
            mbs.simulate(oscillator(), **options)
    with pytest.raises(TypeError, match="one function of a LinearState"):
        mbs.simulate(oscillator(), ts=[0.0, 1.0], event=1.0)
