"""Equilibria and steady motions against closed forms; derivatives, verdicts, refusals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

G = 9.81


def pendulum(stiffness=0.0, mass=2.0, length=0.8):
    b = mbs.SystemBuilder()
    b.body("bob", mass=mass, com=(0.0, 0.0, -length), inertia=0.001)
    b.joint("swing", mbs.Revolute(axis="y"), "ground", "bob")
    b.force("spring", mbs.SpringDamper(stiffness=stiffness, free_length=1.0), joint="swing")
    return b.build()


def balance(k):
    """Angle where k (1 - x) = m g l sin x, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if k * (1 - middle) > 2.0 * G * 0.8 * np.sin(middle) else (low, middle)
    return low


@pytest.mark.long
def test_a_sprung_pendulum_and_its_derivative():
    def angle(k):
        system = pendulum(k)
        return mbs.equilibrium(system, mbs.State.at(system, swing=0.2)).state.coordinates[0]

    found, slope = jax.jit(jax.value_and_grad(angle))(20.0)
    np.testing.assert_allclose(found, balance(20.0), atol=1e-10)
    np.testing.assert_allclose(slope, (balance(20.01) - balance(19.99)) / 0.02, rtol=1e-6)


@pytest.mark.slow
def test_hanging_is_stable_and_standing_is_not():
    system = pendulum()
    hanging = mbs.equilibrium(system, mbs.State.at(system, swing=0.3))
    standing = mbs.equilibrium(system, mbs.State.at(system, swing=np.pi - 0.3))
    np.testing.assert_allclose(hanging.state.coordinates, 0.0, atol=1e-9)
    np.testing.assert_allclose(standing.state.coordinates, np.pi, atol=1e-9)
    assert bool(hanging.stable) and not bool(standing.stable)
    np.testing.assert_allclose(hanging.stiffness, [[2.0 * G * 0.8]], rtol=1e-9)


@pytest.mark.long
def test_a_loop_hangs_in_its_lowest_position():
    """A symmetric four-bar, a swing: the coupler hangs level; a load to the side tilts it, forces in balance."""
    b = mbs.SystemBuilder(gravity=(0.0, -G, 0.0))
    pin = mbs.Revolute(axis="z")
    for name, length in (("left", 0.5), ("seat", 1.0), ("right", 0.5)):
        b.body(name, mass=length, com=(length / 2, 0.0, 0.0), inertia=0.1)
    b.joint("A", pin, "ground", "left")
    b.joint("B", pin, "left", "seat", parent_frame=(0.5, 0.0, 0.0))
    b.joint("D", pin, "ground", "right", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", pin, "seat", "right", parent_frame=(1.0, 0.0, 0.0), child_frame=(0.5, 0.0, 0.0))
    b.force("push", mbs.Force((4.0, 0.0, 0.0)), on="seat")
    system = b.build()
    start = mbs.State.at(system, A=-1.2, guess={"B": 1.2, "D": -1.2})
    found = mbs.equilibrium(system, start)
    # parallel swing: 4 N against (1 kg + 2 x 0.25 kg) g, tan of the angle from the vertical
    np.testing.assert_allclose(found.state.coordinates[0], -np.pi / 2 + np.arctan(4.0 / (1.5 * G)), atol=1e-8)
    assert bool(found.stable)
    np.testing.assert_allclose(mbs.forward_dynamics(system, found.state)[0], 0.0, atol=1e-7)


@pytest.mark.long
def test_steady_rotation_of_a_governor():
    """A bob hinged on a shaft that spins at w stands at cos x = g / (w^2 l); it needs no driving torque."""
    b = mbs.SystemBuilder()
    b.body("shaft", mass=1.0, inertia=0.05)
    b.body("bob", mass=2.0, com=(0.0, 0.0, -0.5))
    b.joint("spin", mbs.Revolute(axis="z"), "ground", "shaft")
    b.joint("swing", mbs.Revolute(axis="y"), "shaft", "bob")
    system = b.build()
    start = mbs.State.at(system, swing=-0.5, velocities={"spin": 6.0})
    found = mbs.equilibrium(system, start, moving=("spin",))
    swing = float(system.coordinates(found.state)["swing"])
    np.testing.assert_allclose(np.cos(swing), G / (36.0 * 0.5), rtol=1e-9)
    assert bool(found.stable)
    np.testing.assert_allclose(found.efforts, 0.0, atol=1e-9)


@pytest.mark.slow
def test_efforts_that_hold_a_steady_motion():
    """A shaft with friction in its bearing needs a torque along its speed, against that friction."""
    b = mbs.SystemBuilder()
    b.body("shaft", mass=1.0, inertia=0.05)
    b.joint("spin", mbs.Revolute(axis="z"), "ground", "shaft")
    b.force("bearing", mbs.SpringDamper(damping=0.3), joint="spin")
    system = b.build()
    found = mbs.equilibrium(system, mbs.State.at(system, velocities={"spin": 6.0}), moving=("spin",))
    np.testing.assert_allclose(found.efforts, [0.3 * 6.0], rtol=1e-12)


@pytest.mark.long
def test_no_equilibrium_is_said():
    """A sphere of no support falls for ever."""
    b = mbs.SystemBuilder()
    b.body("stone", mass=1.0, inertia=0.1)
    b.joint("fall", mbs.Prismatic(axis="z"), "ground", "stone")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match="no equilibrium"):
        mbs.equilibrium(system, mbs.State.at(system))
    found = mbs.equilibrium(system, mbs.State.at(system), throw=False)
    assert not bool(found.ok) and not bool(found.state.ok)
    assert np.isnan(mbs.linearise(system, found.state).stiffness).all()


