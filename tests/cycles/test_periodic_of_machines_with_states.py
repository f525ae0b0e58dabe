"""Cycles with internal states, sampled blocks and impacts, by closed forms and long motions."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

import jaxmbs as mbs
from tests.models import four_bar_angles, four_bar_builder

from .oscillators import duffing, slide


@pytest.mark.long
def test_spring_behind_a_damper_by_its_complex_stiffness():
    omega, push = 3.0, mbs.Actuator(mbs.Harmonic(amplitude=5.0, omega=3.0))
    soft = mbs.forces.Maxwell(stiffness=20.0, damping=3.0)
    system = slide(2.0, None, spring=mbs.SpringDamper(stiffness=30.0), soft=soft, push=push)
    found = mbs.periodic(system, 2.0 * np.pi / omega)
    x = np.asarray(found.states.coordinates[:-1, 0])
    stiffness = 30.0 + 1.0 / (1.0 / 20.0 + 1.0 / (3.0j * omega))
    amplitude = abs(5.0 / (stiffness - 2.0 * omega**2))
    np.testing.assert_allclose(2.0 * abs(np.fft.rfft(x)[1]) / len(x), amplitude, rtol=1e-10)
    rates = np.roots(
        [2.0 * 3.0 / 20.0, 2.0, 3.0 * (1.0 + 30.0 / 20.0), 30.0]
    )  # of m x'' = -k x - F, F/c + F'/k2 = x'
    wanted = np.exp(rates * 2.0 * np.pi / omega)
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(wanted), rtol=1e-8)


@pytest.mark.long
def test_a_loop_with_a_spring_behind_a_damper_by_any_number_of_segments():
    """A multiplier of 1e-13 keeps its digits beside 1, that of the free period."""
    b = four_bar_builder()
    b.force("motor", mbs.Actuator(lambda x, v, t: 2.0 * (12.0 - v)), joint="A")
    b.force("soft", mbs.forces.Maxwell(stiffness=20.0, damping=20.0 / 55.0), joint="D")
    system, (_, B, D) = b.build(), four_bar_angles(0.7)
    start = mbs.State.at(system, guess={"B": B, "D": D}, A=0.7, velocities={"A": 12.0})
    ask = lambda segments: mbs.periodic(
        system, 2.0 * np.pi / 12.0, start, free="period", turns={"A": 1}, segments=segments
    )
    one, four, forty = (ask(segments) for segments in (1, 4, 40))
    assert one.stable and 1e-14 < abs(one.multipliers[-1]) < 1e-12
    for other in (four, forty):
        np.testing.assert_allclose(other.multipliers, one.multipliers, rtol=1e-8)
        np.testing.assert_allclose(other.period, one.period, rtol=1e-11)
    np.testing.assert_allclose(one[0].internal.values, one[-1].internal.values, rtol=1e-9)


@pytest.mark.long
def test_a_third_of_the_frequency_in_closed_form():
    """`x'' + k x + k3 x^3 = F cos 3 w t` moves as `A cos w t` with `A^2 = 4 (w^2 - k) / 3 k3` where F is k3 A^3 / 4.

    Source: Levenson, Harmonic and subharmonic response for the Duffing equation (1949).
    """
    k, k3, omega = 1.0, 0.5, 1.4
    A = np.sqrt(4.0 * (omega**2 - k) / (3.0 * k3))
    system = duffing(c=0.0, k=k, k3=k3, F=k3 * A**3 / 4.0, w=3.0 * omega)
    start = mbs.State.at(system, x=1.01 * A, velocities={"x": 0.02})
    found = mbs.periodic(system, 2.0 * np.pi / (3.0 * omega), start, periods=3)
    x = A * np.cos(np.linspace(0.0, 2.0 * np.pi, len(found)))
    np.testing.assert_allclose(found.states.coordinates[:, 0], x, atol=1e-10)
    np.testing.assert_allclose(np.prod(found.multipliers), 1.0, rtol=1e-9)  # nothing is lost, by Liouville


@pytest.mark.long
def test_an_oscillator_that_hits_a_stop():
    """Multipliers by the matrix exponential and the saltation matrix of the impact.

    Source: Leine and Nijmeijer, Dynamics and bifurcations of non-smooth mechanical systems (2004), 7.
    """
    k, c, push, omega, stop, back = 4.0, 0.15, 1.0, 2.6, 0.12, 0.7
    period, A = 2.0 * np.pi / omega, np.array([[0.0, 1.0], [-k, -c]])
    Z = push / (k - omega**2 + 1j * omega * c)
    steady = lambda t: (np.array([1.0, 1j * omega]) * Z * np.exp(1j * omega * t)).real
    moved = lambda tau, v, t: scipy.linalg.expm(A * t) @ ([stop, -back * v] - steady(tau)) + steady(tau + t)
    tau, v = scipy.optimize.fsolve(lambda z: moved(*z, period) - [stop, z[1]], [0.1, 0.95], xtol=1e-14)
    after, before = (push * np.cos(omega * tau) - k * stop - c * u for u in (-back * v, v))
    jump = np.array([[-back, 0.0], [(after + back * before) / v, -back]])  # diag(1, -e) + (f+ - ...) n^T / v
    start = moved(tau, v, period - tau)
    system = duffing(c=c, k=k, k3=0.0, F=push, w=omega)
    hit = mbs.motion.Event(
        lambda s: s.coordinates[0] - stop,
        action=lambda s: dataclasses.replace(s, velocities=-back * s.velocities),
        direction=1,
        name="hit",
    )
    near = mbs.State.at(system, x=1.01 * start[0], velocities={"x": 1.01 * start[1]})
    found = mbs.periodic(system, period, near, event=hit)
    np.testing.assert_allclose([found[0].coordinates[0], found[0].velocities[0]], start, rtol=1e-9)
    wanted = np.linalg.eigvals(jump @ scipy.linalg.expm(A * period))
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(wanted), rtol=1e-8)


@pytest.mark.long
def test_a_sampled_controller_has_the_cycle_of_a_long_motion():
    b, omega = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0)), 2.0
    b.body("m", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "m")
    b.force("spring", mbs.SpringDamper(stiffness=9.0, damping=0.2), joint="x")
    b.force("push", mbs.Actuator(mbs.Harmonic(amplitude=1.0, omega=omega)), joint="x")
    b.force("motor", mbs.Actuator(0.0), joint="x")
    b.measure("place", joint="x")
    b.block("loop", mbs.blocks.PI(0.5, 0.4), reads="place", drives="motor", every=np.pi / 40.0)
    system = b.build()
    found = mbs.periodic(system, np.pi)
    late = mbs.simulate(system, mbs.State.at(system), t1=60.0 * np.pi)
    np.testing.assert_allclose(late.end.coordinates, found[0].coordinates, atol=1e-5)
    assert found.stable and abs(found.multipliers[-1]) < 1e-12  # of the held output: nothing is left of it
    with pytest.raises(mbs.ModelError, match="whole number"):
        mbs.periodic(system, np.pi, segments=3)
    with pytest.raises(mbs.ModelError, match="blocks are sampled"):
        mbs.periodic(system, np.pi, free="period")


@pytest.mark.long
def test_two_periods_square_the_multipliers():
    system = duffing()
    one, two = (mbs.periodic(system, 2.0 * np.pi / 1.5, periods=k) for k in (1, 2))
    np.testing.assert_allclose(np.sort_complex(two.multipliers), np.sort_complex(one.multipliers**2), rtol=1e-8)
    np.testing.assert_allclose(two.period, 2.0 * one.period)


E_, OMEGA, G = 0.8, 20.0 * np.pi, 9.81
PERIOD = 2.0 * np.pi / OMEGA
#: Speed of the table at the impact, and its deceleration there at which the cycle of one bounce doubles.
IMPACT = (1.0 - E_) / (1.0 + E_) * G * PERIOD / 2.0
DOUBLING = 2.0 * G * (1.0 + E_**2) / (1.0 + E_) ** 2


def bounces(deceleration):
    """The ball on a table that slows down so at its impact: system, start of the cycle, its event."""
    amplitude = np.hypot(IMPACT * OMEGA, deceleration) / OMEGA**2
    phase = np.arctan2(deceleration, IMPACT * OMEGA)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("ball", mass=1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    system = b.build()

    def bounce(state):
        table = amplitude * OMEGA * jnp.cos(OMEGA * state.t)
        return dataclasses.replace(state, velocities=table - E_ * (state.velocities - table))

    hit = mbs.motion.Event(
        lambda s: s.coordinates[0] - amplitude * jnp.sin(OMEGA * s.t), action=bounce, direction=-1, name="hit"
    )
    late = PERIOD - phase / OMEGA  # since the impact before the start
    z = amplitude * np.sin(phase) + G * PERIOD / 2.0 * late - G * late**2 / 2.0
    return system, np.array([z, G * PERIOD / 2.0 - G * late]), hit


@pytest.mark.long
def test_ball_on_a_shaking_table():
    """One bounce a period: the flight is a parabola; the slope of its map has the determinant e^2 and the trace
    `1 + e^2 - (1 + e)^2 a / g`, a the deceleration of the table: it doubles where 1 + trace + determinant is zero."""
    for deceleration, is_stable in ((0.6 * DOUBLING, True), (DOUBLING, None), (1.1 * DOUBLING, False)):
        system, start, hit = bounces(deceleration)
        near = mbs.State.at(system, z=1.001 * start[0], velocities={"z": 0.999 * start[1]})
        found = mbs.periodic(system, PERIOD, near, event=hit)
        np.testing.assert_allclose([found[0].coordinates[0], found[0].velocities[0]], start, rtol=1e-9)
        trace = 1.0 + E_**2 - (1.0 + E_) ** 2 * deceleration / G
        wanted = np.roots([1.0, -trace, E_**2])
        np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(wanted), rtol=1e-8)
        assert is_stable is None or bool(found.stable) == is_stable


@pytest.mark.long
def test_small_deviations_at_rest_that_are_quick():
    """Of an oscillator at rest, in closed form; the tolerances of its motion see none of them."""

    def system(push, k):
        return duffing(k=k, c=0.4, F=push, w=1.0, like=like)

    def displaced(push, gradient):
        found = mbs.periodic(system(push, 400.0), 2.0 * np.pi, gradient=gradient, throw=False)
        return found.states.coordinates[0, 0]

    like = duffing()
    wanted = (1.0 / (400.0 - 1.0 + 0.4j)).real
    for mode, derivative in (("forward", jax.jacfwd), ("reverse", jax.grad)):
        slope = mbs.jit(derivative(lambda push, mode=mode: displaced(push, mode)))
        np.testing.assert_allclose(slope(0.0), wanted, rtol=1e-8)
    with pytest.warns(UserWarning, match="too quick for the steps"):
        coarse = mbs.periodic(system(0.0, 1e4), 2.0 * np.pi)
    assert np.all(np.isnan(coarse.multipliers)) and not coarse.stable
    fine = mbs.periodic(system(0.0, 1e4), 2.0 * np.pi, steps=960)
    np.testing.assert_allclose(np.abs(fine.multipliers), np.exp(-0.2 * 2.0 * np.pi), rtol=1e-6)
