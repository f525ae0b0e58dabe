"""Results that XLA computes once."""

from typing import TypeVar

from jax import lax

from ._tricks import is_on

Tree = TypeVar("Tree")


def fusion_barrier(tree: Tree) -> Tree:
    """The same arrays, computed once: XLA would compute them again in the loop of each result that they enter."""
    return lax.optimization_barrier(tree) if is_on("fusion_barriers") else tree
