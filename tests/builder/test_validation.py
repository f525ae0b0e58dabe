"""Models and values that were taken without a word: each is refused, or noticed, by name."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, four_bar

INERTIA = (0.01, 0.1, 0.1)


def bar(mass=1.0, inertia=INERTIA, kind=PIN):
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("bar", mass, (0.5, 0.0, 0.0), inertia)
    b.joint("pin", kind, "ground", "bar")
    return b


def test_a_frame_named_like_the_end_of_a_joint():
    b = bar()
    b.frame("pin.child", on="bar", position=(1.0, 0.0, 0.0))
    with pytest.raises(mbs.ModelError, match="frame 'pin.child': joint 'pin' names its own frame so"):
        b.build()


def test_a_force_named_like_the_account_of_drives():
    b = bar()
    b.force("drives", mbs.Force((0.0, 1.0, 0.0)), on="bar")
    with pytest.raises(mbs.ModelError, match="force 'drives'"):
        b.build()


@pytest.mark.slow
def test_bodies_without_position_stand_in_the_world_frame():
    """`at=` without `position=`: points and centres of mass are in world axes, of bodies further out too."""
    world, placed = mbs.SystemBuilder(gravity=DOWN_Y), mbs.SystemBuilder(gravity=DOWN_Y)
    for b, origin in ((world, None), (placed, (1.0, 2.0, 0.0))):
        shift = np.zeros(3) if origin is None else np.array(origin)
        b.body("upper", 1.0, np.array([1.5, 2.0, 0.0]) - shift, INERTIA, position=origin)
        b.body("lower", 2.0, np.array([2.5, 2.0, 0.0]) - shift, INERTIA, position=origin)
        b.joint("A", PIN, "ground", "upper", at=(1.0, 2.0, 0.0))
        b.joint("B", PIN, "upper", "lower", at=(2.0, 2.0, 0.0))
        b.frame("tip", on="lower", position=np.array([3.0, 2.0, 0.0]) - shift)
    one, two = world.build(), placed.build()
    np.testing.assert_allclose(mbs.position(one, mbs.State.at(one), "tip"), [3.0, 2.0, 0.0], atol=1e-12)
    states = [mbs.State.at(s, A=0.3, B=-0.2, velocities={"A": 1.0, "B": 2.0}) for s in (one, two)]
    for question in (lambda s, x: mbs.forward_dynamics(s, x)[0], lambda s, x: mbs.position(s, x, "tip")):
        np.testing.assert_allclose(question(one, states[0]), question(two, states[1]), atol=1e-10)


def test_at_beside_frames_is_refused():
    b = mbs.SystemBuilder()
    b.body("bar", 1.0, (0.5, 0.0, 0.0), INERTIA)
    b.joint("pin", PIN, "ground", "bar", child_frame=(0.1, 0.0, 0.0), at=(0.0, 0.0, 0.0))
    with pytest.raises(mbs.ModelError, match="joint 'pin': at= places both of its frames"):
        b.build()


@pytest.mark.parametrize("kind, inertia", [(PIN, 0.0), (mbs.Spherical(), 0.0)])
def test_motions_without_inertia_are_refused_with_like_too(kind, inertia):
    like = bar(kind=kind).build()
    hollow = bar(mass=0.0 if kind is PIN else 1.0, inertia=inertia, kind=kind)
    with pytest.raises(mbs.ModelError, match="motion of joint.* pin moves no inertia"):
        hollow.build()
    with pytest.raises(mbs.ModelError, match="motion of joint.* pin moves no inertia"):
        hollow.build(like=like)


def test_a_bead_on_a_turning_guide_has_inertia_where_it_is_not_at_the_centre():
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("guide", 0.0)
    b.body("bead", 1.0)
    b.joint("turn", PIN, "ground", "guide")
    b.joint("slide", mbs.Prismatic("x"), "guide", "bead")
    system = b.build()
    state = mbs.State.at(system, turn=0.2, slide=0.5, velocities={"turn": 3.0, "slide": 0.4})
    expected = [(-9.81 * np.cos(0.2) - 2 * 0.4 * 3.0) / 0.5, 0.5 * 9.0 - 9.81 * np.sin(0.2)]
    np.testing.assert_allclose(mbs.forward_dynamics(system, state)[0], expected, rtol=1e-9)


@pytest.mark.slow
def test_loops_that_cannot_close_are_refused_with_like_too():
    with pytest.raises(mbs.ModelError, match="cannot be closed"):
        four_bar((1.0, 0.1, 0.2, 0.3))
    with pytest.raises(mbs.ModelError, match="cannot be closed"):
        four_bar((1.0, 0.1, 0.2, 0.3), like=four_bar())


def test_values_of_states():
    system = bar().build()
    with pytest.raises(mbs.ModelError, match="joint 'pin' takes numbers, got the text '0.3'"):
        mbs.State.at(system, pin="0.3")
    with pytest.warns(UserWarning, match="joint 'pin' .* 90 rad.* degrees"):
        mbs.State.at(system, pin=90)


@pytest.mark.parametrize("value", [-np.ones(6), np.full(6, np.nan), np.ones(5)])
def test_improper_compliances(value):
    system = bar().build()
    with pytest.raises(ValueError, match="compliance of 'pin'"):
        mbs.reactions(system, mbs.State.at(system), compliance={"pin": jnp.asarray(value)})


TRACED = {
    "principal values": lambda x: {"inertia": (0.1, x, x)},
    "rows": lambda x: {"inertia": ((x, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2))},
    "centre": lambda x: {"com": (x, 0.0, 0.0), "inertia": 0.1},
}


@pytest.mark.parametrize("name", list(TRACED))
def test_tuples_of_traced_numbers_are_arrays(name):
    """Mass numbers of a body as tuples, some of them traced: as of arrays."""

    def numbers(x):
        b = mbs.SystemBuilder()
        b.body("bob", mass=1.0, **TRACED[name](x))
        b.joint("pin", mbs.Revolute("y"), "ground", "bob")
        system = b.build()
        return system.inertia[0], system.com[0]

    for traced, given in zip(jax.jit(numbers)(0.15), numbers(0.15), strict=True):
        np.testing.assert_array_equal(traced, given)


def test_traced_tuples_of_a_wrong_length_are_faults():
    def build(x):
        b = mbs.SystemBuilder()
        b.body("bob", mass=1.0, com=(x, 0.0), inertia=(x, x))
        b.joint("pin", mbs.Revolute("y"), "ground", "bob")
        return b.build().com

    with pytest.raises(mbs.ModelError, match="(?s)com must be three.*inertia must be 0"):
        jax.jit(build)(0.1)
