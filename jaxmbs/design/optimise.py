"""Minimise an objective over a bounded design by SciPy's L-BFGS-B or any optax optimiser."""

import contextlib
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree
from tqdm import tqdm

from jaxmbs.design.optimum import Optimum
from jaxmbs.design.search import Point, Search
from jaxmbs.design.variables import Variables, read_variables

_HALVINGS = 30


def minimise(
    objective: Callable[[PyTree], Any],
    design0: PyTree,
    bounds: PyTree | None = None,
    optimiser: optax.GradientTransformation | str | None = None,
    steps: int = 100,
    tolerance: float = 1e-8,
    gradient: str = "reverse",
    progress: bool = True,
    callback: Callable[[int, PyTree, float], Any] | None = None,
) -> Optimum:
    """Find a design that makes an objective small.

    The search steps back from a trial design whose objective or gradient is not finite, and never loses the
    best design.

    Args:
        objective: takes a design like `design0` (leaves as JAX arrays) to a real scalar; it is traced.
        design0: first design, any pytree of numbers and arrays, typically a dict.
        bounds: None, or a pytree like `design0` with (lower, upper) or None in place of each leaf; each of
            the two is a number, an array in the shape of the leaf, or None.
        optimiser: "L-BFGS-B" (the default; variables scaled by their bounds), or an optax optimiser in the
            units of the design, projected on the bounds after each update.
        steps: largest number of steps.
        tolerance: the search has converged when the gradient norm (see `History`; a difference of objectives)
            is below `tolerance` times the larger of the objective and the first such norm, or (L-BFGS-B) when
            a step lowers the objective by less than `tolerance` times itself.
        gradient: "reverse" mode, or "forward" for few variables and simulations that only run forward.
        progress: whether to show a progress bar.
        callback: called after each step with (step, design, objective); a true result stops the search.

    Returns:
        The best design found, with the history of the search and a table.

    Raises:
        TypeError: for a design leaf that is no number, or an optimiser of another type.
        ValueError: naming the variable, for a first design outside of its bounds or bounds that cross; for an
            objective that is no real scalar, or not finite at the first design; for unknown options.
    """
    run = _driver(optimiser)
    variables = read_variables(design0, bounds)
    evaluate = _evaluator(objective, variables, gradient)
    with tqdm(total=steps, disable=not progress, desc="minimise") as bar:
        search = Search(evaluate, variables, tolerance, callback, bar)
        if steps > 0 and not search.reason:
            run(search, objective, steps)
    return search.optimum()


def _driver(optimiser) -> Callable[[Search, Callable, int], None]:
    if optimiser is None or optimiser == "L-BFGS-B":
        return _lbfgsb
    if isinstance(optimiser, str):
        raise ValueError(f"the optimiser {optimiser!r} is not known: take 'L-BFGS-B' or an optax optimiser")
    if not isinstance(optimiser, optax.GradientTransformation):
        raise TypeError(f"an optimiser is 'L-BFGS-B' or an optax.GradientTransformation, not {optimiser!r}")
    return lambda search, objective, steps: _optax(search, objective, steps, optimiser)


def _evaluator(objective: Callable, variables: Variables, gradient: str) -> Callable:
    """The compiled function from a vector to the objective and its gradient."""
    if gradient not in ("reverse", "forward"):
        raise ValueError(f"gradient is 'reverse' or 'forward', not {gradient!r}")

    def flat(x):
        return objective(variables.unravel(x))

    shape = jax.eval_shape(flat, variables.vector(variables.start))
    if getattr(shape, "shape", None) != () or not jnp.issubdtype(shape.dtype, jnp.floating):
        raise ValueError(f"the objective must be a real scalar, it is {shape}")
    if gradient == "reverse":
        return jax.jit(jax.value_and_grad(flat))
    slopes = jax.jacfwd(lambda x: (flat(x),) * 2, has_aux=True)
    return jax.jit(lambda x: slopes(x)[::-1])


def _lbfgsb(search: Search, objective: Callable, steps: int) -> None:
    from scipy.optimize import minimize

    variables = search.variables
    scale = variables.scale
    offset = np.where(np.isfinite(variables.lower), variables.lower, 0.0)
    unit = search.gradient_norm  # of the objective: the first step is about as long as the bounds are wide

    def scaled(z):
        point = search.evaluate(offset + scale * z)
        value, slopes = (point.value, point.gradient) if point.finite else _wall(search.current, point.x)
        return value / unit, scale * slopes / unit

    def after_step(intermediate_result):
        if search.accept(search.evaluate(offset + scale * intermediate_result.x), by_decrease=True):
            raise StopIteration

    result = minimize(
        scaled,
        (variables.start - offset) / scale,
        jac=True,
        method="L-BFGS-B",
        bounds=np.stack([variables.lower - offset, variables.upper - offset], axis=1) / scale[:, None],
        callback=after_step,
        options={"maxiter": steps, "maxfun": 50 * steps, "ftol": 0.0, "gtol": 0.0},
    )
    if not search.reason and result.nit < steps:
        search.reason = "converged" if result.success else search.stuck()


def _wall(current: Point, x: np.ndarray) -> tuple[float, np.ndarray]:
    """A value and gradient that turn a line search back to a quarter of its step towards x.

    Along the step they are those of the parabola that leaves the current point with its slope and has risen,
    at x, as much as that slope would have fallen.
    """
    rise = abs(float(np.dot(current.gradient, x - current.x)))
    return current.value + (rise or 1.0 + abs(current.value)), -3.0 * current.gradient


@contextlib.contextmanager
def _usual_promotion():
    """Inside, JAX promotes types and ranks as optax expects, whatever the user's settings."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def _optax(search: Search, objective: Callable, steps: int, optimiser: optax.GradientTransformation) -> None:
    optimiser = optax.with_extra_args_support(optimiser)
    variables = search.variables

    @jax.jit
    def update(x, value, slopes, state):
        slopes = variables.unravel(slopes)
        extra = {"value": value, "grad": slopes, "value_fn": objective}
        updates, state = optimiser.update(slopes, state, variables.unravel(x), **extra)
        return ravel_pytree(updates)[0], state

    with _usual_promotion():
        state = optimiser.init(variables.unravel(variables.vector(variables.start)))
    for _ in range(steps):
        at = search.current
        slopes = jnp.asarray(at.gradient, float)
        with _usual_promotion():
            move, state = update(variables.vector(at.x), jnp.asarray(at.value, float), slopes, state)
        trials = (search.evaluate(at.x + 0.5**k * np.asarray(move, float)) for k in range(_HALVINGS))
        point = next((trial for trial in trials if trial.finite), None)
        if point is None:
            search.reason = "non-finite"
            return
        if search.accept(point, by_decrease=False):
            return
