"""Steps with secants on a circle and a line, whose points of meeting are known."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from jaxmbs.cycles._secant import GOES_ON, LAST, NEW_SLOPE, SecantSteps
from jaxmbs.cycles._shooting import Linear


def rows(z, tolerance):
    """`x^2 + y^2 = 25`, `4 y = 3 x` at (4, 3) + z, with an error as large as a tolerance."""
    x, y = 4.0 + z[0], 3.0 + z[1]
    return jnp.stack([x**2 + y**2 - 25.0 + tolerance, 4.0 * y - 3.0 * x])


@jax.jit
def steps_from(start, slope, is_fine, tolerance=1e-5):
    """Steps from a point, with a slope (2, 2) that is said to be fine or not, as far as they go."""
    at, none = start, jnp.zeros((1, 2, 2))
    linear = Linear(rows(at, tolerance), slope[None], none, jnp.zeros((1, 2, 0)), jnp.zeros((0, 2)))
    exact, count = jnp.asarray(1e-13), jnp.zeros((), jnp.int32)
    first = SecantSteps.begin(linear, jnp.asarray(tolerance), exact, jnp.asarray(is_fine), count)
    once = lambda s: s.next(lambda z, t: rows(at + z, t), jnp.asarray(1e-11), jnp.full(2, jnp.inf))
    found = lax.while_loop(lambda s: s.state == GOES_ON, once, first)
    return found, at + found.z


def test_one_slope_is_enough_near_the_end():
    """Also one that is five per cent wrong; the tolerances end at that asked for."""
    slope = jnp.array([[8.2, 6.5], [-3.0, 4.0]])
    for wrong in (1.0, 1.05):
        found, z = steps_from(jnp.array([0.1, 0.15]), wrong * slope, False)
        assert found.state == LAST and found.motions <= 7 and found.error == 1e-13
        np.testing.assert_allclose(z, 0.0, atol=1e-11)


def test_a_start_within_the_errors_of_coarse_rows():
    """Their step is noise: the first trial is at the same point, and tells by itself what is left, however small."""
    slope = jnp.array([[8.0, 6.0], [-3.0, 4.0]])
    found, z = steps_from(jnp.zeros(2), slope, False)
    assert found.state == LAST and found.motions == 1
    np.testing.assert_allclose(z, 0.0, atol=1e-13)
    for wrong in (0.9, 1.1):
        found, z = steps_from(jnp.array([2e-6, -1e-6]), wrong * slope, False)
        assert found.state == LAST and found.motions > 1
        np.testing.assert_allclose(z, 0.0, atol=1e-11)


def test_secants_mend_a_slope_that_is_wrong():
    """Newton's method with one slope that is 40 % wrong halves errors; secants are at the root in a few steps."""
    slope = jnp.array([[8.0, 6.0], [-3.0, 4.0]]) @ jnp.array([[1.4, 0.2], [-0.2, 0.8]])
    found, z = steps_from(jnp.array([1e-3, 2e-3]), slope, False)
    assert found.state == LAST and found.motions <= 9
    np.testing.assert_allclose(z, 0.0, atol=1e-11)


def test_a_step_that_does_not_help_takes_a_new_slope():
    """A coarse slope at once; a fine one after shorter trials."""
    wrong = -jnp.array([[8.0, 6.0], [-3.0, 4.0]])
    found, z = steps_from(jnp.array([0.5, 0.5]), wrong, False)
    assert found.state == NEW_SLOPE and found.is_refused and found.motions == 1
    np.testing.assert_array_equal(z, [0.5, 0.5])
    found, _ = steps_from(jnp.array([3.0, 1.0]), jnp.diag(jnp.array([0.5, 4.0])), True)
    assert found.motions > 1 and found.state in (NEW_SLOPE, LAST)
