"""Rows at static places, and functions of rows a few at a time, against NumPy's indexing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime import gather_static, map_chunked, tuning

X = np.random.default_rng(0).normal(size=(9, 2, 3))
PLACES = {
    "one": [4],
    "all": range(9),
    "a run": [2, 3, 4],
    "runs": [7, 8, 0, 1, 1, 5],
    "more than run as slices": [8, 6, 4, 2, 0, 1, 3, 5, 7][: tuning.SLICED_RUNS + 2],
    "more than are few": [8, 6, 4, 2, 0, 1, 3, 5, 7] * (1 + tuning.GATHER_PRODUCT // 81),
    "none": [],
    "a table": [[0, 1], [1, 8]],
}


@pytest.mark.parametrize("places", PLACES.values(), ids=PLACES)
def test_take(places):
    places = np.asarray(places, int)
    np.testing.assert_array_equal(gather_static(jnp.asarray(X), places), X[places])
    weight = np.random.default_rng(1).normal(size=X[places].shape)
    found = jax.grad(lambda x: jnp.sum(weight * gather_static(x, places)))(jnp.asarray(X))
    wanted = np.zeros_like(X)
    np.add.at(wanted, places, weight)
    np.testing.assert_allclose(found, wanted, rtol=1e-14)


@pytest.mark.parametrize(
    "number",
    [
        1,
        tuning.ROWS_TOGETHER,
        pytest.param(tuning.ROWS_TOGETHER + 1, marks=pytest.mark.long),
        3 * tuning.ROWS_TOGETHER,
    ],
)
def test_over_rows(number):
    x, t = jnp.asarray(np.random.default_rng(2).normal(size=(number, 3))), jnp.arange(float(number))
    value = lambda x: map_chunked(lambda row: jnp.sin(row[0]) * row[1], (x, t))
    np.testing.assert_allclose(value(x), np.sin(x) * np.asarray(t)[:, None], rtol=1e-15)
    gradient = jax.grad(lambda x: jnp.sum(value(x)))(x)
    np.testing.assert_allclose(gradient, np.cos(x) * np.asarray(t)[:, None], rtol=1e-15)
