"""Sampled blocks at the build and at an instant: faults, names, loops, what refuses them."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.blocks import PI, AbstractBlock, FirstOrder, Function, StateSpace
from jaxmbs.errors import ModelError
from jaxmbs.forces import InternalState
from jaxmbs.kinematics._configuration import at_state, with_velocities
from jaxmbs.signal_flow._sampling import sample_periods, sampled_values


class OwnBlock(AbstractBlock):
    """A user's own with a rate alone."""

    @property
    def internal_states(self):
        return {"output": InternalState()}

    def rate(self, u, s, t):
        return {"output": u}

    def output(self, u, s, t):
        return s["output"]


def builder():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("rotor", mass=1.0, inertia=(0.02, 0.02, 0.02))
    b.joint("turn", mbs.Revolute(axis="z"), "ground", "rotor")
    b.force("motor", mbs.forces.Motor(0.0, 1.5, 0.05, 0.3), joint="turn")
    b.measure("speed", joint="turn", of="velocity")
    return b


def test_all_faults_are_in_one_report():
    b = builder()
    b.block("zero", PI(1.0, 1.0), reads="speed", drives="motor", every=0.0)
    b.block("words", PI(1.0, 1.0), reads="speed", every="often")
    b.block("own", OwnBlock(), reads="speed", every=0.1)
    for k in range(9):
        b.block(f"many{k}", FirstOrder(1.0), reads="speed", every=0.1 + 0.01 * k)
    with pytest.raises(ModelError) as error:
        b.build()
    text = str(error.value)
    for part in (
        "block 'zero': every= must be a positive period in seconds, got 0.0",
        "block 'words': every= takes a period in seconds, got 'often'",
        "block 'own': OwnBlock has states and no sampled form: define `sample(u, s, t, period)`",
        "block 'own': a sampled block holds its output as the state 'output'",
        "blocks are sampled with 10 different periods (0.0, ",
    ):
        assert part in text


@pytest.mark.long
def test_an_instant_of_sampled_blocks():
    """Two periods, one block after the other, a loop of blocks, and an output of several numbers."""
    b = builder()
    mixed = StateSpace(np.zeros((1, 1)), np.ones((1, 2)), np.ones((2, 1)), np.eye(2))
    b.block("mixed", mixed, reads=("speed", "gain"), every=0.5)
    b.block("gain", Function(lambda u, t: 3.0 * u), reads="speed", every=0.25)
    b.block("ahead", Function(lambda u, t: u[0] + 10.0 * u[1]), reads=("behind", "speed"), every=0.25)
    b.block("behind", Function(lambda u, t: 2.0 * u), reads="ahead", drives="motor", every=0.25)
    system = b.build()
    np.testing.assert_array_equal(sample_periods(system), [0.5, 0.25])
    state = mbs.State.at(system, velocities={"turn": 2.0}, internal={"behind.output": 7.0, "gain.output": 5.0})
    assert state.internal["mixed.output"].shape == (2,)

    @jax.jit
    def after(due):
        at = with_velocities(system, at_state(system, state), state.velocities)
        values = sampled_values(system, at, state.internal.values, due)
        return type(state.internal)(values, state.internal.records)

    fast, slow = after(np.array([False, True])), after(np.array([True, False]))
    assert fast["gain.output"] == 6.0 and slow["gain.output"] == 5.0
    np.testing.assert_array_equal(slow["mixed.output"], [2.0, 5.0])
    np.testing.assert_allclose(slow["mixed.x"], [3.5])
    np.testing.assert_array_equal(fast["mixed.output"], state.internal["mixed.output"])
    ahead, behind = fast["ahead.output"], fast["behind.output"]
    held = state.internal["ahead.output"]
    assert (ahead, behind) in ((27.0, 2.0 * held), (27.0, 54.0), (20.0 + 2.0 * held, 2.0 * held))
    questions = {
        "linearise": lambda: mbs.linearise(system, state),
        "modes": lambda: mbs.modes(system, state),
        "equilibrium": lambda: mbs.equilibrium(system, state),
        "vector_field": lambda: mbs.vector_field(system),
        "loop='diffeqsolve'": lambda: mbs.simulate(system, state, t1=0.1, loop="diffeqsolve"),
    }
    for name, ask in questions.items():
        with pytest.raises(ModelError, match=f"{name}: blocks .*'gain'.* are sampled.*without every="):
            ask()
