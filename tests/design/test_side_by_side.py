"""`interior_point_batch`: the searches of `interior_point`, step by step, whatever the rounds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.design import interior_point, interior_point_batch
from jaxmbs.errors import ModelError

RADII = np.array([0.7, 1.0, 1.5, 3.0])
START = {"a": 0.3, "b": np.array([0.2, 0.1])}
BOUNDS = {"a": (-5.0, 5.0), "b": (-5.0, 5.0)}


def distance(x, radius):
    return (x["a"] - 2.0) ** 2 + jnp.sum((x["b"] - 1.0) ** 2) + 0.0 * radius


def outside(x, radius):
    return x["a"] ** 2 + jnp.sum(x["b"] ** 2) - radius**2


def nearest(radii, **options):
    return interior_point_batch(distance, START, radii, BOUNDS, inequalities=outside, progress=False, **options)


@pytest.mark.slow
@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_they_are_the_searches_of_interior_point(hessian):
    """To the last bit, in rounds of one, three and all steps; the points of a ball nearest to (2, 1, 1)."""
    singles = [
        interior_point(
            lambda x, r=radius: distance(x, r), START, BOUNDS, inequalities=lambda x, r=radius: outside(x, r),
            hessian=hessian, compile="tape",
        )
        for radius in RADII
    ]  # fmt: skip
    expected = jax.tree.map(lambda *parts: np.stack(parts), *singles)
    for steps in (1, 3, 200):
        found = nearest(RADII, hessian=hessian, round_steps=steps)
        assert found.ok.shape == (4,) and np.all(found.ok)
        names = ("design", "value", "inequalities", "lower", "upper", "residual", "steps", "evaluations", "reason")
        for name in names:
            jax.tree.map(np.testing.assert_array_equal, getattr(found, name), getattr(expected, name))
    length = np.sqrt(6.0)
    np.testing.assert_allclose(found.design["a"], 2.0 * np.minimum(RADII / length, 1.0), rtol=1e-6)
    np.testing.assert_allclose(found.value, np.maximum(length - RADII, 0.0) ** 2, atol=1e-7)


@pytest.mark.slow
def test_from_an_optimum_nearby():
    """Its multipliers and curvature save steps; the first optimum is of one problem."""
    first = interior_point(
        lambda x: distance(x, 1.0), START, BOUNDS, inequalities=lambda x: outside(x, 1.0), hessian="bfgs"
    )
    radii = np.linspace(0.98, 1.02, 5)
    cold = nearest(radii, hessian="bfgs")
    warm = interior_point_batch(
        distance, first.design, radii, BOUNDS, inequalities=outside, hessian="bfgs", warm=first, progress=False
    )
    assert np.all(warm.ok) and np.all(np.asarray(warm.steps) < np.asarray(cold.steps))
    np.testing.assert_allclose(warm.value, (np.sqrt(6.0) - radii) ** 2, rtol=1e-6)


@pytest.mark.slow
def test_what_ends_without_an_optimum_holds_no_other_one_up():
    """Without a value, without a design, and at the limit of steps."""
    found = nearest(np.array([1.0, np.nan, 2.0]))
    np.testing.assert_array_equal(found.ok, [True, False, True])
    assert (
        found.reasons[int(found.reason[1])] == "non-finite"
        and "1 of 3" in repr(found)
        and "non-finite" in repr(found)
    )
    apart = interior_point_batch(
        lambda x, gap: x**2, 0.5, np.array([0.0, 1.0]), progress=False,
        inequalities=lambda x, gap: jnp.stack([x - 1.0, 1.0 + gap - x]),
    )  # fmt: skip
    np.testing.assert_array_equal(apart.ok, [True, False])
    assert "no design near" in apart.reasons[int(apart.reason[1])]
    short = nearest(RADII, steps=2)
    assert not np.any(short.ok) and {short.reasons[int(k)] for k in short.reason} == {"step limit"}


@pytest.mark.slow
def test_a_table_of_cases_and_the_tape_of_another_call():
    """Cases are those of `batch`; the program is kept for the next call."""
    cases = [{"left": 1.0, "right": 2.0}, {"left": 3.0, "right": -1.0}]
    objective = lambda x, case: (x - case["left"]) ** 2 + (x - case["right"]) ** 2
    for _ in range(2):
        found = interior_point_batch(objective, 0.0, cases, progress=False)
        np.testing.assert_allclose(found.design, [1.5, 1.0], rtol=1e-7)


def test_wrong_rounds_and_programs_are_refused():
    with pytest.raises(ModelError, match="round_steps"):
        nearest(RADII, round_steps=0)
    with pytest.raises(TypeError, match="vmap of interior_point"):
        jax.jit(nearest)(RADII)
