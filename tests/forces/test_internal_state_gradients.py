"""Derivatives of a motion by every number of every element with states, and through ten thousand steps."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs.friction import LuGre
from tests.forces.test_element_bonds import CYLINDER, SIZES

LAWS = {
    "Maxwell": F.Maxwell(300.0, 20.0),
    "Zener": F.Zener(300.0, 20.0, 50.0, 0.1),
    "Prony": F.Prony(10.0, [50.0, 30.0], [0.1, 0.5]),
    "FrictionForce": F.FrictionForce(LuGre(1.0, 1e3 / 3, 5.0 / 3, 0.1, 1.4, 0.5), 3.0),
    "ElastoPlastic": F.ElastoPlastic(200.0, 4.0, 0.1),
    "Motor": F.Motor(12.0, 1.5, 0.05, 0.3, 0.32, max_voltage=10.0),
    "HydraulicCylinder": F.HydraulicCylinder(
        *SIZES, 0.1, **(CYLINDER | {"supply": 2e5, "leakage": 1e-9}), varying=True
    ),
    "AirSpring": F.AirSpring(0.001, 3e5, 0.5),
}


def moved(law, like=None):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("link", law, joint="x")
    return b.build(like=like)


@pytest.mark.long
@pytest.mark.parametrize("name", LAWS)
def test_slopes_by_every_number(name):
    law, like = LAWS[name], moved(LAWS[name])
    numbers, rest = eqx.partition(law, eqx.is_inexact_array)

    @jax.jit
    def end(numbers):
        system = moved(eqx.combine(numbers, rest), like)
        state = mbs.State.at(system, x=0.31, velocities={"x": 0.4})
        motion = mbs.simulate(system, state, ts=[0.0, 0.2], rtol=1e-11, atol=1e-12)
        return motion.states.coordinates[-1, 0]

    slopes, tree = jax.tree.flatten(jax.jit(jax.grad(end))(numbers))
    values, felt = jax.tree.leaves(numbers), 0
    for k, (value, slope) in enumerate(zip(values, slopes, strict=True)):
        h = 1e-4 * jnp.where(value == 0.0, 1.0, jnp.abs(value))
        sides = []
        for sign in (1.0, -1.0):
            changed = [v + sign * h if j == k else v for j, v in enumerate(values)]
            sides.append(float(end(jax.tree.unflatten(tree, changed))))
        difference = (sides[0] - sides[1]) / 2.0
        product = float(jnp.sum(slope * h))
        np.testing.assert_allclose(product, difference, rtol=1e-4, atol=3e-12, err_msg=f"{name}, number {k}")
        felt += abs(product) > 1e-9
    assert felt >= min(len(values), 2)


@pytest.mark.long
def test_reverse_mode_through_ten_thousand_steps():
    """A relaxing spring, by its stiffness and damping, against differences of the matrix exponential."""

    def exact(k, c):
        A = np.array([[0.0, 1.0, 0.0], [-10.0 / 2.0, 0.0, -k / 2.0], [0.0, 1.0, -k / c]])
        return (expm(A) @ [0.3, 0.4, 0.0])[0]

    def system_of(k, c, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("block", mass=2.0)
        b.joint("x", mbs.Prismatic("x"), "ground", "block")
        b.force("spring", mbs.SpringDamper(10.0), joint="x")
        b.force("link", F.Maxwell(k, c), joint="x")
        return b.build(like=like)

    like = system_of(300.0, 20.0)

    def end(k, c):
        system = system_of(k, c, like)
        state = mbs.State.at(system, x=0.3, velocities={"x": 0.4})
        motion = mbs.simulate(system, state, ts=[0.0, 1.0], dt=1e-4, solver=diffrax.Tsit5(), max_steps=20000)
        return motion.states.coordinates[-1, 0], motion.diagnostics.num_steps

    (value, steps), slopes = jax.jit(jax.value_and_grad(end, (0, 1), has_aux=True))(300.0, 20.0)
    assert int(steps) >= 10000
    np.testing.assert_allclose(value, exact(300.0, 20.0), rtol=1e-10)
    truth = [(exact(300.3, 20.0) - exact(299.7, 20.0)) / 0.6, (exact(300.0, 20.02) - exact(300.0, 19.98)) / 0.04]
    np.testing.assert_allclose(slopes, truth, rtol=1e-5)
