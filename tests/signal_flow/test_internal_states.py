"""Internal states of assembled states: along a branch, near a state, and within a trace."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import four_bar_builder
from tests.state_laws import Servo


@pytest.mark.long
def test_states_of_a_branch():
    """A servo starts with a tenth of the coordinates at each pose; values by name stay."""
    b = four_bar_builder()
    b.force("rubber", mbs.forces.Maxwell(5.0, 1.0), joint="A")
    b.force("servo", Servo(1.0, [0.1, 0.2, 0.3], 0.5))
    system = b.build()
    at = lambda A, z: mbs.State.at(system, A=A, guess={"B": -0.2, "D": 1.2}, internal={"rubber.stretch": z})
    start = at(0.7, 0.1)
    states = mbs.assembly.states_along(system, "A", np.linspace(0.7, 1.5, 5), start)
    np.testing.assert_allclose(states.internal["servo.integral"], 0.1 * states.coordinates)
    np.testing.assert_array_equal(states.internal["rubber.stretch"], np.zeros(5))
    near = mbs.State.at(system, A=0.9, near=start, internal={"rubber.stretch": 0.3})
    np.testing.assert_allclose(near.internal["rubber.stretch"], 0.3)
    np.testing.assert_allclose(near.internal["servo.integral"], 0.1 * near.coordinates)
    assert mbs.forward_dynamics(system, states)[0].shape == (5, 3)
    z = jnp.array([0.2, jnp.nan])
    lanes = jax.vmap(lambda z: at(0.7, z))(z)
    np.testing.assert_array_equal(lanes.ok, [True, False])
    np.testing.assert_array_equal(lanes.internal["rubber.stretch"], z)
