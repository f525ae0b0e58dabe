"""What goes wrong is said before anything is traced: which joint, body or element, and how to mend it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import elements, fem, linear, reductions, vibration
from tests.model.test_entry_points import QUESTIONS
from tests.models import DOWN_Y, PIN, four_bar, four_bar_state


def bob():
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("bob", 1.0, (0.5, 0.0, 0.0), (0.01, 0.1, 0.1))
    b.joint("pin", PIN, "ground", "bob")
    return b


@pytest.fixture(scope="module")
def pendulum():
    return bob().build()


@pytest.fixture(scope="module")
def loop():
    return four_bar()


# ------------------------------------------------------------------ arguments and their kinds
@pytest.mark.slow  # without the checks of types that quick tests make
@pytest.mark.parametrize("question", QUESTIONS[:-2])  # the last are methods of the system
def test_swapped_arguments(pendulum, question):
    state = mbs.State.at(pendulum, pin=0.3)
    with pytest.raises(TypeError, match="the system comes first|a System is needed"):
        question(state, pendulum)


@pytest.mark.slow
def test_things_of_another_kind(pendulum):
    state = mbs.State.at(pendulum, pin=0.3)
    motion = mbs.simulate(pendulum, state, t1=0.1)
    for ask, message in (
        (lambda: mbs.linearise(pendulum, motion), "not a Motion: take one of its states"),
        (lambda: mbs.forward_dynamics("pendulum", state), "a System is needed.* not a str"),
        (lambda: mbs.State.at(state, pin=1.0), "a System is needed.* not a State"),
        (lambda: mbs.bondgraph.bond_graph(state, "detailed", pendulum), "a System is needed"),
        (lambda: mbs.check(state), "a System is needed"),
        (lambda: mbs.position(pendulum, state, 3.0), r"a frame is the name .*, or \(name, point\), not 3.0"),
        (lambda: mbs.State("now", [0.3], [0.0]), "the t of a State are no real numbers: .*now"),
    ):
        with pytest.raises(TypeError, match=message):
            ask()


def test_a_state_by_hand():
    """A time that is a plain number, whole numbers, tuples: all are made arrays, what cannot be is refused."""
    state = mbs.State(0.0, [0, 1], (2, 3))
    assert {x.dtype for x in (state.t, state.coordinates, state.velocities)} == {jnp.result_type(float)}
    assert state.ok and state.t.shape == ()
    for shapes in (((3, 1), (1,)), ((), ()), ((2, 1), (2, 1))):
        with pytest.raises(ValueError, match=r"a State has a time \(\), coordinates \(nq,\)"):
            mbs.State(0.0, *map(np.zeros, shapes))
    with pytest.raises(TypeError, match="coordinates of a State are no real numbers"):
        mbs.State(0.0, np.array([1j]), [0.0])


@pytest.mark.parametrize("value", [np.nan, np.inf, 1j])
def test_values_that_are_no_numbers(pendulum, value):
    with pytest.raises(mbs.ModelError, match="joint 'pin' takes finite real numbers"):
        mbs.State.at(pendulum, pin=value)


def test_a_time_that_is_none(pendulum):
    with pytest.raises(mbs.ModelError, match="t must be one finite time, got nan"):
        mbs.State.at(pendulum, t=np.nan)


# ------------------------------------------------------------------ points of two numbers
def placed(**options):
    b = bob()
    b.body("two", 1.0, (0.5, 0.0, 0.0), (0.01, 0.1, 0.1))
    b.joint("knee", PIN, "bob", "two", **options)
    return b


def framed(**options):
    b = bob()
    b.frame("eye", on="bob", **options)
    return b


def pushed(point):
    b = bob()
    b.force("push", mbs.Force((1.0, 0.0, 0.0)), on=("bob", point))
    return b


PLACES = {
    "parent_frame": (lambda: placed(parent_frame=(0, -1)), "joint 'knee', parent_frame: a point needs three numbers"),
    "child_frame": (
        lambda: placed(child_frame=(1.0, np.nan, 0.0)),
        "joint 'knee', child_frame: .*point is not finite",
    ),
    "at": (lambda: placed(at=(0, -1)), "joint 'knee', at: a point needs three numbers"),
    "frame": (lambda: framed(position=(0, -1)), "frame 'eye': a point needs three numbers"),
    "rotation": (lambda: framed(rotation=2 * np.eye(3)), "frame 'eye': its rotation is not a rotation matrix"),
    "size": (lambda: framed(rotation=np.eye(2)), r"frame 'eye': a rotation is a matrix of shape \(3, 3\)"),
    "force": (lambda: pushed((0, 1)), r"force 'push': \('bob', \(0, 1\)\) is not"),
}


@pytest.mark.parametrize("name", PLACES)
def test_points_and_poses(name):
    declare, message = PLACES[name]
    with pytest.raises(mbs.ModelError, match=message):
        declare().build()


def test_a_point_asked_for(pendulum):
    with pytest.raises(ValueError, match=r"a point of 'bob' needs three numbers, got shape \(2,\)"):
        mbs.position(pendulum, mbs.State.at(pendulum), ("bob", (0.0, 1.0)))
    with pytest.raises(ValueError, match=r"accelerations: shape \(2,\), not \(1,\)"):
        mbs.dynamics.acceleration(pendulum, mbs.State.at(pendulum), "bob", np.zeros(2))


# ------------------------------------------------------------------ elements, matrices
NODES = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (1.0, 1.0, 0.0), "d": (0.0, 1.0, 0.0)}
SECTIONS = {
    "shell": (elements.Quadrilateral(1.0, 0.3, 0.0), "plate.0.: thickness must not be zero"),
    "triangle": (elements.Triangle(0.0, 0.3, 0.1), "plate.0.: young must not be zero"),
    "rod": (elements.Rod(1.0, 0.0), "plate.0.: area must not be zero"),
    "beam": (elements.Beam(1.0, 1.0, 0.0, 1.0, 1.0, 1.0), "plate.0.: area must not be zero"),
    "bent": (elements.Beam(1.0, 1.0, 1.0, -1.0, -1.0, 1.0), "plate.0.: inertia_y must not be negative"),
    "mass": (elements.PointMass(-1.0), "plate.0.: value must not be negative"),
}


@pytest.mark.parametrize("name", SECTIONS)
def test_sections(name):
    element, message = SECTIONS[name]
    with pytest.raises(mbs.ModelError, match=message):
        fem.Structure(NODES, {"plate": (element, [tuple("abcd"[: element.num_nodes])])})


def test_nothing_to_reduce():
    K = np.diag([2.0, 3.0])
    free = linear.LinearSystem(mass=np.eye(2), stiffness=K)
    with pytest.raises(ValueError, match="the reduction leaves no coordinate: give an interface, or keep modes"):
        reductions.reduce(free, reductions.CraigBampton(0))
    with pytest.raises(ValueError, match="interface is the whole component.* use Unreduced"):
        reductions.reduce(free.with_interface(0, 1), reductions.Hurty(0))
    with pytest.raises(ValueError, match="has no modes: give at least one coordinate"):
        vibration.natural_modes(K=K[:0, :0], M=K[:0, :0])


# ------------------------------------------------------------------ cut joints
def angle_of_C(system, state):
    R = mbs.rotation(system, state, "coupler").T @ mbs.rotation(system, state, "rocker")
    return float(jnp.arctan2(R[1, 0], R[0, 0]))


@pytest.mark.long
def test_a_cut_joint_has_its_angle(loop):
    """As value it is held, as guess it chooses the branch."""
    right = four_bar_state(loop)
    angle, (A, B, D) = angle_of_C(loop, right), right.coordinates
    found = mbs.State.at(loop, C=angle, guess={"A": A - 0.1, "B": B, "D": D})
    np.testing.assert_allclose(found.coordinates, right.coordinates, atol=1e-8)
    for sign in (1.0, -1.0):
        found = mbs.State.at(loop, A=A, guess={"C": sign * angle})
        assert found.ok and np.sign(angle_of_C(loop, found)) == sign * np.sign(angle)
    with pytest.raises(mbs.AssemblyError, match="cannot be assembled.*\n  C: "):
        mbs.State.at(loop, C=0.0, A=A)
    with pytest.raises(mbs.ModelError, match="'C' closes a loop and takes no velocities; .* with one of A, B, D"):
        mbs.State.at(loop, velocities={"C": 1.0})
    with pytest.raises(mbs.ModelError, match="'C' takes one finite number"):
        mbs.State.at(loop, C=np.ones(2))


@pytest.mark.long
def test_the_angle_of_a_cut_joint_has_derivatives(loop):
    angle, start = angle_of_C(loop, four_bar_state(loop)), four_bar_state(loop).coordinates
    guess = dict(zip("ABD", start, strict=True))
    place = eqx.filter_jit(lambda angle: mbs.State.at(loop, C=angle, guess=guess).coordinates)
    slope, h = jax.jacfwd(place)(angle), 1e-5
    np.testing.assert_allclose(slope, (place(angle + h) - place(angle - h)) / (2 * h), rtol=1e-7)


# ------------------------------------------------------------------ motions that do not end
@pytest.mark.slow
def test_a_state_of_nan_stops_at_once(pendulum):
    with pytest.raises(mbs.SimulationError, match="the state is not finite.*it reached t = 0 s") as caught:
        mbs.simulate(pendulum, mbs.State(0.0, [np.nan], [0.0]), t1=1.0)
    assert int(caught.value.motion.diagnostics.num_steps) == 0


@pytest.mark.long
def test_traced_times_before_the_start(pendulum):
    state = mbs.State.at(pendulum, pin=0.3)
    run = jax.jit(lambda ts: mbs.simulate(pendulum, state, ts=ts, throw=False).result)
    assert mbs.Status(int(run(jnp.array([-1.0, 0.1])))) == mbs.Status.NOT_FINITE
    assert mbs.Status(int(run(jnp.array([0.0, 0.1])))) == mbs.Status.SUCCESS


@pytest.mark.long
@pytest.mark.parametrize(
    "force, light, message",
    [
        (None, False, "20 steps of .*stiffest mode there, of pin, has a rate of [0-9.]+ 1/s; raise max_steps"),
        (mbs.SpringDamper(1e12, 1e8), False, "of pin.* caused by force 'bush', which Rodas5P steps over"),
        (mbs.SpringDamper(1.0), True, "of tip.* caused by force 'bush', and moves hardly any inertia.* stiff solver"),
    ],
    ids=["long", "stiff", "light"],
)
def test_steps_that_run_out(force, light, message):
    b = bob()
    if light:
        b.body("dot", 1e-8, (1e-3, 0.0, 0.0), 1e-12 * np.ones(3))
        b.joint("tip", PIN, "bob", "dot", parent_frame=(1.0, 0.0, 0.0))
    if force is not None:
        b.force("bush", force, joint="tip" if light else "pin")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match=message):
        mbs.simulate(system, mbs.State.at(system, pin=0.3), t1=100.0, max_steps=20)


@pytest.mark.long
def test_driven_through_a_dead_position():
    """The rocker cannot follow the crank: where it locks, when, and which joint."""
    lengths = (1.0, 0.3, 0.9, 0.35)
    system = four_bar(lengths, drive=mbs.forces.Ramp(1.5, 6.28))
    start = mbs.State.at(system, guess={"B": -1.0, "D": 2.0})
    with pytest.raises(mbs.SimulationError, match="contradict the motion.*it reached t = 0.*(open|singular).*C"):
        mbs.simulate(system, start, t1=1.0)
