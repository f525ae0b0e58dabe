"""Branches of cycles: Duffing's folds, Mathieu's doublings, a torus and a bouncing ball, beside closed forms."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

from .oscillators import duffing, slide
from .test_periodic_of_machines_with_states import DOUBLING, E_, IMPACT, OMEGA, PERIOD, G

#: Frequencies of the folds of case PO1 [rad/s]: of 25 harmonics with the row of a singular slope, by SciPy.
FOLDS = (1.5555786, 1.2616102)


def test_wrong_arguments_are_refused():
    like = duffing()
    ask = lambda values=(0.5, 2.5), **given: mbs.cycles.cycles_along(lambda w: like, values, 4.0, **given)
    for match, given in {
        "two numbers": {"values": (1.0, 2.0, 3.0)},
        "must differ": {"values": (1.0, 1.0)},
        "between the values": {"at": 3.0},
        "most_points": {"most_points": 0},
        "longest_step": {"longest_step": 2.0},
    }.items():
        with pytest.raises(mbs.ModelError, match=match):
            ask(**given)


@pytest.mark.long
def test_three_cycles_at_one_frequency_around_two_folds():
    """Case PO1 on one branch, from either end and from the middle."""
    like = duffing()
    ask = lambda values, near=None, **more: mbs.cycles.cycles_along(
        lambda w: duffing(w=w, like=like), values, lambda w: 2.0 * np.pi / w, near, **more
    )
    branch = ask((0.5, 2.5))
    assert [point.kind for point in branch.points] == ["fold", "fold"] and branch.ended == "last value reached"
    np.testing.assert_allclose([point.value for point in branch.points], FOLDS, atol=1e-6)
    found = branch.all_at(1.5)
    starts = [(c.states.coordinates[0, 0], c.states.velocities[0, 0]) for c in found]
    wanted = [(0.6456392218610797, 2.482733210622525), (-0.8031737196256444, 2.27072076974095)]
    np.testing.assert_allclose(starts, [*wanted, (-0.24080597801370532, 0.044266368749201784)], atol=1e-9)
    assert [bool(c.stable) for c in found] == [True, False, True]
    near = mbs.State.at(like, x=-0.8, velocities={"x": 2.27})
    assert not branch.at(1.5, near=near).stable
    with pytest.raises(mbs.ModelError, match="3 cycles of|has 3 cycles"):
        branch.at(1.5)
    with pytest.raises(mbs.ModelError, match="no cycle at 3"):
        branch.at(3.0)
    both = ask((2.5, 0.5), near, at=1.5)
    np.testing.assert_allclose(sorted(point.value for point in both.points), sorted(FOLDS), atol=1e-6)
    assert {float(both.values[0]), float(both.values[-1])} == {0.5, 2.5} and "back" not in both.ended
    for point in both.points:
        np.testing.assert_allclose(both.values[point.place], point.value)


class Swing(eqx.Module):
    """`-(a - 2 q cos 2 t) x`, Mathieu's spring."""

    a: jax.Array
    q: jax.Array

    def __call__(self, x, v, t):
        return -(self.a - 2.0 * self.q * jnp.cos(2.0 * t)) * x


#: Characteristic values at q = 5: Abramowitz and Stegun, Handbook of mathematical functions (1964), table 20.1.
MATHIEU = {"a1": 1.85818754, "b2": 2.09946045, "a2": 7.44910974}


@pytest.mark.long
def test_mathieu_doubles_where_the_tables_say():
    like = slide(1.0, None, spring=mbs.Actuator(Swing(jnp.asarray(1.0), jnp.asarray(5.0))))
    system_of = lambda a: slide(1.0, like, spring=mbs.Actuator(Swing(a, jnp.asarray(5.0))))
    branch = mbs.cycles.cycles_along(system_of, (1.5, 8.0), np.pi)
    assert [point.kind for point in branch.points] == ["period doubling", "branch point", "branch point"]
    np.testing.assert_allclose([point.value for point in branch.points], list(MATHIEU.values()), atol=1e-6)


@pytest.mark.long
def test_a_torus_where_damping_is_lost():
    """Of two masses one is shaken; the other one swings up at its own frequency where its damping is negative."""

    def machine(damping, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
        for name in "xy":
            b.body(name, mass=1.0)
            b.joint(name + "j", mbs.Prismatic(name), "ground", name)
        b.force("spring", mbs.SpringDamper(stiffness=4.0, damping=0.3), joint="xj")
        b.force("shaker", mbs.Actuator(mbs.Harmonic(amplitude=1.0, omega=1.0)), joint="xj")
        b.force("other", mbs.SpringDamper(stiffness=2.0, damping=damping), joint="yj")
        return b.build(like=like)

    like = machine(0.0)
    branch = mbs.cycles.cycles_along(lambda c: machine(c, like), (0.2, -0.13), 2.0 * np.pi, name="damping")
    assert [point.kind for point in branch.points] == ["torus"]
    np.testing.assert_allclose(branch.points[0].value, 0.0, atol=1e-6)
    assert branch.stable[0] and not branch.stable[-1] and "torus" in repr(branch)


@pytest.mark.long
def test_a_ball_on_a_shaking_table_doubles():
    """The deceleration of the table at the impact is the parameter; see `test_ball_on_a_shaking_table`."""

    def machine(amplitude, like=None):
        b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
        b.body("ball", mass=1.0)
        b.joint("z", mbs.Prismatic("z"), "ground", "ball")
        b.body("table", mass=1.0)
        b.joint("t", mbs.Prismatic("z"), "ground", "table", drive=mbs.Harmonic(amplitude=amplitude, omega=OMEGA))
        return b.build(like=like)

    def bounce(state):
        ball, table = state.velocities
        return dataclasses.replace(state, velocities=state.velocities.at[0].set(table - E_ * (ball - table)))

    hit = mbs.motion.Event(lambda s: s.coordinates[0] - s.coordinates[1], action=bounce, direction=-1, name="hit")
    amplitudes = [np.hypot(IMPACT * OMEGA, part * DOUBLING) / OMEGA**2 for part in (0.6, 1.0, 1.1)]
    like = machine(amplitudes[0])
    phase = np.arctan2(0.6 * DOUBLING, IMPACT * OMEGA)
    late = PERIOD - phase / OMEGA
    z = amplitudes[0] * np.sin(phase) + G * PERIOD / 2.0 * late - G * late**2 / 2.0
    near = mbs.State.at(like, z=z, velocities={"z": G * PERIOD / 2.0 - G * late})
    branch = mbs.cycles.cycles_along(lambda a: machine(a, like), amplitudes[::2], PERIOD, near, event=hit)
    assert [point.kind for point in branch.points] == ["period doubling"]
    np.testing.assert_allclose(branch.points[0].value, amplitudes[1], rtol=1e-7)
