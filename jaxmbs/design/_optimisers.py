"""Optimisers without constraints: SciPy's L-BFGS-B, and any of optax."""

import contextlib
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax.flatten_util import ravel_pytree

from ._one_variable import AtKink, Bracket, close_bracket
from ._search import Point, Search

#: Halvings of a step until its design has finite values; 2^-30 is 1e-9 of the step, beyond which none is made.
HALVINGS = 30


def lbfgsb(search: Search, steps: int) -> None:
    """Run SciPy's L-BFGS-B on variables scaled by their bounds."""
    from scipy.optimize import minimize

    variables = search.variables
    scale = variables.scale
    offset = np.where(np.isfinite(variables.lower), variables.lower, 0.0)
    unit = search.gradient_norm  # of the objective: the first step is then about as long as the bounds are wide
    bracket = Bracket() if len(variables.names) == 1 else None

    def scaled(z):
        point = search.evaluate(offset + scale * z)
        if bracket is not None and bracket.add(point) and bracket.has_kink() and bracket.holds(search.best):
            raise AtKink
        value, slopes = (point.value, point.gradient) if point.finite else barrier_value(search.current, point.x)
        return value / unit, scale * slopes / unit

    def after_step(intermediate_result):
        if search.accept(search.evaluate(offset + scale * intermediate_result.x), by_decrease=True):
            raise StopIteration

    try:
        result = minimize(
            scaled,
            (variables.start - offset) / scale,
            jac=True,
            method="L-BFGS-B",
            bounds=np.stack([variables.lower - offset, variables.upper - offset], axis=1) / scale[:, None],
            callback=after_step,
            options={"maxiter": steps, "maxfun": 50 * steps, "ftol": 0.0, "gtol": 0.0},
        )
    except AtKink:
        result = None
    if search.reason or (result is not None and result.nit >= steps):
        return
    if result is not None and result.success:
        search.reason = "converged"
    elif bracket is not None and bracket.is_closed and bracket.holds(search.best):
        close_bracket(search, bracket)
    else:
        search.reason = search.failure_reason()


def barrier_value(current: Point, x: np.ndarray) -> tuple[float, np.ndarray]:
    """Value and gradient that stand in for those at a point x that has none, so that a line search turns back.

    Along the step s they belong to the parabola f + g s (t - 2 t^2), g s < 0, which leaves the current point (t = 0)
    with its slope g s, has risen by |g s| at x (t = 1), with slope -3 g s, and is least at t = 1/4: a line search
    that interpolates tries a quarter of the step next.
    """
    rise = abs(float(np.dot(current.gradient, x - current.x)))
    return current.value + (rise or 1.0 + abs(current.value)), -3.0 * current.gradient


@contextlib.contextmanager
def standard_promotion():
    """Context in which JAX promotes types and ranks as optax expects, whatever the user's settings."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def run_optax(search: Search, objective: Callable, steps: int, optimiser: optax.GradientTransformation) -> None:
    """Run an optax optimiser in the units of the design."""
    optimiser = optax.with_extra_args_support(optimiser)
    variables = search.variables

    @jax.jit
    def update(x, value, slopes, state):
        slopes = variables.unravel(slopes)
        extra = {"value": value, "grad": slopes, "value_fn": objective}
        updates, state = optimiser.update(slopes, state, variables.unravel(x), **extra)
        return ravel_pytree(updates)[0], state

    with standard_promotion():
        state = optimiser.init(variables.unravel(variables.clip(variables.start)))
    for _ in range(steps):
        at = search.current
        slopes = jnp.asarray(at.gradient, float)
        with standard_promotion():
            move, state = update(variables.clip(at.x), jnp.asarray(at.value, float), slopes, state)
        trials = (search.evaluate(at.x + 0.5**k * np.asarray(move, float)) for k in range(HALVINGS))
        point = next((trial for trial in trials if trial.finite), None)
        if point is None:
            search.reason = "non-finite"
            return
        if search.accept(point, by_decrease=False):
            return
