"""A load on a winch against closed forms: acceleration, torque of the drum, energy, slope by the radius."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Sheave, Winch

G, M, J, R, K = 9.81, 5.0, 0.3, 0.2, 1e5


def hoist(radius=R, side="+", free=1.0, like=None):
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("drum", 2.0, inertia=(J, J, J))
    b.joint("turn", mbs.Revolute("y"), "ground", "drum")
    b.body("load", M)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(R, 0, -1.0))
    path = [Winch(("ground", (R, 0, 0)), "turn", radius, side), Attachment("load")]
    b.cable("rope", path, stiffness=K, free_length=free, transition=1e-9)
    return b.build(like=like)


TENSION = M * G / (1 + M * R**2 / J)  # both accelerations agree: r T / J = (m g - T) / (m r)


@pytest.mark.long
@pytest.mark.parametrize(("side", "sign"), [("+", 1), ("-", -1)])
def test_load_on_a_drum_with_inertia(side, sign):
    """After 20 turns the drum has paid out 20 circumferences, and the load falls with the drum."""
    turned, shift = 40 * np.pi * sign, -40 * np.pi * R
    system = hoist(side=side, free=1.0 - TENSION / K)
    state = mbs.State.at(system, {"turn": turned, "lift": shift})
    rope = mbs.dynamics.cable_states(system, state)["rope"]
    np.testing.assert_allclose(rope.tension, TENSION, rtol=1e-8)
    np.testing.assert_allclose(rope.force[1], [0, 0, TENSION], rtol=1e-8, atol=1e-12)
    rates = system.by_joint(mbs.forward_dynamics(system, state)[0])
    np.testing.assert_allclose(rates["turn"], sign * R * TENSION / J, rtol=1e-8)
    np.testing.assert_allclose(rates["lift"], -R * R * TENSION / J, rtol=1e-8)


@pytest.mark.long
def test_energy_and_the_slope_by_the_radius():
    """Paying out 0.3 s: the energy stays; the slope of the load's place by the radius is that of differences."""
    system = hoist()
    start = mbs.State.at(system, {"lift": -TENSION / K})

    def fallen(radius):
        motion = mbs.simulate(hoist(radius, like=system), start, t1=0.3, rtol=1e-9, atol=1e-11)
        return motion.states.coordinates[-1, 1], motion.diagnostics.energy_residual

    (place, residual), slope = jax.value_and_grad(fallen, has_aux=True)(R)
    np.testing.assert_allclose(place, -TENSION / K - 0.5 * R * R * TENSION / J * 0.09, rtol=1e-6)
    assert np.abs(residual).max() < 1e-6
    h = 1e-4
    np.testing.assert_allclose(slope, (fallen(R + h)[0] - fallen(R - h)[0]) / (2 * h), rtol=1e-5)


def held(free=1.0):
    """The hoist, its drum on a torsion spring, in balance and in motion."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("drum", 2.0, inertia=(J, J, J))
    b.joint("turn", mbs.Revolute("y"), "ground", "drum")
    b.body("load", M)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(R, 0, -1.0))
    b.force("spring", mbs.SpringDamper(SPRING), joint="turn")
    b.cable("rope", [Winch(("ground", (R, 0, 0)), "turn", R), Attachment("load")], stiffness=K, free_length=free)
    return b


SPRING, TURNED = 200.0, R * M * G / 200.0


@pytest.mark.long
def test_linear_equations_and_powers_about_the_balance():
    system = held().build()
    state = mbs.State.at(system, {"turn": TURNED, "lift": -R * TURNED - M * G / K}, velocities={"turn": 2.0})
    linear = mbs.analysis.linearise(system, state)
    assert linear.names == ("turn", "lift")
    np.testing.assert_allclose(linear.mass, np.diag([J, M]), atol=1e-12)
    np.testing.assert_allclose(linear.stiffness, [[SPRING + K * R * R, K * R], [K * R, K]], rtol=1e-7)
    powers = mbs.bondgraph.element_powers(system, state)
    np.testing.assert_allclose(powers.mechanical["rope"], 2.0 * R * M * G, rtol=1e-9)  # the drum gives way
    np.testing.assert_allclose(powers.stored["rope"], -2.0 * R * M * G, rtol=1e-9)
    assert abs(powers.dissipated["rope"]) + abs(powers.supplied["rope"]) < 1e-9
    left = mbs.bondgraph.junction_residual(mbs.bondgraph.bond_powers(system, state))
    assert all(abs(float(power)) < 1e-9 for power in left.values())


@pytest.mark.long
def test_a_winch_comes_back_from_a_file(tmp_path):
    mbs.save_model(held(0.7), tmp_path / "winch.json")
    system, again = held(0.7).build(), mbs.load_model(tmp_path / "winch.json").build()
    assert again.topology == system.topology
    (rope,), (same,) = ([g.law for g in s.forces if "rope" in g.names] for s in (system, again))
    assert jax.tree.structure(rope) == jax.tree.structure(same)
    for first, second in zip(jax.tree.leaves(rope), jax.tree.leaves(same), strict=True):
        np.testing.assert_array_equal(first, second)


def over_a_wheel(free):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("drum", 20.0, inertia=J)
    b.joint("turn", mbs.Revolute("y"), "ground", "drum")
    b.body("load", M)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(2.0 + R, 0, -6))
    wheel = Sheave(("ground", (2, 0, 0)), R, side="+", axis="y")
    path = [Winch(("ground", (-2, 0, -3)), "turn", R), wheel, Attachment("load")]
    b.cable("rope", path, stiffness=K, free_length=free)
    return b.build()


@pytest.mark.parametrize("solver", [None, mbs.ode.Rodas5P()], ids=["Dopri8", "Rodas5P"])
def test_a_rope_from_a_winch_over_a_wheel_moves(solver):
    """A rope stretched by 1 mm pulls drum and load towards each other, up to where it is slack."""
    length = mbs.dynamics.cable_states(over_a_wheel(1.0), mbs.State.at(over_a_wheel(1.0)))["rope"].length
    system, omega = over_a_wheel(float(length) - 1e-3), np.sqrt(K * (1 / M + R**2 / J))
    times = np.linspace(0.0, 1.2 / omega, 6)
    options = {"rtol": 1e-9, "atol": 1e-12, "solver": solver}
    motion = mbs.simulate(system, mbs.State.at(system), ts=times, **options)
    tension = mbs.dynamics.cable_states(system, motion)["rope"].tension
    np.testing.assert_allclose(tension, 1e-3 * K * np.cos(omega * times), rtol=1e-5)
