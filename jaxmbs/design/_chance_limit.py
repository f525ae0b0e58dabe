"""Limits with a probability: what of a value is compared with the bound, and how probable it is to pass it."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..checks import count_faults, number_faults
from ..errors import ModelError
from ._limit_state import read_variables, variables_of
from ._percentile import percentile
from ._reliability import reliability
from ._reliability_result import Reliability

_SAMPLES = 1_000_000


def check_chance(limit: Any) -> None:
    """Raises: ModelError for a probability that is none, or without what it is of."""
    chance, faults = limit.probability, count_faults("samples", limit.samples)
    if chance is None:
        if limit.variables is not None:
            faults.append("variables are of a limit with a probability: give that too")
    else:
        faults += number_faults("probability", chance, positive=True)
        if not faults and not float(chance) < 1.0:
            faults.append(f"probability must lie between 0 and 1, it is {chance}")
        if limit.variables is None:
            faults.append("a probability needs variables, the distributions of the numbers that scatter")
        elif not callable(limit.variables):
            read_variables(limit.variables)
        if (limit.lower is None) == (limit.upper is None):
            faults.append("a probability is that of one bound: make two limits, each with its own")
        if not callable(limit.value):
            faults.append(f"value must be a function of a design and random numbers, not {limit.value!r}")
    if faults:
        raise ModelError(faults, f"the limit {limit.name!r}")


def value_with_probability(limit: Any, design: PyTree, gradient: str) -> Array:
    """The value, in its own shape, that each entry passes with the probability of the limit."""
    variables = variables_of(limit.variables, design)
    percent = 100.0 * (1.0 - limit.probability if limit.lower is None else limit.probability)
    of_numbers = lambda x: jnp.asarray(limit.value(design, x), float)
    shape = jax.eval_shape(lambda: of_numbers(variables.from_normal(jnp.zeros(len(variables.names))))).shape
    if not shape:
        return percentile(of_numbers, variables, percent, gradient=gradient)
    entry = lambda k: percentile(lambda x: jnp.ravel(of_numbers(x))[k], variables, percent, gradient=gradient)
    return jax.vmap(entry)(jnp.arange(int(np.prod(shape)))).reshape(shape)


def limit_reliability(limit: Any, design: PyTree, method: str, options: dict) -> Reliability:
    """Probability that a design passes a limit."""
    if limit.probability is None:
        raise ModelError(["it has no probability: its value is certain"], f"the limit {limit.name!r}")
    variables = variables_of(limit.variables, design)

    def margin(x):
        value = jnp.asarray(limit.value(design, x), float)
        return jnp.ravel(value - limit.lower if limit.upper is None else limit.upper - value)

    if method == "samples":
        options = {"samples": _SAMPLES, **options}
    return reliability(margin, variables, method, **options)
