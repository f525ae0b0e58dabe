"""A function of many distributions in one pass for each family."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxmbs.probability import LogNormal, Normal, RandomVariables
from jaxmbs.probability._map_alike import map_alike


def test_a_hundred_variables_in_a_program():
    """An array of a hundred known numbers cannot be made a list in a program of JAX 0.10."""
    many = RandomVariables({f"x{k}": Normal(float(k), 1.0) for k in range(120)})
    found = jax.jit(lambda: jnp.stack([*many.from_normal(jnp.zeros(120)).values()]))()
    np.testing.assert_array_equal(found, np.arange(120.0))


def test_each_has_its_own_result_in_its_place():
    """Two families in turn, with one pass for each: the place, and the derivative by a parameter, stay its own."""
    passes = []

    def number(one, u):
        passes.append(type(one))
        return one.from_normal(u)

    def numbers(mean):
        kinds = [Normal(mean, 0.5), LogNormal(3.0, 0.2), Normal(4.0, 0.1)]
        return jnp.stack(map_alike(number, kinds, jnp.unstack(jnp.array([1.0, 0.0, -2.0]))))

    found, slopes = numbers(jnp.array(2.0)), jax.jacfwd(numbers)(jnp.array(2.0))
    np.testing.assert_allclose(found, [2.5, 3.0 / np.sqrt(1.0 + (0.2 / 3.0) ** 2), 3.8], rtol=1e-12)
    np.testing.assert_allclose(slopes, [1.0, 0.0, 0.0], atol=1e-15)
    assert len(passes) == 4  # two families, twice
