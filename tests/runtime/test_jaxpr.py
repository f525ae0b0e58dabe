"""Programs as equations: those that nothing needs are left out."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from jaxmbs.runtime import jaxpr_function, without_unused
from jaxmbs.runtime._jaxpr import equations


def test_what_nothing_needs_is_left_out():
    """Also of loops and calls; values, derivatives and constants stay."""
    weights = jnp.arange(3.0)

    def inner(x):
        once = lambda _, pair: (jnp.sin(pair[0]), jnp.exp(pair[1]))
        return lax.scan(lambda pair, _: (once(None, pair), None), (x, x), length=2)[0]

    def function(x, unused):
        kept, lost = jax.jit(inner)(x)
        jnp.tan(lost)
        return weights @ kept

    x = jnp.array([0.1, 0.2, 0.3])
    program = jax.make_jaxpr(function)(x, x)
    lean = without_unused(program)
    names = {equation.primitive.name for equation in equations(lean)}
    assert {"exp", "tan"} <= {equation.primitive.name for equation in equations(program)}
    assert "sin" in names and not {"exp", "tan"} & names
    value, slope = jax.value_and_grad(lambda x: jaxpr_function(lean)(x, x)[0])(x)
    np.testing.assert_allclose(value, function(x, x), rtol=1e-15)
    np.testing.assert_allclose(slope, jax.grad(function)(x, x), rtol=1e-15)
