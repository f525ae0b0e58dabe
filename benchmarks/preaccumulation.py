"""Preaccumulation: the Jacobian of a part of a function once, by the mode that suits the part."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree


def preaccumulate(function: Callable) -> Callable:
    """The function, with derivatives by its Jacobian, which reverse mode computes once.

    For a part with few results of many numbers, inside of a function of more results than numbers: forward mode over
    the whole would pass through the part once for each number.  A mechanism at one of many poses is such a part.  Its
    arguments and results are pytrees; arrays that it closes over are seen, and have derivatives.

    Source: Griewank and Walther 2008, Evaluating Derivatives, 10.2.
    """

    def evaluate(*args: Any) -> Any:
        closed = eqx.filter_closure_convert(function, *args)
        return _evaluate(closed, args)

    return evaluate


@eqx.filter_custom_jvp
def _evaluate(closed, args):
    return closed(*args)


@_evaluate.def_jvp
def _jvp(primals, tangents):
    changes = jax.tree.leaves(tangents)  # of the numbers that change
    changing = jax.tree.map(lambda t: t is not None, tangents, is_leaf=lambda t: t is None)
    numbers, others = eqx.partition(primals, changing)
    results = []

    def evaluate(*leaves):
        closed, args = eqx.combine(jax.tree.unflatten(jax.tree.structure(numbers), leaves), others)
        vector, back = ravel_pytree(closed(*args))
        results.append(back)
        return vector

    found, pull = jax.vjp(evaluate, *jax.tree.leaves(numbers))
    rows = jax.vmap(pull)(jnp.eye(len(found), dtype=found.dtype))
    change = sum(row.reshape(len(found), -1) @ t.ravel() for row, t in zip(rows, changes, strict=True))
    return results[0](found), results[0](change)
