"""The slope of the equations of a cycle with a free period, in two segments, against differences of their rows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.cycles import _periodic as periodic

from .oscillators import van_der_pol


@pytest.mark.long
def test_slope_is_that_of_the_rows():
    """At states that are no cycle; the period is an unknown by its logarithm."""
    system, period = van_der_pol(), jnp.asarray(6.0)
    begin = mbs.State.at(system, x=1.5, velocities={"x": 0.7})
    flow = periodic.flow_of(begin, None, None, None, None, None, 10_000)
    options = periodic.CycleOptions(None, (), True, 2, 120)
    shooting = periodic.problem_of(system, begin, flow, period, options).shooting
    other = mbs.State.at(system, x=-1.2, velocities={"x": -0.5})
    states = jax.tree.map(lambda a, b: jnp.stack([a, b]), *map(periodic._bare, (begin, other)))

    @mbs.jit(compile="tape")
    def both(z):
        charts = shooting.charts(system, states, period)
        linear = shooting.linearised(system, charts, period)
        return linear.rows, linear.matrix, shooting.rows(system, charts, *shooting.parts(z, period), "forward")

    zero, step = jnp.zeros(5), 1e-5
    found, matrix, again = both(zero)
    np.testing.assert_allclose(found, again, atol=1e-9)
    for k, column in enumerate(np.eye(5)):
        slope = (both(step * column)[2] - both(-step * column)[2]) / (2.0 * step)
        np.testing.assert_allclose(matrix[:, k], slope, atol=1e-6 * max(1.0, np.max(np.abs(slope))))
