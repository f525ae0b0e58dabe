"""What is integrated may be the user's choice: a formulation written outside of the library."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.motion import Formulation, Rates
from tests.cases import models
from tests.zoo.mechanisms import four_bar, four_bar_state


class Slowness(Formulation):
    """Half the velocities, by forward dynamics."""

    @classmethod
    def start(cls, system, at, u):
        return 0.5 * u, jnp.ones_like(u)

    def velocities_of(self, at, second):
        return 2.0 * second

    def rates_of(self, at, second):
        state = mbs.State(at.t, at.psi, 2.0 * second, structure=self.system.topology.structure)
        a, multipliers = mbs.forward_dynamics(self.system, state)
        return Rates(2.0 * second, 0.5 * a, None, 2.0 * second, multipliers)

    def momenta_of(self, at, second):
        state = mbs.State(at.t, at.psi, 2.0 * second, structure=self.system.topology.structure)
        return mbs.mass_matrix(self.system, state) @ (2.0 * second)


def pendulum():
    system = models.double_pendulum(1.0, 2.0, 0.8, 0.6)
    return system, mbs.State.at(system, shoulder=0.5, elbow=-0.3, velocities={"shoulder": 1.0, "elbow": 2.0})


def loop():
    system = four_bar()
    return system, four_bar_state(system)


@pytest.mark.long
@pytest.mark.parametrize("model", [pendulum, loop])
def test_a_motion_and_its_gradient(model):
    system, state = model()

    def end(speed, formulation):
        start = mbs.State(state.t, state.coordinates, speed * state.velocities, structure=state.structure)
        motion = mbs.simulate(system, start, ts=[0.3], formulation=formulation)
        return motion.states.coordinates[-1, 0]

    both = [jax.jit(jax.value_and_grad(lambda x, f=f: end(x, f)))(1.1) for f in (Slowness, None)]
    np.testing.assert_allclose(both[0], both[1], rtol=1e-7)
