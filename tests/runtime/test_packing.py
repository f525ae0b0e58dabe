"""Trees of numbers as vectors, and back: floats, whole numbers and truth values."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime._packing import Packing


def tree(dtype):
    whole, truth = jnp.asarray([3, -7], jnp.int32), jnp.asarray([True, False])
    return {"a": jnp.asarray([[1.5, 2.0, -3.0]], dtype), "b": (whole, None, truth), "c": dtype(4)}


@pytest.mark.parametrize("dtype", [jnp.float64, jnp.float32])
def test_there_and_back(dtype):
    example = jax.tree.map(jnp.asarray, tree(dtype))
    packing = Packing(jax.eval_shape(lambda: example), dtype)
    vector = packing.pack(example)
    assert vector.shape == (packing.size,) == (8,) and vector.dtype == dtype
    back = packing.unpack(vector)
    assert jax.tree.structure(back) == jax.tree.structure(example)
    for found, wanted in zip(jax.tree.leaves(back), jax.tree.leaves(example), strict=True):
        assert found.dtype == wanted.dtype
        np.testing.assert_array_equal(found, wanted)


def test_nothing():
    packing = Packing((), jnp.float64)
    assert packing.pack(()).shape == (packing.size,) == (0,) and packing.unpack(jnp.zeros(0)) == ()
