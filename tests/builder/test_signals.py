"""Faults of measures and blocks: one report at build, by name, with the way out."""

import jax
import jax.numpy as jnp
import pytest

import jaxmbs as mbs
from jaxmbs import blocks, forces
from tests import motor_loop


def builder():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(1.0, 0.0, 0.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.force("push", mbs.Actuator(0.0), joint="pin")
    b.force("motor", forces.Motor(0.0, 1.0, 0.1, 0.2), joint="pin")
    b.measure("angle", joint="pin")
    return b


def report(declare):
    b = builder()
    declare(b)
    with pytest.raises(mbs.ModelError) as error:
        b.build()
    return str(error.value)


def all_at_once(b):
    b.measure("turn", joint="pin", of="acceleration")
    b.measure("gap", between=("arm", "leg"), of="distance")
    b.measure("height", on="arm", axis="up")
    b.measure("both", joint="pin", on="arm")
    b.measure("angle", joint="pin")
    b.block("a", blocks.PI(1.0, 1.0), reads="angel", drives="motor.voltag")
    b.block("c", blocks.PI(1.0, 1.0), reads="c", drives="motor")
    b.block("d", blocks.PI(1.0, 1.0), reads="angle", drives="motor.voltage")
    b.block("e", blocks.PI(-1.0, 1.0), reads="pin.reaction", drives="e.target")
    b.block("f", blocks.PI(1.0, 1.0, limit=(2.0, 1.0)), reads="pin", drives="leg")
    b.block("g", 3.0, reads="angle")
    b.block("motor", blocks.FirstOrder(0.1), reads="angle")


def test_all_faults_are_in_one_report():
    text = report(all_at_once)
    for fault in (
        "measure 'turn': 'acceleration' is no signal",
        "measure 'gap': there is no body or frame 'leg'",
        "measure 'height': axis is 'x', 'y' or 'z' of a vector between or on frames, got 'up'",
        "measure 'both': give one of a function, joint=, force=, between=, on=, got joint, on",
        "measure 'angle': a measure or block has this name",
        "block 'a': there is no signal 'angel': did you mean 'angle'?",
        "block 'a': drives 'motor.voltag': there is no field to drive 'voltag': did you mean 'voltage'?",
        "block 'c': reads its own output",
        "block 'd': drives 'motor.voltage', which block 'c' drives already",
        "block 'e': kp must not be negative",
        "block 'e': 'reaction' is no signal, as it follows from what blocks drive at the same instant",
        "block 'e': drives its own field 'e.target'",
        "block 'f': limit must be positive, or (lower, upper) with lower < upper",
        "block 'f': reads 'pin', a joint: b.measure('pin', joint='pin', of='velocity')",
        "block 'f': drives 'leg': there is no force or block 'leg'",
        "block 'g': 3.0 is no block",
        "block 'motor': a force has this name",
    ):
        assert fault in text, fault


def test_a_value_beside_that_of_a_block_is_refused():
    b = builder()
    b.force("other", forces.Motor(12.0, 1.0, 0.1, 0.2), joint="pin")
    b.block("loop", blocks.PI(1.0, 1.0), reads="angle", drives="other")
    with pytest.raises(mbs.ModelError, match="force 'other': a block drives its voltage; give 0.0 there"):
        b.build()


def test_an_algebraic_loop_is_refused_and_a_lag_opens_it():
    def declare(b, block):
        b.block("a", blocks.Function(lambda u, t: u[0] + u[1]), reads=("angle", "b"), drives="motor")
        b.block("b", block, reads="a")

    assert "blocks 'a', 'b': their outputs depend on each other" in report(
        lambda b: declare(b, blocks.Function(lambda u, t: u))
    )
    b = builder()
    declare(b, blocks.FirstOrder(0.1))
    assert [name for group in b.build().blocks for name in group.names] == ["b", "a"]


def shapes(b):
    b.measure("pull", lambda at: at.reactions["pin"])
    b.measure("square", lambda at: jnp.ones((2, 2)))
    b.block("plane", blocks.Function(lambda u, t: jnp.ones((2, 2))), reads=("angle", lambda t: t))
    b.block("both", blocks.Function(lambda u, t: jnp.ones(3)), reads="angle", drives=("push", "motor"))
    b.block("filter", blocks.TransferFunction([1.0], [1.0, 2.0, 1.0]), reads=("angle", "angle"))


def test_shapes_and_what_is_no_signal_are_reported():
    text = report(shapes)
    for fault in (
        "measure 'pull': it cannot be evaluated: AttributeError: a signal cannot be one of the reactions",
        "measure 'square': it has shape (2, 2); a signal is one number or (n,)",
        "block 'plane': its output: it has shape (2, 2); a signal is one number or (n,)",
        "block 'both': its output has shape (3,); it drives 2 fields, one entry each",
        "block 'filter': rate: 'x' has shape (3,), not (2,)",
    ):
        assert fault in text, fault
    pair = report(lambda b: b.block("two", blocks.Function(lambda u, t: jnp.ones(2)), reads="angle", drives="push"))
    assert "force 'push': driven by a block" in pair


def test_a_state_that_starts_without_a_finite_rate_is_reported_by_name():
    b = builder()
    b.measure("bad", lambda at: 1.0 / at.coordinates["pin"])
    b.block("loop", blocks.PI(1.0, 1.0), reads="bad", drives="motor")
    with pytest.raises(mbs.ModelError, match="loop.integral have rates that are not finite"):
        mbs.State.at(b.build())


def test_a_loop_is_built_of_traced_gains():
    gain = jax.eval_shape(lambda kp: motor_loop.build({"kp": kp}).blocks[0].block.kp, 1.0)
    assert gain.shape == (1,)
