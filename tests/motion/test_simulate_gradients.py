"""Reverse-mode gradients through `simulate` as users call it, adaptive steps and all: trees, loops, drives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.cases import models
from tests.models import LENGTHS, four_bar, four_bar_angles


def double_pendulum(numbers, like):
    system = models.double_pendulum(*numbers[:4])
    return system, mbs.State(jnp.zeros(()), numbers[4:6], numbers[6:], structure=system.topology.structure)


def loop(numbers, like):
    system = four_bar(numbers[:4], numbers[4:7], stiffness=numbers[7], like=like)
    _, B, D = four_bar_angles(0.7)
    return system, mbs.State.at(system, A=numbers[8], velocities={"A": numbers[9]}, guess={"B": B, "D": D})


def driven(numbers, like):
    system = four_bar(numbers[:4], drive=mbs.forces.Harmonic(numbers[4], 0.5, numbers[5]), like=like)
    _, B, D = four_bar_angles(0.7)
    return system, mbs.State.at(system, guess={"A": 0.7, "B": B, "D": D})


def with_masses(like, masses):
    return eqx.tree_at(lambda s: s.mass, like, masses)


def slider_crank(numbers, like):
    system = with_masses(like, numbers[:3])
    return system, mbs.State.at(
        system, main=numbers[3], velocities={"main": 2.0}, guess=models.slider_crank_guess(0.4)
    )


def squeezer(numbers, like):
    system = with_masses(like, 0.1 * numbers)
    angles = {"Theta": 0.0, "gamma": 0.45528, "Phi": 0.22267, "delta": 0.48737, "Omega": -0.22267, "epsilon": 1.23055}
    return system, mbs.State.at(system, beta=-0.0617138900142764, guess=angles)


CASES = {  # model, its numbers, the concrete system whose structure it has, end of the motion [s]
    "double_pendulum": (double_pendulum, (1.0, 2.0, 0.8, 0.6, 0.5, -0.3, 1.0, 2.0), models.double_pendulum, 0.3),
    "loop": (loop, (*LENGTHS, 1.0, 2.0, 1.5, 3.0, 0.7, 2.0), four_bar, 0.2),
    "driven": (driven, (*LENGTHS, 0.7, 2.0), lambda: four_bar(drive=mbs.forces.Harmonic(0.7, 0.5, 2.0)), 0.2),
    "slider_crank": (slider_crank, (1.2, 2.0, 3.0, 0.4), lambda: models.slider_crank(gas_force=-200.0), 0.1),
    "squeezer": (squeezer, 10.0 * np.array(models.ANDREWS["masses"]), models.andrews, 0.002),
}


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_gradient_of_a_motion_by_the_design_is_that_of_differences(name):
    """Along one direction of all numbers, differences of fourth order; and every component is there."""
    model, numbers, concrete, end = CASES[name]
    numbers, like = np.array(numbers), concrete()
    random = np.random.default_rng(1)
    along = random.choice([-1.0, 1.0], numbers.size) * random.uniform(0.5, 1.0, numbers.size) * np.abs(numbers)

    def last(numbers):
        system, state = model(numbers, like)
        states = mbs.simulate(system, state, ts=state.t + jnp.array([end]), rtol=1e-10, atol=1e-10).states
        return states.coordinates[-1], states.velocities[-1]

    weights = [jnp.asarray(random.normal(size=x.shape)) for x in jax.eval_shape(last, numbers)]
    loss = lambda n: sum(jnp.dot(w, x) for w, x in zip(weights, last(n), strict=True))
    both = mbs.jit(jax.value_and_grad(loss), compile="quick")
    h, gradient = 1e-3, np.asarray(both(numbers)[1])
    ends = [float(both(numbers + k * h * along)[0]) for k in (1, -1, 2, -2)]
    wanted = (8.0 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12.0 * h)
    assert np.all(gradient != 0.0), gradient
    np.testing.assert_allclose(gradient @ along, wanted, rtol=1e-6)
