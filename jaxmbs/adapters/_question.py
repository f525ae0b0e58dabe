"""A function of a pytree as a function of one vector with named parts on both sides."""

import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..assembly._state import State
from ..batching._result import design_status
from ..checks import repeated
from ..design._variables import Variables, read_variables
from ..motion._motion import Motion
from ..runtime import compile_kind, jaxpr_function, without_unused

_UNIT = re.compile(r"\s*\[([^\[\]]*)\]$")


class Part(NamedTuple):
    """One leaf of a pytree, in the vector of all.

    Attributes:
        name: path of the leaf, without the unit.
        shape: of the leaf.
        entries: its place in the vector.
        unit: the text in brackets at the end of its name, `"camber [deg]"`; None without one.
    """

    name: str
    shape: tuple[int, ...]
    entries: slice
    unit: str | None


class Question(NamedTuple):
    """A traced function of a vector.

    Attributes:
        inputs, outputs: parts of the vectors on both sides.
        variables: first values and bounds (n,).
        evaluate: `x (n,) -> (y (m,), status)`; to be compiled.  Motions and states among the results are judged, and
            are no outputs.
    """

    inputs: tuple[Part, ...]
    outputs: tuple[Part, ...]
    variables: Variables
    evaluate: Callable[[Array], tuple[Array, Array]]


def trace_question(
    function: Callable[[PyTree], Any], example: PyTree, bounds: PyTree | None = None, compile: str = "full"
) -> Question:
    """Trace a function of a pytree to a pytree of real numbers; or to a number and a dict, as `minimise` takes it.

    Raises:
        TypeError: for a leaf of the example that is no number, or a result that is not real.
        ValueError: for bounds that do not fit, two parts of one name, or a function without results.
    """
    variables = read_variables(example, bounds)
    results: list[Any] = []

    def flat(x):
        found = _with_names(function(variables.unravel(x)))
        kept = jax.tree.map(lambda part: None if _is_judged(part) else part, found, is_leaf=_is_judged)
        results[:] = _named_leaves(kept, "result")
        numbers = [jnp.ravel(jnp.asarray(leaf)) for _, leaf in results]
        _check_results(results)
        return jnp.concatenate(numbers), design_status(found)

    with compile_kind(compile):
        traced = jax.make_jaxpr(flat)(jnp.asarray(variables.start, float))
    program = jaxpr_function(without_unused(traced))
    inputs = _parts(_named_leaves(example, "design"))
    return Question(inputs, _parts(results), variables, lambda x: tuple(program(x)))


def _with_names(found: Any) -> Any:
    """The results of a function that `minimise` takes, the objective by its name."""
    if isinstance(found, tuple) and len(found) == 2 and isinstance(found[1], Mapping):
        return {"objective": found[0], **found[1]}
    return found


def _is_judged(part: Any) -> bool:
    return isinstance(part, Motion | State)


def _named_leaves(tree: PyTree, alone: str) -> list[tuple[str, Any]]:
    """Pairs of path and leaf; a tree that is a leaf has the name `alone`."""
    paths = jax.tree_util.tree_leaves_with_path(tree)
    return [(jax.tree_util.keystr(path, simple=True, separator=".") or alone, leaf) for path, leaf in paths]


def _check_results(results: list[tuple[str, Any]]) -> None:
    if not results:
        raise ValueError("the function has no results but motions and states: return the numbers that are asked for")
    kinds = {name: jnp.asarray(leaf).dtype for name, leaf in results}
    other = [f"{name} is of type {kind}" for name, kind in kinds.items() if not jnp.issubdtype(kind, jnp.floating)]
    if other:
        raise TypeError(f"results must be real numbers, which have derivatives: {', '.join(other)}; leave them out")


def _parts(leaves: list[tuple[str, Any]]) -> tuple[Part, ...]:
    """Raises: ValueError where two leaves have one name."""
    found, start = [], 0
    for label, leaf in leaves:
        unit = _UNIT.search(label)
        name, size = _UNIT.sub("", label), int(np.prod(np.shape(leaf)))
        found.append(Part(name, tuple(np.shape(leaf)), slice(start, start + size), unit[1] if unit else None))
        start += size
    names = [part.name for part in found]
    twice = repeated(names)
    if twice:
        raise ValueError(f"two numbers have the name {', '.join(map(repr, twice))}: give each its own")
    return tuple(found)
