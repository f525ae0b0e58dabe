"""A pytree of numbers as one vector: what a loop carries or logs is one array, read and written by one operation."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, PyTree


class Packing:
    """Conversion of trees like `example` (arrays, or their shapes and types) to vectors of a floating type, and back.

    Whole numbers and truth values are kept as such numbers: exact up to 2^53 in double, 2^24 in single precision.
    """

    def __init__(self, example: PyTree, dtype):
        self.leaves, self.tree = jax.tree.flatten(example)
        self.ends, self.dtype = np.cumsum([leaf.size for leaf in self.leaves]).tolist(), dtype

    @property
    def size(self) -> int:
        return self.ends[-1] if self.ends else 0

    def pack(self, tree: PyTree) -> Array:
        """The vector (size,) of a tree."""
        parts = [lax.convert_element_type(x, self.dtype).reshape(-1) for x in jax.tree.leaves(tree)]
        return jnp.concatenate([jnp.zeros(0, self.dtype), *parts])

    def unpack(self, vector: Array) -> PyTree:
        """The tree of a vector (size,)."""
        parts = zip(jnp.split(vector, self.ends[:-1]), self.leaves, strict=True) if self.leaves else ()
        return jax.tree.unflatten(self.tree, [_as(part.reshape(like.shape), like.dtype) for part, like in parts])


def _as(x, dtype):
    return x != 0.0 if dtype == np.bool_ else lax.convert_element_type(x, dtype)
