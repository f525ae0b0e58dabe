"""The tyre as a law between a road and a wheel: geometry, load, slips, and its states in motion."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

from .tyres import sample

LOAD = 4000.0
LINEAR = vehicles.LinearTyre(9e4, 6e4, nominal_load=LOAD, radius=0.3, stiffness=2e5, relaxation=(0.3, 0.4))


def about(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)]["xyz".index(axis)]
    R = np.eye(3)
    R[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return R


@mbs.jit
def instant(tyre, rotation, displacement, spin, velocity, states):
    args = (rotation, displacement, spin, velocity, states, 0.0)
    return tyre.rolling(*args), tyre.wrench(*args), tyre.rate(*args), tyre.start(*args[:4], 0.0)


def at(tyre=None, rotation=None, height=0.32, spin=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), states=(0.0, 0.0)):
    given = {"along": jnp.asarray(states[0]), "across": jnp.asarray(states[1])}
    R = np.eye(3) if rotation is None else rotation
    place = jnp.array([2.0, -1.0, height])
    return instant(
        sample() if tyre is None else tyre, jnp.asarray(R), place, *map(jnp.array, (spin, velocity)), given
    )


@pytest.mark.slow
def test_geometry_of_a_leaned_and_steered_wheel():
    """Camber, loaded radius, axes, lever of the forces, and rates of the radius against differences."""
    R = about("z", 0.3) @ about("x", 0.1) @ about("y", 2.0)
    omega, v = np.array([0.4, 50.0, 0.2]), np.array([16.0, 0.5, -0.3])
    rolling, (force, moment), _, _ = at(rotation=R, spin=omega, velocity=v, states=(0.002, -0.001))
    c = rolling.contact
    np.testing.assert_allclose(c.camber, np.sin(0.1), rtol=1e-13)
    np.testing.assert_allclose(c.radius, 0.32 / np.cos(0.1), rtol=1e-13)
    np.testing.assert_allclose(c.forward, [np.cos(0.3), np.sin(0.3), 0.0], atol=1e-15)
    lever = 0.32 * np.tan(0.1) * np.array([-np.sin(0.3), np.cos(0.3), 0.0]) + [0.0, 0.0, -0.32]
    np.testing.assert_allclose(c.point - np.array([2.0, -1.0, 0.32]), lever, rtol=1e-12, atol=1e-15)
    spin = omega @ R[:, 1]
    np.testing.assert_allclose(c.spin, spin, rtol=1e-13)
    sliding = v + np.cross(omega - spin * R[:, 1], lever)
    np.testing.assert_allclose([c.speed, c.side_speed], [sliding @ c.forward, sliding @ c.left], rtol=1e-12)
    h = 1e-6
    turn = lambda s: (
        np.eye(3) + s * np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    )
    radii = [float(at(rotation=turn(s) @ R, height=0.32 + s * v[2])[0].contact.radius) for s in (h, -h)]
    np.testing.assert_allclose(c.radius_rate, (radii[0] - radii[1]) / (2 * h), rtol=1e-5)
    f, load = rolling.forces, rolling.slip.load
    np.testing.assert_allclose(force, f.fx * c.forward + f.fy * c.left + load * c.normal, rtol=1e-12)
    own = f.mx * c.forward + f.my * c.left + f.mz * c.normal
    np.testing.assert_allclose(moment, own + np.cross(lever, force), rtol=1e-10)


@pytest.mark.slow
def test_load_and_lift_off():
    """Stiffness, damping that never pulls, exactly nothing off the road; states off the road fade."""
    assert float(at(height=0.334)[0].slip.load) == pytest.approx(2e5 * 0.01, rel=1e-12)
    sinking, rising = (at(height=0.334, velocity=(0.0, 0.0, v))[0].slip.load for v in (-2.0, 2.0))
    np.testing.assert_allclose([sinking, rising], [2100.0, 1900.0], rtol=1e-12)
    assert at(height=0.3435, velocity=(0.0, 0.0, 5.0))[0].slip.load == 0.0
    rolling, (force, moment), rate, start = at(height=0.35, velocity=(10.0, 1.0, 0.0), states=(0.01, 0.02))
    np.testing.assert_array_equal([*force, *moment, *start.values()], 0.0)
    assert rate["along"] < 0.0 and rate["across"] < 0.0


@pytest.mark.slow
def test_slips_of_steady_rolling_and_the_states_that_hold_them():
    """A wheel at 20 m/s, braked and slipping: states of `start` rest, and their slips are those of the speeds."""
    radius = float(at()[0].radius)
    velocity, spin = (20.0, 0.8, 0.0), (0.0, 19.0 / radius, 0.0)
    start = at(spin=spin, velocity=velocity)[3]
    rolling, _, rate, _ = at(spin=spin, velocity=velocity, states=(start["along"], start["across"]))
    np.testing.assert_allclose([rolling.slip.kappa, rolling.slip.tangent], [-0.05, 0.04], rtol=1e-10)
    np.testing.assert_allclose([*rate.values()], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.array(rolling.forces[:2]), np.array(sample().model.forces(rolling.slip)[:2]))
    back = at(spin=(0.0, -20.0 / radius, 0.0), velocity=(-20.0, 0.8, 0.0))[3]
    assert back["across"] > 0.0 and abs(back["along"]) < 1e-6


@pytest.mark.slow
def test_slopes_are_finite_standing_rolling_and_in_the_air():
    tyre = sample()

    @mbs.jit
    def slopes(height, spin, velocity, states):
        def wrench(height, spin, velocity, states):
            R, x = jnp.eye(3), jnp.stack([0.0, 0.0, height])
            s = {"along": states[0], "across": states[1]}
            args = (R, x, spin, velocity, s, 0.0)
            return *tyre.wrench(*args), tyre.rate(*args), tyre.potential(R, x, s, 0.0)

        return jax.jacfwd(wrench, argnums=(0, 1, 2, 3))(height, spin, velocity, states)

    zero = jnp.zeros(3)
    for height in (0.33, 0.344, 0.36):
        for speed in (0.0, 1.0, 30.0):
            found = slopes(height, jnp.array([0.0, speed / 0.33, 0.0]), jnp.array([speed, 0.0, 0.0]), jnp.zeros(2))
            assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(found))
    assert zero.shape == (3,)


def carriage(tyre, slope=0.0, aslant=0.0, brake=0.0, like=None):
    """A wheel under a mass that moves along x, y and z, on its tyre and held by a spring."""
    b = carriage_parts(slope, aslant)
    b.force("brake", mbs.SpringDamper(stiffness=brake, damping=0.01 * brake), joint="axle")
    b.force("tyre", tyre, between=("ground", "wheel"))
    return b.build(like=like)


def carriage_parts(slope=0.0, aslant=0.0):
    """The wheel and its mass in a builder."""
    down = np.array([-np.sin(slope), -np.sin(aslant), -np.sqrt(1 - np.sin(slope) ** 2 - np.sin(aslant) ** 2)])
    b = mbs.SystemBuilder(gravity=9.81 * down)
    for name, mass in (("x", 1.0), ("y", 1.0), ("hub", 400.0)):
        b.body(name, mass=mass)
    b.body("wheel", mass=20.0, inertia=(0.7, 1.2, 0.7))
    for name, axis, parent, child in (("x", "x", "ground", "x"), ("y", "y", "x", "y"), ("z", "z", "y", "hub")):
        b.joint(name, mbs.Prismatic(axis), parent, child)
    b.joint("axle", mbs.Revolute("y"), "hub", "wheel")
    return b


@pytest.mark.long
def test_a_braked_wheel_stands_on_a_slope():
    """Along and across: it settles within millimetres and stays; the forces are those of the slope."""
    system = carriage(sample(), slope=0.1, aslant=0.05, brake=1e5)
    rest = 0.344 - 422 * 9.81 / 2e5
    state = mbs.State.at(system, z=rest)
    motion = mbs.simulate(system, state, ts=np.array([0.0, 4.0, 5.0]), rtol=1e-8, atol=1e-10)
    at = system.coordinates(motion.states)
    assert motion.ok
    for name in "xy":
        assert abs(at[name][1]) < 0.01
        assert abs(at[name][2] - at[name][1]) < 5e-5
    found = mbs.dynamics.element_reports(system, motion).results["tyre"]
    forces = [found[name].value[-1] for name in ("force along", "force across")]
    np.testing.assert_allclose(forces, 422 * 9.81 * np.sin([0.1, 0.05]), rtol=5e-3)


@pytest.mark.long
def test_a_wheel_rolls_up_a_slope_stops_and_rolls_back():
    tyre = vehicles.Tyre(LINEAR)
    system = carriage(tyre, slope=0.1)
    rest = 0.3 - 422 * 9.81 * np.cos(0.1) / 2e5
    radius = 0.3 - 422 * 9.81 * np.cos(0.1) / 2e5 / 3
    state = mbs.State.at(system, z=rest, velocities={"x": 1.5, "axle": 1.5 / radius})
    ts = np.linspace(0.0, 4.0, 9)
    motion = mbs.simulate(system, state, ts=ts, rtol=1e-9, atol=1e-9)
    slowing = 422 * 9.81 * np.sin(0.1) / (422 + 1.2 / radius**2)
    np.testing.assert_allclose(system.velocities(motion.states)["x"], 1.5 - slowing * ts, atol=0.01)


@pytest.mark.long
def test_a_wheel_is_braked_to_zero_stands_and_starts():
    """At constant torques it slows and starts as a rolling mass does; between it stands still."""
    b = carriage_parts()
    b.force("tyre", vehicles.Tyre(LINEAR), between=("ground", "wheel"))
    b.force("brake", vehicles.BrakeTorque(mbs.forces.Step(3.5, 0.2, 600.0, 0.0), slow=0.05), joint="axle")
    b.force("engine", mbs.Actuator(mbs.forces.Step(4.0, 0.2, 0.0, 300.0)), joint="axle")
    system = b.build()
    rest = 0.3 - 422 * 9.81 / 2e5
    radius = 0.3 - 422 * 9.81 / 2e5 / 3
    state = mbs.State.at(system, z=rest, velocities={"x": 10.0, "axle": 10.0 / radius})
    motion = mbs.simulate(system, state, ts=np.array([0.0, 1.5, 3.0, 3.5, 5.1, 6.1]), rtol=1e-7, atol=1e-8)
    x, v = system.coordinates(motion.states)["x"], system.velocities(motion.states)["x"]
    inertia = 422 + 1.2 / radius**2
    slowing, starting = 600.0 / rest / inertia, 300.0 / rest / inertia
    np.testing.assert_allclose(v[1], 10.0 - 1.5 * slowing, rtol=0.02)
    np.testing.assert_allclose(x[2], 10.0**2 / (2 * slowing), rtol=0.02)
    assert np.all(np.abs(v[2:4]) < 1e-3) and abs(x[3] - x[2]) < 1e-4
    np.testing.assert_allclose(v[4:], [starting, 2 * starting], rtol=0.03)


@pytest.mark.long
def test_side_force_grows_over_the_relaxation_length_and_its_slope():
    """`F_end (1 - exp(-V t / sigma))`, exact for the linear tyre; its derivative by the length."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in ("carriage", "slide", "hub", "wheel"):
        b.body(name, mass=1.0, inertia=0.5)
    b.joint("pull", mbs.Prismatic("x"), "ground", "carriage", drive=mbs.Ramp(0.0, 10.0))
    b.joint("side", mbs.Prismatic("y"), "carriage", "slide", drive=mbs.Ramp(0.0, 0.1))
    b.joint("height", mbs.Prismatic("z"), "slide", "hub", drive=mbs.Ramp(0.3 - LOAD / 2e5, 0.0))
    b.joint("axle", mbs.Revolute("y"), "hub", "wheel")
    b.force("tyre", vehicles.Tyre(LINEAR), between=("ground", "wheel"))
    system = b.build()
    ts = np.linspace(0.0, 0.1, 6)

    @mbs.jit
    def force(length):
        lengths = jnp.stack([0.3, length])[None]
        own = eqx.tree_at(lambda s: s.forces[0].law.model.relaxation, system, lengths)
        still = {"tyre.along": 0.0, "tyre.across": 0.0}
        state = mbs.State.at(own, height=0.28, velocities={"axle": 10.0 / (0.3 - 0.02 / 3)}, internal=still)
        motion = mbs.simulate(own, state, ts=ts, rtol=1e-10, atol=1e-10)
        return mbs.dynamics.element_reports(own, motion).results["tyre"]["force across"].value

    np.testing.assert_allclose(force(0.4), -6e4 * 0.01 * (1 - np.exp(-10.0 * ts / 0.4)), rtol=1e-6, atol=1e-6)
    slope = mbs.jit(jax.jacrev(force))(0.4)
    np.testing.assert_allclose(slope, (force(0.4001) - force(0.3999)) / 2e-4, rtol=1e-5, atol=1e-4)


@pytest.mark.slow
def test_a_model_file_brings_the_tyre_back(tmp_path):
    b = mbs.SystemBuilder()
    b.body("wheel", mass=20.0, inertia=1.0)
    b.joint("free", mbs.Free(), "ground", "wheel")
    for name, tyre in (("a", sample({"FZMAX": 3000.0}, pressure=2e5)), ("b", vehicles.Tyre(LINEAR))):
        b.force(name, tyre, between=("ground", "wheel"))
    mbs.save_model(b, tmp_path / "car.json")
    again = mbs.load_model(tmp_path / "car.json").build()
    first = b.build()
    assert jax.tree.structure(first) == jax.tree.structure(again)
    for one, other in zip(*map(jax.tree.leaves, (first, again)), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.long
def test_a_motion_beyond_the_measured_range_says_so():
    system = carriage(sample({"FZMAX": 3000.0}))
    state = mbs.State.at(system, z=0.344 - 422 * 9.81 / 2e5, velocities={"x": 10.0, "axle": 30.0})
    with pytest.raises(mbs.SimulationError, match="'tyre' is beyond its measured range of load"):
        mbs.simulate(system, state, ts=np.array([0.0, 0.01]))
