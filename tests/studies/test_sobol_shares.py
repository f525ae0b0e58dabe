"""Shares of stored answers: functions whose shares are known in closed form."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import ModelError, UnknownNameError
from jaxmbs.studies import grid, normal, sobol, sobol_shares

BOX = {name: (-np.pi, np.pi) for name in "abc"}


def ishigami(d):
    return {"y": jnp.sin(d["a"]) + 7 * jnp.sin(d["b"]) ** 2 + 0.1 * d["c"] ** 4 * jnp.sin(d["a"]), "z": 2.0 * d["b"]}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    mbs.sweep(ishigami, sobol(BOX, 2048), folder, progress=False)
    return mbs.studies.open(folder)


def test_ishigami(study):
    """Source: Ishigami and Homma 1990; shares in closed form."""
    shares = sobol_shares(study, "y")
    parts = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 49 / 8, 8 * 0.01 * np.pi**8 / 225
    first = np.array([parts[0], parts[1], 0.0]) / sum(parts)
    total = np.array([parts[0] + parts[2], parts[1], parts[2]]) / sum(parts)
    np.testing.assert_allclose([*shares.first.values()], first, atol=2e-3)
    np.testing.assert_allclose([*shares.total.values()], total, atol=2e-3)
    assert shares.explained > 0.99 and "degree 8" in repr(shares)
    np.testing.assert_allclose([shares.mean, shares.deviation], [3.5, np.sqrt(sum(parts))], rtol=2e-3)


def test_one_of_several_variables(study):
    shares = sobol_shares(study, "z")
    np.testing.assert_allclose([*shares.total.values()], [0.0, 1.0, 0.0], atol=1e-12)
    only = sobol_shares(study, "y", ["b", "c"])
    assert list(only.first) == ["b", "c"] and only.explained < 0.7


def test_normal_variables():
    """x + 2 y + x y of standard normal numbers: variances 1, 4, 1."""
    plan = normal({"x": 0.0, "y": 0.0}, {"x": 1.0, "y": 1.0}, 4096)
    data = mbs.sweep(lambda d: {"f": d["x"] + 2 * d["y"] + d["x"] * d["y"]}, plan, progress=False)
    shares = sobol_shares(data, "f", distribution="normal")
    np.testing.assert_allclose([*shares.first.values()], [1 / 6, 4 / 6], atol=5e-3)
    np.testing.assert_allclose([*shares.total.values()], [2 / 6, 5 / 6], atol=5e-3)


def test_a_grid():
    data = mbs.sweep(lambda d: {"f": d["x"] ** 2 + d["y"]}, grid(x=np.linspace(-1, 1, 41), y=np.linspace(-1, 1, 41)))
    first = sobol_shares(data, "f").first
    np.testing.assert_allclose(
        [first["x"], first["y"]], [4 / 45 / (4 / 45 + 1 / 3), 1 / 3 / (4 / 45 + 1 / 3)], atol=0.02
    )


def test_what_cannot_be_answered(study):
    with pytest.raises(UnknownNameError, match="'q'"):
        sobol_shares(study, "q")
    with pytest.raises(UnknownNameError, match="'d'"):
        sobol_shares(study, "y", ["a", "d"])
    with pytest.raises(ModelError, match="5 designs with numbers are too few for 3 variables"):
        sobol_shares(study.isel(design=slice(0, 5)), "y")
    with pytest.raises(ModelError, match="neither 'uniform' nor 'normal'"):
        sobol_shares(study, "y", distribution="beta")
    with pytest.raises(ModelError, match="does not scatter"):
        sobol_shares(study.assign(y=0.0 * study["y"]), "y")
