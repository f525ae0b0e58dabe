"""Frames led along paths: a two-link arm in closed form, orientations in space, and the excavator's question."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN

UPPER, LOWER = 0.5, 0.4  # [m]
TS = np.linspace(0.0, 1.0, 6)
CORNERS = np.array([[0.6, 0.2, 0.0], [0.5, 0.45, 0.0], [0.3, 0.5, 0.0]])


def path(corners=CORNERS):
    return mbs.Spline(jnp.array([0.0, 0.4, 1.0]), corners)


def arm(corners=None, upper=UPPER, like=None):
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name, length, mass in (("upper", upper, 2.0), ("lower", LOWER, 1.0)):
        b.body(name, mass, (0.5 * length, 0.0, 0.0), mbs.inertia.rod(mass, LOWER))
    b.joint("shoulder", PIN, "ground", "upper")
    b.joint("elbow", PIN, "upper", "lower", parent_frame=(upper, 0.0, 0.0))
    b.frame("tip", "lower", (LOWER, 0.0, 0.0))
    if corners is not None:
        b.constraint("lead", mbs.joints.FramePath(path(corners), hold=("x", "y")), between=("ground", "tip"))
    return b.build(like=like)


def angles(place, upper=UPPER):
    """Shoulder and elbow, elbow below: the law of cosines."""
    x, y = place[0], place[1]
    elbow = jnp.arccos((x * x + y * y - upper**2 - LOWER**2) / (2.0 * upper * LOWER))
    return jnp.stack([jnp.arctan2(y, x) - jnp.arctan2(LOWER * jnp.sin(elbow), upper + LOWER * jnp.cos(elbow)), elbow])


def closed_form(t):
    """Angles, rates, accelerations (2,) at a time."""
    one = lambda t: angles(path()(t))
    rate = jax.jacfwd(one)
    return one(t), rate(t), jax.jacfwd(rate)(t)


GUESS = {"shoulder": -0.2, "elbow": 1.2}


@pytest.fixture(scope="module")
def led():
    return arm(CORNERS)


@pytest.fixture(scope="module")
def motion(led):
    return mbs.simulate(led, mbs.State.at(led, guess=GUESS), ts=TS)


@pytest.mark.long
def test_two_slides_take_the_places_of_the_path():
    """Coordinates, speeds and accelerations of a point on crossed slides are those of the spline that leads it."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("carriage", 1.0)
    b.body("point", 2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "carriage")
    b.joint("y", mbs.Prismatic("y"), "carriage", "point")
    b.constraint("lead", mbs.joints.FramePath(path(), hold=("x", "y")), between=("ground", "point"))
    system, t = b.build(), 0.65
    state = mbs.State.at(system, t=t)
    rate = jax.jacfwd(path())
    np.testing.assert_allclose(state.coordinates, path()(t)[:2], atol=1e-9)
    np.testing.assert_allclose(state.velocities, rate(t)[:2], atol=1e-9)
    found = mbs.forward_dynamics(system, state)[0]
    np.testing.assert_allclose(found, jax.jacfwd(rate)(t)[:2], atol=1e-8)


@pytest.mark.long
def test_the_tip_takes_the_path_in_closed_form(led, motion):
    q, u, a = jax.jit(jax.vmap(closed_form))(TS)
    np.testing.assert_allclose(motion.states.coordinates, q, atol=1e-9)
    np.testing.assert_allclose(motion.states.velocities, u, atol=1e-8)
    found = mbs.reactions(led, motion)
    assert np.all(found.ok) and led.paths == ("lead",) and led.topology.mobility == 0
    rates = jax.jit(jax.vmap(lambda s: mbs.forward_dynamics(led, s)[0]))(motion.states)
    np.testing.assert_allclose(rates, a, atol=1e-7)


@pytest.mark.long
def test_what_leads_carries_the_force_of_the_inverse_dynamics(led, motion):
    """`J^T f` of the force that leads is what motors would give; and motors that do carry no force at the tip."""
    a = jax.jit(jax.vmap(closed_form))(TS)[2]
    free, states = arm(), motion.states
    needs = lambda s, a: (mbs.kinematics.jacobian(free, s, "tip"), mbs.inverse_dynamics(free, s, a))
    J, need = jax.jit(jax.vmap(needs))(states, a)
    force = mbs.reactions(led, motion)["lead"].force
    np.testing.assert_allclose(jnp.einsum("tkj,tk->tj", J[:, :3], force), need, atol=1e-7)
    motors = mbs.inverse_dynamics(led, motion, actuators=["shoulder", "elbow"])
    assert np.all(motors.ok)
    np.testing.assert_allclose(jnp.concatenate([motors["shoulder"], motors["elbow"]], 1), need, atol=1e-7)
    loads = mbs.reactions(led, motion, actuators=["shoulder", "elbow"])
    assert np.all(loads.ok) and "lead" not in list(loads)
    np.testing.assert_allclose(loads["elbow"].effort[:, 0], need[:, 1], atol=1e-7)


