"""Design problem: objective, constraints and their gradients as one function of a vector of variables.

The optimisation problem is: minimise f(x) subject to c(x) <= 0 and to the bounds of x.  Every entry of every limit is
one constraint c_i, relative to the limit (`_limit.py`).
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..runtime import TracedFunction, take_notes
from ..status import Status
from ._limit import BoundConstraint, Limit, bind, limit_values
from ._variables import Variables


class DesignProblem(NamedTuple):
    """Functions that a search evaluates.

    Attributes:
        evaluate: `(x (n,), rows (k,)) -> (f, its gradient (n,), c (m,), Jacobian (k, n) of the rows of c, values of
            the limits)`; to be compiled.
        evaluate_values: `x (n,) -> (f, c (m,), values of the limits)`, for trials of a line search.
        constraints: the limits, bound to the shapes of their values.
        gradient: "reverse", where each row costs a pullback, or "forward", where all cost what one does.
    """

    evaluate: Callable
    evaluate_values: Callable
    constraints: tuple[BoundConstraint, ...]
    gradient: str

    def evaluate_objective(self, x: Array) -> tuple:
        """`evaluate` without gradients of constraints."""
        return self.evaluate(x, jnp.zeros(0, jnp.int32))

    @property
    def num_constraints(self) -> int:
        """Number m of entries of c."""
        return sum(constraint.size for constraint in self.constraints)


def trace_problem(
    objective: Callable,
    variables: Variables,
    gradient: str,
    limits: Sequence[Limit] = (),
    compile: str = "auto",
    tape_first: bool = False,
) -> DesignProblem:
    """Trace an objective with its limits; the result is to be compiled as `compile` says, `tape_first` or at once.

    Raises:
        ValueError: for an unknown kind of gradient, an objective that is not a real scalar (with a dict of answers
            beside it or not), or limits that do not fit their values.
        TypeError: for a limit that is not a `Limit`, or has no real value.
        UnknownNameError: for an answer that the objective does not return.
    """
    if gradient not in ("reverse", "forward"):
        raise ValueError(f"gradient must be 'reverse' or 'forward', not {gradient!r}")
    for limit in limits:
        if not isinstance(limit, Limit):
            raise TypeError(f"limits must be a list of Limit, not of {limit!r}")

    unravel = variables.unravel  # and no numbers of the start, so that another one traces nothing anew

    def objective_and_limits(x):
        design = unravel(x)
        with take_notes() as statuses:
            value, answers = _split_answers(objective(design))
        return value, limit_values(limits, design, answers, gradient), [s for s in statuses if jnp.ndim(s) == 0]

    start = variables.clip(variables.start)
    program = TracedFunction(objective_and_limits, start, compile=compile, tape_first=tape_first)
    shape, values, _ = program.shape
    if getattr(shape, "shape", None) != () or not jnp.issubdtype(shape.dtype, jnp.floating):
        raise ValueError(f"the objective must be a real scalar, or one with a dict of answers; it is {_kind(shape)}")
    constraints = tuple(bind(limit, value) for limit, value in zip(limits, values, strict=True))

    def objective_and_constraints(x):
        value, *values = program(x)
        values, statuses = values[: len(constraints)], values[len(constraints) :]
        is_outside = jnp.any(jnp.array([status == Status.VALIDITY for status in statuses], bool))
        parts = [constraint.evaluate(v) for constraint, v in zip(constraints, values, strict=True)]
        return jnp.concatenate([value[None], *parts]), (*values, is_outside)

    differentiate = _forward_jacobian if gradient == "forward" else _reverse_jacobian

    def evaluate(x, rows):
        rows = jnp.concatenate([jnp.zeros(1, rows.dtype), rows + 1])  # row 0 is the objective
        found, values, jacobian = differentiate(objective_and_constraints, x, rows)
        return found[0], jacobian[0], found[1:], jacobian[1:], values

    def evaluate_values(x):
        found, values = objective_and_constraints(x)
        return found[0], found[1:], values

    return DesignProblem(evaluate, evaluate_values, constraints, gradient)


def _kind(found: Any) -> str:
    """The kind of what an objective returns, in words."""
    if not hasattr(found, "dtype"):
        return f"of the type {type(found).__name__}"
    sizes = " x ".join(map(str, found.shape))
    return f"an array of {sizes} numbers: take its sum, its largest or one entry" if sizes else f"of {found.dtype}"


def _split_answers(found: Any) -> tuple[Any, Mapping | None]:
    """(objective, answers or None) from the return value of an objective."""
    return found if isinstance(found, tuple) and len(found) == 2 else (found, None)


def objective_value(objective: Callable, design: PyTree) -> Any:
    """The objective of a design without the answers beside it."""
    return _split_answers(objective(design))[0]


def _reverse_jacobian(function: Callable, x: Array, rows: Array) -> tuple:
    """(values, answers, Jacobian of the rows) by reverse mode: one pullback for each row."""
    found, pull, answers = jax.vjp(function, x, has_aux=True)
    if rows.shape[0] == 1:  # the objective alone, by far the most common call: no batch axis
        return found, answers, pull(jnp.zeros_like(found).at[0].set(1.0))[0][None]
    seeds = jnp.zeros((rows.shape[0], found.shape[0]), found.dtype).at[jnp.arange(rows.shape[0]), rows].set(1.0)
    return found, answers, jax.vmap(lambda seed: pull(seed)[0])(seeds)


def _forward_jacobian(function: Callable, x: Array, rows: Array) -> tuple:
    """(values, answers, Jacobian of the rows) by forward mode: one tangent for each variable."""

    def with_values(x):
        found, answers = function(x)
        return found, (found, answers)

    jacobian, (found, answers) = jax.jacfwd(with_values, has_aux=True)(x)
    return found, answers, jacobian[rows]


def select_working_set(size: int, constraints: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """Indices (size,) of constraints: those to keep, then the largest of the others."""
    others = np.argsort(-constraints, kind="stable")
    order = np.concatenate([keep, others[~np.isin(others, keep)]])
    return np.sort(order[:size]).astype(np.int32)
