"""Searches that begin on a line of symmetry: saddles and maxima are left, or told; minima are not touched."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.design import interior_point

SADDLES = {  # objective, start, bounds, least value
    "saddle": (lambda x: x[0] ** 2 - x[1] ** 2, [0.5, 0.0], (-1.0, 1.0), -1.0),
    "maximum": (lambda x: x[1] ** 2 - x[0] ** 2, [0.0, 0.0], (-1.0, 2.0), -4.0),
    "mirror": (
        lambda x: (x[0] + x[1] - 1.0) ** 2 - (x[0] - x[1]) ** 2 + (x[0] - x[1]) ** 4,
        [0.2, 0.2],
        None,
        -0.25,
    ),
}


@pytest.mark.parametrize("name", SADDLES)
def test_a_search_leaves_a_saddle(name):
    """Such ends were called ok."""
    objective, start, bounds, least = SADDLES[name]
    found = mbs.minimise(objective, np.array(start), bounds, progress=False, compile="tape")
    assert found.ok and found.value == pytest.approx(least, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("optimiser", ["SLSQP", "interior point"])
def test_a_saddle_on_an_active_limit(optimiser):
    """The objective is flat: the limit bends, x >= 1 - y^2."""
    limit = mbs.Limit("arch", lambda d: d[0] + d[1] ** 2, lower=1.0)
    options = {"bounds": (-5.0, 2.0), "optimiser": optimiser, "limits": limit, "progress": False, "compile": "tape"}
    found = mbs.minimise(lambda d: d[0] + 0.0 * d[1], np.array([2.0, 0.0]), **options)
    assert found.ok and found.value < -2.99


def test_a_saddle_without_steps_left_is_told():
    objective, start, bounds, _ = SADDLES["maximum"]
    found = mbs.minimise(objective, np.array(start), bounds, steps=1, progress=False, compile="tape")
    assert not found.ok and "a saddle or a maximum" in found.reason


def test_a_minimum_on_a_line_of_symmetry_stays():
    """With a direction that is flat, and one whose curvature is a ten-thousandth of the other."""
    bowl = lambda x: (x[0] - 1.0) ** 2 + 1e-4 * x[1] ** 2 + 0.0 * x[2]
    found = mbs.minimise(bowl, np.array([3.0, 0.0, 0.5]), progress=False, compile="tape")
    assert found.ok and found.value < 1e-12 and found.design[1] == 0.0


@pytest.mark.slow
def test_the_interior_point_tells_a_saddle():
    """By its second derivatives; of minima, at a vertex without curvature too, it says nothing."""
    for name in ("saddle", "mirror"):
        objective, start, bounds, _ = SADDLES[name]
        found = interior_point(objective, np.array(start), bounds, compile="tape")
        assert not found.ok and "a saddle or a maximum" in found.reasons[int(found.reason)]
    tied = lambda x: jnp.stack([1.0 - x[0] - x[1], 1.0 - x[0] - x[1], -x[0]])
    assert interior_point(lambda x: x[0] + x[1], np.array([2.0, 3.0]), inequalities=tied, compile="tape").ok


@pytest.mark.slow
def test_small_units_are_no_optimum():
    """An objective of 1e-9, of which the first gradient is below the tolerance, ended where it began."""
    away = lambda x: 1e-9 * ((x[0] - 1.0) ** 2 + (x[1] - 2.0) ** 2)
    inside = lambda x: 1e-10 * (x @ x - 1.0)
    found = interior_point(away, np.array([5.0, 5.0]), compile="tape")
    np.testing.assert_allclose(found.design, [1.0, 2.0], rtol=1e-6)
    held = interior_point(away, np.array([5.0, 5.0]), inequalities=inside, compile="tape")
    assert held.ok and held.value == pytest.approx(1e-9 * (np.sqrt(5.0) - 1.0) ** 2, rel=1e-5)