@pytest.mark.long
def test_slopes_by_the_path_and_by_a_length(led):
    def torque(numbers):
        corners, upper = numbers
        system = arm(corners, upper, like=led)
        state = mbs.State.at(system, guess=GUESS, t=0.3)
        return mbs.inverse_dynamics(system, state, actuators=["shoulder", "elbow"])["shoulder"][0]

    at = jnp.asarray(CORNERS), jnp.asarray(UPPER)
    value, (by_path, by_length) = jax.jit(jax.value_and_grad(torque))(at)
    plain = jax.jit(jax.vmap(torque))
    h = 1e-5
    one = jnp.zeros((3, 3)).at[1, 0].set(h)
    moved = plain(
        (at[0][None] + jnp.stack([one, -one, 0 * one, 0 * one]), at[1] + h * jnp.array([0.0, 0.0, 1.0, -1.0]))
    )
    np.testing.assert_allclose(by_path[1, 0], (moved[0] - moved[1]) / (2 * h), rtol=1e-6)
    np.testing.assert_allclose(by_length, (moved[2] - moved[3]) / (2 * h), rtol=1e-6)
    assert np.all(np.asarray(by_path)[:, 2] == 0.0) and np.isfinite(value)


@pytest.mark.long
def test_work_of_what_leads_is_in_the_account(led):
    dense = mbs.simulate(led, mbs.State.at(led, guess=GUESS), ts=TS)
    account = dense.diagnostics
    total = account.kinetic + account.potential
    np.testing.assert_allclose(account.work["drives"] - account.work["drives"][0], total - total[0], atol=1e-5)


@pytest.mark.long
def test_a_frame_is_turned_along_a_path_in_space():
    turn = mbs.forces.Polynomial(jnp.array([[0.1, 0.2, -0.3], [0.5, -0.2, 0.4], [0.0, 0.3, 0.1]]))
    place = mbs.forces.Polynomial(jnp.array([[1.0, 0.0, 0.5], [0.0, 0.3, 0.0]]))
    b = mbs.SystemBuilder()
    b.body("part", 2.0, (0.1, 0.0, 0.0), (0.02, 0.03, 0.04))
    b.joint("float", mbs.Free(), "ground", "part")
    b.frame("grip", "part", (0.2, 0.1, 0.0))
    b.constraint("robot", mbs.joints.FramePath(place, turn), between=("ground", "grip"))
    system = b.build()
    t = 0.7
    state = mbs.State.at(system, t=t)
    R = lambda t: Rotation.from_rotvec(np.array(turn(t))).as_matrix()
    np.testing.assert_allclose(mbs.rotation(system, state, "grip"), R(t), atol=1e-9)
    np.testing.assert_allclose(mbs.position(system, state, "grip"), place(t), atol=1e-9)
    spin = (R(t + 1e-5) - R(t - 1e-5)) / 2e-5 @ R(t).T
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    np.testing.assert_allclose(mbs.kinematics.angular_velocity(system, state, "grip"), omega, atol=1e-8)
    later, before = (mbs.State.at(system, t=t + h) for h in (1e-5, -1e-5))
    slope = (
        mbs.kinematics.angular_velocity(system, later, "grip")
        - mbs.kinematics.angular_velocity(system, before, "grip")
    ) / 2e-5
    np.testing.assert_allclose(mbs.dynamics.angular_acceleration(system, state, "grip"), slope, atol=1e-5)
    load = mbs.reactions(system, state)["robot"]  # of a body in the hand: Newton and Euler about its centre of mass
    com = ("part", (0.1, 0.0, 0.0))
    force = 2.0 * (mbs.dynamics.acceleration(system, state, com) + jnp.array([0.0, 0.0, 9.81]))
    np.testing.assert_allclose(load.force, force, atol=1e-6)
    W = mbs.rotation(system, state, "part")
    inertia = W @ jnp.diag(jnp.array([0.02, 0.03, 0.04])) @ W.T
    w, dw = (
        mbs.kinematics.angular_velocity(system, state, "part"),
        mbs.dynamics.angular_acceleration(system, state, "part"),
    )
    arm_ = mbs.position(system, state, "grip") - mbs.position(system, state, com)
    np.testing.assert_allclose(
        load.moment + jnp.cross(arm_, force), inertia @ dw + jnp.cross(w, inertia @ w), atol=1e-6
    )


def test_improper_paths_are_said_in_one_report():
    b = mbs.SystemBuilder()
    b.body("part", 1.0)
    b.joint("float", mbs.Free(), "ground", "part")
    b.constraint("a", mbs.joints.FramePath((0.0, 0.0, 0.0), hold=("x", "rr")), between=("ground", "part"))
    b.constraint("b", mbs.joints.FramePath(), between=("ground", "part"))
    b.constraint("c", mbs.joints.FramePath(lambda t: t, hold=("x", "rz")), between=("ground", "part"))
    with pytest.raises(mbs.ModelError) as raised:
        b.build()
    text = str(raised.value)
    for part in ("'rr'", "prescribes nothing", "rz have no path: give rotation=", "gives shape ()"):
        assert part in text, text
