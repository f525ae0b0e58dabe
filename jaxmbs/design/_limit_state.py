"""Limit states: functions of random numbers whose zero is the border of failure."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, PyTree

from ..batching._batch import evaluate_batch
from ..errors import ModelError
from ..probability import RandomVariables
from ..runtime import TracedFunction
from ..typing import AnyArray


class LimitState(NamedTuple):
    """A function of random numbers to m numbers, of which those at and below zero mean failure.

    Attributes:
        program: of the numbers (n,) in the order of the variables to [(m,)].
        size: m.
        reverse: mode of its gradient.
    """

    program: Callable
    size: int
    reverse: bool

    def at(self, u: Float[Array, " n"], variables: RandomVariables, factor: Array | None) -> Array:
        """Its values (m,) at a point of independent standard normal numbers."""
        return self.program(variables.row_from_normal(u, factor))[0]

    def sampled(self, points: np.ndarray, variables: RandomVariables, compile: str, total: int) -> np.ndarray:
        """Values (k, m) at points (k, n) of independent standard normal numbers; nan where there is none.

        `total` points will be asked for, this time and later."""
        at_point: Any = _AtPoint(self, variables)  # a tuple that is called, which mypy takes for no function
        found = evaluate_batch(at_point, points, None, False, compile=compile, total=total)
        return np.where(np.asarray(found.ok)[:, None], np.asarray(found.values, float), np.nan)


class _AtPoint(NamedTuple):
    """A limit state of given variables as a function of a point in normal space."""

    limit_state: LimitState
    variables: RandomVariables

    def __call__(self, u: Any) -> Array:
        return self.limit_state.at(u, self.variables, None)


def read_variables(variables: Any) -> RandomVariables:
    """The random variables, also of a dict of distributions.  Raises: ModelError for other things."""
    if isinstance(variables, RandomVariables):
        return variables
    if not isinstance(variables, Mapping):
        text = f"variables must be RandomVariables, or a dict of name to distribution, not {variables!r}"
        raise ModelError([text], "the question")
    return RandomVariables(variables)


def variables_of(variables: Any, design: PyTree) -> RandomVariables:
    """The random variables of a design, which may be a function of it."""
    return read_variables(variables(design) if callable(variables) else variables)


def trace_limit_state(function: Callable, variables: RandomVariables, gradient: str, compile: str) -> LimitState:
    """Trace a limit state at the medians of its variables.

    Raises: ValueError for an unknown gradient; TypeError for a function that returns no real number or row of them.
    """
    if gradient not in ("reverse", "forward"):
        raise ValueError(f"gradient must be 'reverse' or 'forward', not {gradient!r}")
    if not callable(function):
        raise TypeError(f"the limit state must be a function of a dict of the variables, not {function!r}")
    names = variables.names

    def of_numbers(x):
        return _as_row(function(dict(zip(names, x, strict=True))))

    medians = jnp.zeros(len(names))
    program = TracedFunction(of_numbers, medians, compile=compile, tape_first=True)
    (size,) = program.shape.shape
    return LimitState(program, size, gradient == "reverse")


def _as_row(value):
    is_number = isinstance(value, AnyArray | float | int) and not isinstance(value, bool)
    if not is_number or jnp.iscomplexobj(value) or np.ndim(value) > 1 or not np.size(value):
        kind = f"an array of shape {np.shape(value)}" if isinstance(value, AnyArray) else repr(value)
        raise TypeError(f"a limit state returns one real number, or a row of them for a system; it returned {kind}")
    return jnp.atleast_1d(jnp.asarray(value, float))


def scalar_limit(limit_state: Any, variables: RandomVariables, factor: Array | None, which: Any) -> Callable:
    """One of the limit states as a function of the point, that is a pytree."""
    limit = lambda u: limit_state.at(u, variables, factor)[which]
    return eqx.filter_closure_convert(limit, jax.ShapeDtypeStruct((len(variables.names),), jnp.zeros(()).dtype))
