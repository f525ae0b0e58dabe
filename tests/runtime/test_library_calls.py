"""Loops over matrix products that stay calls of XLA's library."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime import with_library_calls, without_tricks


def total(x):
    return jnp.sum(with_library_calls(x) ** 2)


@pytest.mark.parametrize("values", [[1.0, 2.0, 3.0], [3.0, 2.0, 2.0], [0.0, -0.0]])
def test_numbers_and_slopes_pass(values):
    x = jnp.array(values)
    np.testing.assert_array_equal(with_library_calls(x), x)
    np.testing.assert_array_equal(jax.grad(total)(x), 2.0 * x)


@pytest.mark.skipif(jax.default_backend() != "cpu", reason="for XLA's CPU compiler")
def test_the_loop_holds_a_sort_unless_it_is_switched_off():
    """The compiled program has it still, so that no kernel can hold the loop."""
    loop = jax.jit(lambda rows: jax.lax.map(total, rows))
    rows = jnp.ones((3, 4))
    assert " sort(" in loop.lower(rows).compile().as_text()
    with without_tricks("library_calls"):
        assert " sort(" not in jax.jit(lambda rows: jax.lax.map(total, rows)).lower(rows).compile().as_text()
