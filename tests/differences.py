"""Derivatives by every number of a function, against central differences."""

import jax
import numpy as np


def check_slopes(function, home, rtol=1e-5):
    """The gradient of a function of a dictionary of numbers other than zero is that of differences, and not zero."""
    value, found = jax.jit(function), jax.jit(jax.grad(function))(home)
    for name, number in home.items():
        h = 1e-5 * number
        difference = (value(home | {name: number + h}) - value(home | {name: number - h})) / (2 * h)
        assert abs(difference) > 0, name
        np.testing.assert_allclose(found[name], difference, rtol=rtol, err_msg=name)
