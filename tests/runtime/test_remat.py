"""What is worked out again: derivatives by closed forms, and how often the programs solve and factorise."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxmbs.math._spd import spd_solve
from jaxmbs.runtime import remat, save_factor, tuning

pytestmark = pytest.mark.usefixtures("tricks_on")


@pytest.mark.long
def test_a_solution_is_not_looked_for_again():
    def value(x):
        return jnp.sum(remat(lambda x: jnp.sin(spd_solve(jnp.diag(x), jnp.ones(3))))(x))

    x = jnp.array([1.0, 2.0, 4.0])
    np.testing.assert_allclose(jax.grad(value)(x), -jnp.cos(1.0 / x) / x**2, rtol=1e-12)
    assert str(jax.make_jaxpr(jax.grad(value))(x)).count("custom_linear_solve[") == 2  # the value's, the derivative's


@pytest.mark.parametrize(
    "size, times", [(tuning.SAVED_FACTOR, 1), (tuning.SAVED_FACTOR + 1, 2)], ids=["small", "large"]
)
def test_factors_are_kept_where_they_are_small(size, times):
    def value(x):
        return jnp.sum(remat(lambda x: x * save_factor(lax.stop_gradient(jnp.tan(x))))(x))

    x = jnp.linspace(0.0, 1.0, size)
    np.testing.assert_allclose(jax.grad(value)(x), jnp.tan(x), rtol=1e-12)
    assert str(jax.make_jaxpr(jax.grad(value))(x)).count(" tan ") == times
