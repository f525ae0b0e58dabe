"""Kinks where a search ends are said, and smooth functions, stiff ones among them, have none."""

import functools

import jax.numpy as jnp
import pytest

import jaxmbs as mbs
from jaxmbs.design import Limit

START, BOUNDS = {"x": 0.7, "y": 0.6}, {"x": (-2.0, 2.0), "y": (-2.0, 2.0)}
KINKS = {
    "maximum": lambda d: jnp.maximum(d["x"] + 0.3 * d["y"], -2.0 * d["x"] + 0.1 * d["y"]) + d["y"] ** 2,
    "largest of three": lambda d: functools.reduce(
        jnp.maximum, [jnp.abs(d["x"] + d["y"] * t - t**2) for t in (0.0, 0.6, 1.0)]
    ),
    "absolute value": lambda d: jnp.abs(d["x"] - 0.2) + (d["y"] - 1.0) ** 2,
    "steep kink": lambda d: 1e4 * jnp.abs(d["x"] - d["y"]) + d["x"] ** 2,
    "beside a bound": lambda d: jnp.abs(d["x"] - 0.2) - d["y"],
}
SMOOTH = {
    "quadratic": lambda d: (d["x"] - 0.1) ** 2 + 3.0 * (d["y"] + 0.2) ** 2,
    "Rosenbrock": lambda d: (1 - d["x"]) ** 2 + 100.0 * (d["y"] - d["x"] ** 2) ** 2,
    "stiff valley": lambda d: 1e8 * (d["x"] - d["y"]) ** 2 + d["x"] ** 2,
    "rounded corner": lambda d: jnp.sqrt((d["x"] - 0.2) ** 2 + 1e-10) + d["y"] ** 2,
    "quartic": lambda d: (d["x"] - 0.3) ** 4 + d["y"] ** 4,
    "at a corner of the bounds": lambda d: d["x"] - 2.0 * d["y"],
}


@pytest.mark.parametrize("name", KINKS)
@pytest.mark.parametrize("optimiser", ["L-BFGS-B", "SLSQP"])
def test_kinks_are_said(name, optimiser):
    found = mbs.minimise(KINKS[name], START, BOUNDS, optimiser, progress=False)
    assert not found.ok and found.reason.startswith("a kink: the slope of the objective jumps from"), found.reason
    assert "design.Worst" in found.table()


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("optimiser", ["L-BFGS-B", "SLSQP"])
def test_smooth_functions_have_none(name, optimiser):
    found = mbs.minimise(SMOOTH[name], START, BOUNDS, optimiser, steps=300, progress=False)
    assert "kink" not in found.reason


@pytest.mark.slow
def test_a_kink_of_a_limit():
    """The least x under `|x - 0.5| + y <= 0` in the largest entry: the limit has the kink."""
    limit = Limit("corner", lambda d: jnp.abs(d["x"] - 0.5) - d["y"], upper=0.0, scale=1.0)
    found = mbs.minimise(lambda d: d["y"] + 0.0 * d["x"], START, BOUNDS, limits=limit, progress=False)
    assert found.ok or "kink" in found.reason or "descent" in found.reason
    assert found.value < 1e-6 or not found.ok