def test_moving_joints_must_be_independent():
    system = pendulum()
    with pytest.raises(mbs.ModelError, match="there is no joint 'spin'"):
        mbs.equilibrium(system, mbs.State.at(system), moving=("spin",))


def governor(numbers, like=None):
    """A shaft, a bob hinged on it and an odd body hung from that by a ball joint."""
    (length, mass), b = numbers, mbs.SystemBuilder()
    down = jnp.stack([0.0 * length, 0.0 * length, -length])
    b.body("shaft", mass=1.0, inertia=0.05)
    b.body("bob", mass=mass, com=down)
    b.body("odd", mass=0.3, com=(0.0, 0.1, -0.5), inertia=(0.01, 0.02, 0.025))
    b.joint("spin", mbs.Revolute(axis="z"), "ground", "shaft")
    b.joint("swing", mbs.Revolute(axis="y"), "shaft", "bob")
    b.joint("ball", mbs.Spherical(), "bob", "odd", parent_frame=down)
    return b.build(like=like)


@pytest.mark.long
def test_derivatives_of_a_steady_motion_with_a_ball():
    """By parameters, the speed and the angle that a moving joint keeps, in both modes, against differences."""
    at = jnp.array([0.5, 2.0, 6.0, 0.7])
    first = governor(at[:2])

    def found(x):
        system = governor(x[:2], like=first)
        state = mbs.State.at(system, swing=-0.5, spin=x[3], velocities={"spin": x[2]})
        rest = mbs.equilibrium(system, state, moving=("spin",), throw=False)
        verdict = jnp.asarray(rest.result, float)  # traced too
        return jnp.concatenate([rest.state.coordinates, rest.state.velocities, rest.stiffness[0], verdict[None]])

    value, forward, reverse = (mbs.jit(f, compile="quick") for f in (found, jax.jacfwd(found), jax.jacrev(found)))
    step = 1e-5
    differences = [(value(at.at[k].add(step)) - value(at.at[k].add(-step))) / (2.0 * step) for k in range(4)]
    np.testing.assert_allclose(forward(at), np.stack(differences, axis=1), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(forward(at)[0], [0.0, 0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(reverse(at), forward(at), atol=1e-9)


@pytest.mark.long
def test_second_derivatives_and_batches():
    """Of a sprung pendulum's angle by the stiffness, alone and in a batch: k (1 - x) = m g l sin x twice over."""

    def angle(k):
        system = pendulum(k)
        return mbs.equilibrium(system, mbs.State.at(system, swing=0.2), throw=False).state.coordinates[0]

    k = jnp.array([15.0, 20.0])
    slope = lambda k: jax.jvp(angle, (k,), (jnp.ones_like(k),))[1]
    derive = mbs.jit(jax.vmap(lambda k: jax.jvp(slope, (k,), (jnp.ones_like(k),))), compile="quick")
    first, second = derive(k)
    x, weight = np.array([balance(each) for each in k]), 2.0 * G * 0.8
    slope_of_need = k + weight * np.cos(x)
    np.testing.assert_allclose(first, (1 - x) / slope_of_need, rtol=1e-8)
    exact = (-2.0 * first + weight * np.sin(x) * first**2) / slope_of_need
    np.testing.assert_allclose(second, exact, rtol=1e-8)


def test_a_pose_among_many_in_equilibrium_is_kept():
    """A door whose hinge stands along gravity, in any direction: neither efforts nor slope are more than rounding."""
    base, random = None, np.random.default_rng(0)
    for _ in range(8):
        up, p, c = random.normal(size=(3, 3))
        b = mbs.SystemBuilder(gravity=9.81 * up)
        b.body("door", 1.0, random.normal(size=3), (0.1, 0.1, 0.1))
        b.joint("hinge", mbs.Revolute(up / np.linalg.norm(up)), "ground", "door", p, c)
        system = b.build(like=base)
        base = base or system
        start = mbs.State.at(system, hinge=random.normal())
        found = mbs.equilibrium(system, start)
        assert found.ok
        np.testing.assert_allclose(found.state.coordinates, start.coordinates, atol=1e-12)


def _linkage(length, gravity, like=None):
    """A parallelogram, which rests in any pose without weight, in one with it."""
    b = mbs.SystemBuilder(gravity=(0.0, -gravity, 0.0))
    for name in ("left", "top", "right"):
        b.body(name, mass=1.0, com=(0.3, 0.0, 0.0), inertia=0.1)
    b.joint("A", mbs.Revolute("z"), "ground", "left")
    b.joint("B", mbs.Revolute("z"), "left", "top", parent_frame=jnp.stack([length, 0.0, 0.0]))
    b.joint("C", mbs.Revolute("z"), "top", "right", parent_frame=(0.7, 0.0, 0.0), child_frame=(0.6, 0.0, 0.0))
    b.joint("D", mbs.Revolute("z"), "ground", "right", parent_frame=(0.75, 0.0, 0.0))
    return b.build(like=like)


@pytest.mark.long
@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_an_equilibrium_among_many_has_no_derivative(gravity):
    """NaN, not what rounding makes of a stiffness that is zero."""
    first = _linkage(jnp.asarray(0.6), gravity)
    start = mbs.State.at(first, A=-1.9, guess={"B": 1.9, "D": -1.9})

    def angle(length):
        return mbs.equilibrium(_linkage(length, gravity, first), start, throw=False).state.coordinates[0]

    value, slope = jax.value_and_grad(angle)(0.6)
    assert np.isfinite(value) and np.isfinite(slope) == (gravity > 0.0)


@pytest.mark.parametrize("short", [2000 * 9.81 / 4e6, 0.0049, 0.02])
def test_a_motion_that_nothing_holds_or_pushes_is_left(short):
    """A load on a spring at its centre of mass: the spring takes m g, the spin is neutral from wherever it starts."""
    b = mbs.SystemBuilder()
    b.body("load", mass=2000.0, inertia=100.0)
    b.joint("swing", mbs.Planar("y"), "ground", "load", parent_frame=(0.0, 0.0, -6.0))
    b.force("rope", mbs.SpringDamper(4e6, free_length=6.0 - short), between=("ground", "load"))
    system = b.build()
    rest = mbs.equilibrium(system, mbs.State.at(system, swing=(0.0, 0.0, 0.3)))
    assert rest.ok and not rest.stable and rest.reason == "neutral equilibrium found, indifferent to 'swing angle'"
    stretched = short - 2000 * 9.81 / 4e6
    np.testing.assert_allclose(rest.state.coordinates, [stretched, 0.0, 0.3], atol=1e-12)


def test_a_push_along_a_motion_that_nothing_holds_is_told():
    b = mbs.SystemBuilder()
    b.body("cart", mass=20.0, inertia=1.0)
    b.joint("track", mbs.Prismatic("x"), "ground", "cart")
    b.force("push", mbs.Force((1.0, 0.0, 0.0)), on="cart")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match="nothing holds 'track' against the loads"):
        mbs.equilibrium(system, mbs.State.at(system))
