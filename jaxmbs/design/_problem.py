"""The one program of a search: objective, limits and the gradients that are asked, of a vector of variables."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..runtime import compile_kind, jaxpr_function
from ._limit import BoundConstraint, Limit, bind, limit_values
from ._variables import Variables


class DesignProblem(NamedTuple):
    """What a search evaluates.

    Attributes:
        run: `(x (n,), rows (k,)) -> (objective, its gradient (n,), excess (m,), gradients of its rows (k, n), the
            limits' values)`; to be compiled.
        limits: with the shapes of their values.
    """

    run: Callable
    limits: tuple[BoundConstraint, ...]

    def alone(self, x: Array) -> tuple:
        """`run` without gradients of limits."""
        return self.run(x, jnp.zeros(0, jnp.int32))

    @property
    def size(self) -> int:
        """How many numbers of excess there are."""
        return sum(held.size for held in self.limits)


def trace_problem(
    objective: Callable, variables: Variables, gradient: str, limits: Sequence[Limit] = (), compile: str = "full"
) -> DesignProblem:
    """The program of an objective with limits, to be compiled as `compile` says.

    Raises:
        ValueError: for an unknown kind of gradient, an objective that is no real scalar (with a dict of answers
            beside it or not), or limits that do not fit their values.
        TypeError: for what is no Limit, or has no real value.
        UnknownNameError: for an answer that the objective does not give.
    """
    if gradient not in ("reverse", "forward"):
        raise ValueError(f"gradient is 'reverse' or 'forward', not {gradient!r}")
    for limit in limits:
        if not isinstance(limit, Limit):
            raise TypeError(f"limits are a list of Limit, not of {limit!r}")

    def answered(x):
        design = variables.unravel(x)
        value, answers = _split_answers(objective(design))
        return value, limit_values(limits, design, answers)

    with compile_kind(compile):  # traced once: shapes and derivatives come from the same equations
        traced, (shape, values) = jax.make_jaxpr(answered, return_shape=True)(variables.vector(variables.start))
    if getattr(shape, "shape", None) != () or not jnp.issubdtype(shape.dtype, jnp.floating):
        raise ValueError(f"the objective must be a real scalar, or one with a dict of answers; it is {shape}")
    known = tuple(bind(limit, value) for limit, value in zip(limits, values, strict=True))

    def flat(x):
        value, *values = jaxpr_function(traced)(x)
        parts = [limit.excess(v) for limit, v in zip(known, values, strict=True)]
        return jnp.concatenate([value[None], *parts]), tuple(values)

    differentiate = _forward_jacobian if gradient == "forward" else _reverse_jacobian

    def run(x, rows):
        found, values, slopes = differentiate(flat, x, jnp.concatenate([jnp.zeros(1, rows.dtype), rows + 1]))
        return found[0], slopes[0], found[1:], slopes[1:], values

    return DesignProblem(run, known)


def _split_answers(found):
    """(objective, answers or None) from what an objective returns."""
    return found if isinstance(found, tuple) and len(found) == 2 else (found, None)


def objective_value(objective: Callable, design: PyTree):
    """The objective of a design without the answers beside it."""
    return _split_answers(objective(design))[0]


def _reverse_jacobian(flat, x, rows):
    """(values, answers, gradients of the rows): one pullback a row."""
    found, pull, answers = jax.vjp(flat, x, has_aux=True)
    if rows.shape[0] == 1:  # by far the most common question: no axis of lanes
        return found, answers, pull(jnp.zeros_like(found).at[0].set(1.0))[0][None]
    seeds = jnp.zeros((rows.shape[0], found.shape[0]), found.dtype).at[jnp.arange(rows.shape[0]), rows].set(1.0)
    return found, answers, jax.vmap(lambda seed: pull(seed)[0])(seeds)


def _forward_jacobian(flat, x, rows):
    """The same, by one tangent a variable."""

    def twice(x):
        found, answers = flat(x)
        return found, (found, answers)

    slopes, (found, answers) = jax.jacfwd(twice, has_aux=True)(x)
    return found, answers, slopes[rows]


def select_working_set(size: int, worst: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """(size,) numbers of limits: those to keep, then the worst of the others."""
    others = np.argsort(-worst, kind="stable")
    order = np.concatenate([keep, others[~np.isin(others, keep)]])
    return np.sort(order[:size]).astype(np.int32)
