"""The verb: Van der Pol's cycle to ten digits, mechanisms with loops and drives, what is refused or not found."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import four_bar_angles, four_bar_builder, pendulum

from .oscillators import duffing, van_der_pol

#: Of Van der Pol's oscillator with mu = 1: Urabe, Periodic solutions of Van der Pol's equation (1960), and later
#: computations with more digits.
PERIOD = 6.663286859323


def geared_down(**drives):
    """A four-bar whose motor slackens as the crank speeds up."""
    b = four_bar_builder(**drives)
    if not drives:
        b.force("motor", mbs.Actuator(lambda x, v, t: 2.0 * (12.0 - v)), joint="A")
    system, (_, B, D) = b.build(), four_bar_angles(0.7)
    speed = {} if drives else {"velocities": {"A": 12.0}}
    return system, mbs.State.at(system, guess={"B": B, "D": D}, **({} if drives else {"A": 0.7}), **speed)


@pytest.mark.long
def test_van_der_pol_with_any_number_of_segments():
    system, state = van_der_pol(), mbs.State.at(van_der_pol(), x=2.0)
    for segments in (1, 4, 40):
        found = mbs.periodic(system, 6.5, state, free="period", segments=segments)
        np.testing.assert_allclose(found.period, PERIOD, rtol=1e-11)
        assert found.stable and found.num_trivial == 1
        values = np.sort(np.asarray(found.multipliers).real)
        np.testing.assert_allclose(values[1], 1.0, atol=1e-8)
        x = np.asarray(found.states.coordinates[:-1, 0])  # the other is exp of the mean of 1 - x^2, by Liouville
        np.testing.assert_allclose(values[0], np.exp(float(found.period) * np.mean(1.0 - x**2)), rtol=1e-8)


@pytest.mark.long
def test_a_period_that_is_a_multiple_is_told():
    """Of an oscillation, and where a subharmonic was looked for and is none."""
    system = van_der_pol()
    with pytest.warns(UserWarning, match="repeats 2 times"):
        found = mbs.periodic(system, 2.0 * PERIOD, mbs.State.at(system, x=2.0), free="period")
    np.testing.assert_allclose(found.period, 2.0 * PERIOD, rtol=1e-11)
    with pytest.warns(UserWarning, match="repeats 3 times"):
        found = mbs.periodic(duffing(), 2.0 * np.pi / 1.5, mbs.State.at(duffing(), x=-0.2), periods=3)
    assert found.repeats == 3
    assert mbs.periodic(duffing(), 2.0 * np.pi / 1.5, found[0]).repeats == 1


@pytest.mark.long
def test_derivatives_of_a_free_period():
    like = van_der_pol()
    state = mbs.State.at(like, x=2.0)

    def period(mu, gradient):
        return mbs.periodic(van_der_pol(mu, like), 6.6, state, free="period", segments=2, gradient=gradient).period

    slope = (period(1.001, "reverse") - period(0.999, "reverse")) / 0.002
    for mode, derivative in (("reverse", jax.grad), ("forward", jax.jacfwd)):
        found = mbs.jit(derivative(lambda mu, mode=mode: period(mu, mode)))(1.0)
        np.testing.assert_allclose(found, slope, rtol=1e-5)


@pytest.mark.long
def test_forward_derivatives_of_states_multipliers_and_work():
    like = duffing()
    state = mbs.State.at(like, x=0.65, velocities={"x": 2.4})

    def numbers(k3):
        found = mbs.periodic(duffing(k3=k3, like=like), 2.0 * np.pi / 1.5, state, gradient="forward")
        values = found.multipliers
        return jnp.stack(
            [found.states.coordinates[0, 0], values[0].real, abs(values[0].imag), found.mean_powers["rest"]]
        )

    slopes, curves = mbs.jit(jax.jacfwd(numbers)), mbs.jit(jax.jacfwd(jax.jacfwd(lambda k: numbers(k)[0])))
    h = 1e-3
    fine, wide = ((numbers(0.5 + s) - numbers(0.5 - s)) / (2.0 * s) for s in (h, 2.0 * h))
    np.testing.assert_allclose(slopes(0.5), (4.0 * fine - wide) / 3.0, rtol=1e-5, atol=1e-7)
    second = (slopes(0.5 + h)[0] - slopes(0.5 - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(curves(0.5), second, rtol=1e-3)


@pytest.mark.long
def test_reverse_derivatives_of_multipliers():
    """Their product is exp(-c T), by Liouville; slopes of the largest are those of forward mode."""
    like, period = duffing(), 2.0 * np.pi / 1.5
    state = mbs.State.at(like, x=-0.8, velocities={"x": 2.27})

    def numbers(d, gradient="reverse"):
        return mbs.periodic(duffing(k3=d[0], c=d[1], like=like), period, state, gradient=gradient).multipliers

    at = jnp.array([0.5, 0.1])
    product = mbs.jit(jax.grad(lambda d: jnp.prod(numbers(d)).real))(at)
    np.testing.assert_allclose(product, [0.0, -period * np.exp(-0.1 * period)], rtol=1e-6, atol=1e-7)
    largest = mbs.jit(jax.grad(lambda d: numbers(d)[0].real))(at)
    wanted = mbs.jit(jax.jacfwd(lambda d: numbers(d, "forward")[0].real))(at)
    np.testing.assert_allclose(largest, wanted, rtol=1e-6)


@pytest.mark.long
def test_four_bar_at_a_speed_of_its_own():
    """The cycle is the motion that is left after many turns; its loads are those of the motion."""
    system, state = geared_down()
    found = mbs.periodic(system, 2.0 * np.pi / 12.0, state, free="period", held=["A"])
    again = mbs.periodic(system, 2.0 * np.pi / 12.0, state, free="period", turns={"A": 1}, segments=4)
    np.testing.assert_allclose(again.period, found.period, rtol=1e-10)
    np.testing.assert_allclose(np.abs(again.multipliers), np.abs(found.multipliers), rtol=1e-8, atol=1e-11)
    late = mbs.simulate(system, state, t1=40.0 * float(found.period), rtol=1e-11, atol=1e-11)
    turns = np.sum(np.asarray(late.end.coordinates[0]) // (2.0 * np.pi))
    assert found.stable and turns >= 39
    np.testing.assert_allclose(again.mean_speed(system, "A"), 2.0 * np.pi / found.period, rtol=1e-12)
    np.testing.assert_allclose(again.mean_powers["motor"], 0.0, atol=1e-8)  # nothing else takes energy
    speeds = np.asarray(found.states.velocities[:, 0])
    share = (speeds.max() - speeds.min()) * float(found.period) / (2.0 * np.pi)
    np.testing.assert_allclose(found.fluctuation(system, "A"), share, rtol=1e-3)
    loads = mbs.reactions(system, found)
    np.testing.assert_allclose(loads["C"].force[0], loads["C"].force[-1], atol=1e-7)
    np.testing.assert_allclose(loads["C"].force, mbs.reactions(system, again)["C"].force, atol=1e-6)


@pytest.mark.long
def test_driven_mechanism_has_the_cycle_of_its_drive():
    system, state = geared_down(A=lambda t: 0.7 + 12.0 * t)
    found = mbs.periodic(system, 2.0 * np.pi / 12.0, state)
    assert found.ok and found.multipliers.shape == (0,) and found.stable and float(found.residual) < 1e-12
    np.testing.assert_allclose(found.mean_speed(system, "A"), 12.0, rtol=1e-12)
    with pytest.raises(mbs.SimulationError, match="no periodic motion was found"):
        mbs.periodic(system, 2.0 * np.pi / 11.0, state)
    with pytest.raises(mbs.ModelError, match="nothing is free to move"):
        mbs.periodic(system, 0.5, state, free="period")


@pytest.mark.long
def test_a_period_that_is_none_and_a_cycle_that_is_one_of_many():
    system = pendulum()
    state = mbs.State.at(system, pin=0.5)
    swing = mbs.periodic(system, 2.0, state, free="period", held=["pin", "rate of pin"])
    k = np.sin(0.25)  # 4 K(k) / w of the pendulum, by the arithmetic-geometric mean
    a, b = 1.0, np.sqrt(1.0 - k**2)
    for _ in range(6):
        a, b = (a + b) / 2.0, np.sqrt(a * b)
    np.testing.assert_allclose(swing.period, 2.0 * np.pi / a / np.sqrt(9.81), rtol=1e-11)
    with pytest.warns(UserWarning, match="a multiplier is 1"):
        same = mbs.periodic(system, swing.period, swing)
    assert same.is_singular
    like = duffing()
    with pytest.raises(mbs.SimulationError, match="another period; give theirs") as error:
        mbs.periodic(like, 7.0)
    assert error.value.motion.status == mbs.Status.NO_CYCLE
    lost = mbs.periodic(like, 7.0, throw=False)
    assert not lost.ok and "no periodic motion" in str(lost.status)


def test_wrong_arguments_are_refused():
    system = pendulum()
    wrong = {
        "give period=": {},
        "first guess": {"free": "period"},
        'must be "period"': {"period": 1.0, "free": "speed"},
        "positive": {"period": -1.0},
        "one number": {"period": [1.0, 2.0]},
        "segments": {"period": 1.0, "segments": 0},
        "steps": {"period": 1.0, "steps": 2.5},
        "gradient": {"period": 1.0, "gradient": "both"},
        "no joint 'pim'": {"period": 1.0, "turns": {"pim": 1}},
        "whole number": {"period": 1.0, "turns": {"pin": 0.5}},
        "held= fixes the phase": {"period": 1.0, "held": ["pin"]},
        "'rate of pim'": {"period": 1.0, "free": "period", "held": ["rate of pim"]},
        "one segment": {"period": 1.0, "segments": 2, "event": lambda s: s.t - 0.5},
        "'stop' ends the motion": {"period": 1.0, "event": [mbs.motion.Event(lambda s: s.t - 0.5, name="stop")]},
    }
    for match, options in wrong.items():
        with pytest.raises(mbs.ModelError, match=match):
            mbs.periodic(system, **options)
    with pytest.raises((TypeError, mbs.ModelError), match="State"):
        mbs.periodic(system, 1.0, start=3.0)
