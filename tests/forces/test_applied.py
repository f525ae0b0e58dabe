"""Loads on frames and on the whole system."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import forces as F
from jaxmbs.math._rotation import rotation_matrix

ROTATION = rotation_matrix(jnp.array([0.3, -0.2, 0.9]))
VECTOR = jnp.array([1.0, 2.0, 3.0])
ARGUMENTS = (ROTATION, jnp.ones(3), jnp.array([0.1, 0.2, 0.3]), jnp.array([1.0, 0.0, -1.0]))


def drag(rotation, position, angular_velocity, velocity, t):
    return -2.0 * velocity, -0.1 * angular_velocity


class Drag(eqx.Module):
    coefficient: float

    def __call__(self, rotation, position, angular_velocity, velocity, t):
        return -self.coefficient * velocity, -self.coefficient * angular_velocity


def turning(t):
    return jnp.stack([jnp.cos(t), jnp.sin(t), 0 * t])


LAWS = {
    "force": F.Force(VECTOR),
    "follower": F.Force((1.0, 2.0, 3.0), axes="body"),
    "signal": F.Force(F.Harmonic(amplitude=[1.0, 2.0, 3.0], omega=4.0)),
    "function": F.Force(turning),
    "torque": F.Torque(VECTOR, axes="body"),
    "wrench": F.Wrench(drag),
    "wrench_module": F.Wrench(Drag(0.3)),
}


def test_force_and_torque_axes():
    zero, t = jnp.zeros(3), jnp.array(0.3)
    expected = {
        "force": (VECTOR, zero),
        "follower": (ROTATION @ VECTOR, zero),
        "signal": (VECTOR * jnp.sin(1.2), zero),
        "function": (turning(t), zero),
        "torque": (zero, ROTATION @ VECTOR),
        "wrench": (-2.0 * ARGUMENTS[3], -0.1 * ARGUMENTS[2]),
        "wrench_module": (-0.3 * ARGUMENTS[3], -0.3 * ARGUMENTS[2]),
    }
    for name, parts in expected.items():
        np.testing.assert_allclose(LAWS[name].wrench(*ARGUMENTS, t), parts, atol=1e-15)
        assert LAWS[name].is_source and LAWS[name].potential(*ARGUMENTS[:2], t) == 0.0


@pytest.mark.parametrize("name", LAWS)
def test_loads_stack(name):
    law = LAWS[name]
    assert law.faults() == [] and all(eqx.is_array(leaf) for leaf in jax.tree.leaves(law))
    stack = jax.tree.map(lambda *leaves: jnp.stack(leaves), law, law)
    together = jax.jit(jax.vmap(lambda law, t: law.wrench(*ARGUMENTS, t)))(stack, jnp.array([0.3, 0.4]))
    alone = [law.wrench(*ARGUMENTS, jnp.array(t)) for t in (0.3, 0.4)]
    wanted = [jnp.stack(part) for part in zip(*alone, strict=True)] if jax.tree.leaves(law) else together
    np.testing.assert_allclose(together, wanted, rtol=1e-13, atol=1e-15)


@pytest.mark.long
def test_networks_keep_arrays_as_leaves():
    network = eqx.nn.MLP(2, 2, 4, 1, key=jax.random.key(0))
    law = F.GeneralisedEffort(lambda_of(network))
    assert len(jax.tree.leaves(law)) == len(jax.tree.leaves(eqx.filter(network, eqx.is_array)))
    x = jnp.array([0.1, 0.2])
    stack = jax.tree.map(lambda *leaves: jnp.stack(leaves), law, law)
    efforts = jax.vmap(lambda law: law.effort(x, x, 0.0))(stack)
    np.testing.assert_allclose(efforts[1], network(x), rtol=1e-13)
    slopes = jax.grad(lambda law: law.effort(x, x, 0.0).sum())(law)
    assert any(np.abs(leaf).max() > 0 for leaf in jax.tree.leaves(slopes))


def lambda_of(network):
    class OnCoordinates(eqx.Module):
        network: eqx.nn.MLP

        def __call__(self, coordinates, velocities, t):
            return self.network(coordinates)

    return OnCoordinates(network)


def test_generalised_effort():
    law = F.GeneralisedEffort(lambda q, v, t: t * q - v)
    np.testing.assert_allclose(law.effort(jnp.ones(2), jnp.ones(2), 2.0), [1.0, 1.0])
    partial = F.GeneralisedEffort(jax.tree_util.Partial(lambda k, q, v, t: k * q, 2.0))
    assert partial.effort(3.0, 1.0, 0.0) == 6.0 and len(jax.tree.leaves(partial)) == 1
    assert F.Force(lambda t: (0, t, 0.0)).wrench(*ARGUMENTS, 2.0)[0][1] == 2.0
    assert law.is_source and law.faults() == [] and jax.tree.leaves(law) == []


def test_mistakes():
    assert F.Force(3.0).faults() == ["value must have shape (3,), not ()"]
    with pytest.raises(TypeError, match="closes over traced values"):
        jax.grad(lambda k: F.GeneralisedEffort(lambda q, v, t: k * q).effort(1.0, 1.0, 0.0))(2.0)
    with pytest.raises(ValueError):
        F.Force(VECTOR, axes="local")
    assert F.Force([jnp.nan, 0.0, 0.0]).faults() == ["value: value is not a number"]
