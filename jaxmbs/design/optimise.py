"""Minimise an objective over a bounded design by SciPy's L-BFGS-B or any optax optimiser."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import optax
from jaxtyping import PyTree
from tqdm import tqdm

from jaxmbs.design.drivers import lbfgsb, run_optax
from jaxmbs.design.optimum import Optimum
from jaxmbs.design.search import Search
from jaxmbs.design.starts import best_of, run_optax_together, stacked_variables
from jaxmbs.design.variables import Variables, read_variables
from jaxmbs.math.jit import jit


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
    starts: int | None = None,
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
        starts: search from so many first designs, stacked along a leading axis of every leaf of `design0` (`bounds`
            are those of one design).  An optax optimiser runs all of them together as one compiled program;
            L-BFGS-B one after the other.  Starts whose objective is not finite are left out.

    Returns:
        The best design found, with the history of the search and a table; with `starts` that of the best start,
        and those of all in `Optimum.starts`.

    Raises:
        TypeError: for a design leaf that is no number, or an optimiser of another type.
        ValueError: naming the variable, for a first design outside of its bounds or bounds that cross; for an
            objective that is no real scalar, or not finite at the first design (at all of them); for unknown options.
    """
    optimiser = None if isinstance(optimiser, str) and optimiser == "L-BFGS-B" else optimiser
    if optimiser is not None:
        _check_optimiser(optimiser)
    together = [read_variables(design0, bounds)] if starts is None else stacked_variables(design0, bounds, starts)
    evaluate = _evaluator(objective, together[0], gradient)
    with tqdm(total=steps * len(together), disable=not progress, desc="minimise") as bar:
        if starts is not None and optimiser is not None:
            searches = run_optax_together(evaluate, objective, together, optimiser, steps, tolerance, callback, bar)
            return best_of(searches)
        evaluate, searches = jit(evaluate), []
        for variables in together:
            search = Search(evaluate, variables, tolerance, callback, bar, may_fail=starts is not None)
            if steps > 0 and not search.reason:
                lbfgsb(search, steps) if optimiser is None else run_optax(search, objective, steps, optimiser)
            searches.append(search)
    return search.optimum() if starts is None else best_of(searches)


def _check_optimiser(optimiser) -> None:
    if isinstance(optimiser, str):
        raise ValueError(f"the optimiser {optimiser!r} is not known: take 'L-BFGS-B' or an optax optimiser")
    if not isinstance(optimiser, optax.GradientTransformation):
        raise TypeError(f"an optimiser is 'L-BFGS-B' or an optax.GradientTransformation, not {optimiser!r}")


def _evaluator(objective: Callable, variables: Variables, gradient: str) -> Callable:
    """The function from a vector to the objective and its gradient."""
    if gradient not in ("reverse", "forward"):
        raise ValueError(f"gradient is 'reverse' or 'forward', not {gradient!r}")

    def flat(x):
        return objective(variables.unravel(x))

    shape = jax.eval_shape(flat, variables.vector(variables.start))
    if getattr(shape, "shape", None) != () or not jnp.issubdtype(shape.dtype, jnp.floating):
        raise ValueError(f"the objective must be a real scalar, it is {shape}")
    if gradient == "reverse":
        return jax.value_and_grad(flat)
    slopes = jax.jacfwd(lambda x: (flat(x),) * 2, has_aux=True)
    return lambda x: slopes(x)[::-1]
