"""Fronts between two aims against closed forms."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.design import pareto


def near(design):
    return (design["x"] - 1.0) ** 2 + design["y"] ** 2


def far(design):
    return (design["x"] + 1.0) ** 2 + design["y"] ** 2


def test_front_between_two_points():
    """Squares of the distances to (1, 0) and (-1, 0): on the line between, sqrt f + sqrt g = 2."""
    front = pareto(near, far, {"x": 0.3, "y": 0.5}, points=7, progress=False)
    assert np.all(front.ok), front.table()
    np.testing.assert_allclose(np.sqrt(front.first) + np.sqrt(front.second), 2.0, atol=1e-4)
    np.testing.assert_allclose(np.diff(front.second), -4.0 / 6.0, atol=1e-5)
    np.testing.assert_allclose(front.designs["y"], 0.0, atol=1e-3)
    rate = np.sqrt(front.first / front.second)[1:-1]  # -df/dg along sqrt f + sqrt g = 2
    np.testing.assert_allclose(front.exchange[1:-1], rate, rtol=1e-3)
    assert "exchange" in front.table()
    with pytest.raises(ValueError, match="three points"):
        pareto(near, far, {"x": 0.3, "y": 0.5}, points=2)


def test_a_front_that_bends_inwards():
    """f = x, g = 1 - x^2 on [0, 1]: no weighted sum of them is least inside, limits find it."""
    front = pareto(
        lambda d: d["x"], lambda d: 1.0 - d["x"] ** 2, {"x": 0.5}, {"x": (0.0, 1.0)}, points=5, progress=False
    )
    np.testing.assert_allclose(front.second, 1.0 - front.first**2, atol=1e-6)
    np.testing.assert_allclose(front.first, np.sqrt([0.0, 0.25, 0.5, 0.75, 1.0]), atol=1e-4)


@pytest.mark.long
def test_ends_are_best_in_both_aims():
    """y is free for the second aim alone: the end of the front has it at zero all the same."""
    for aims in ((near, lambda d: (d["x"] + 1.0) ** 2), (lambda d: (d["x"] - 1.0) ** 2, far)):
        front = pareto(*aims, {"x": 0.3, "y": 0.5}, points=4, progress=False)
        assert np.all(front.ok) and len(front.first) == 4
        np.testing.assert_allclose(front.designs["y"], 0.0, atol=1e-4)
        np.testing.assert_allclose(np.sqrt(front.first) + np.sqrt(front.second), 2.0, atol=1e-4)


WAVES = [lambda d, a=a: jnp.sin(a * d["x"] + a) + 0.1 * (d["x"] - a) ** 2 for a in (2.0, 3.0, 4.0)]


@pytest.mark.parametrize("aims", [(0, 1), (1, 2), pytest.param((2, 0), marks=pytest.mark.long), (1, 1)])
@pytest.mark.parametrize("start", [-3.0, 4.0])
def test_no_point_is_beaten_by_another(aims, start):
    """Of aims with many valleys, where searches end in different ones; of an aim and itself, one point."""
    front = pareto(WAVES[aims[0]], WAVES[aims[1]], {"x": start}, {"x": (-5.0, 5.0)}, points=5, progress=False)
    assert np.all(np.diff(front.first) > 0.0) and np.all(np.diff(front.second) < 0.0)
    assert len(front.first) == len(front.ok) == len(front.exchange) == len(front.designs["x"]) <= 5
    assert len(front.first) == 1 or aims != (1, 1)


@pytest.mark.parametrize("aims", [(near, lambda d: d["x"] - d["y"]), (lambda d: d["x"], near)])
def test_an_aim_without_least_value_has_no_front(aims):
    with pytest.raises(ValueError, match="no Pareto front, .* has no minimum: .* along [xy, ]+; give it bounds"):
        pareto(*aims, {"x": 0.3, "y": 0.5}, points=5, progress=False)


@pytest.mark.long
def test_one_program_for_all_points():
    traced = []

    def near_and_counted(design):
        traced.append(1)
        return near(design)

    counts = []
    for points in (3, 9):
        traced.clear()
        pareto(near_and_counted, far, {"x": 0.3, "y": 0.5}, points=points, progress=False)
        counts.append(len(traced))
    assert counts[0] == counts[1] == 1  # shapes, values and gradients come from one trace
