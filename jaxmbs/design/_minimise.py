"""Minimise an objective over a bounded design that keeps limits, by optimisers of SciPy, nlopt and optax."""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
import optax
from jaxtyping import PyTree
from tqdm import tqdm

from ..runtime import jit
from ._constrained import SCIPY_OPTIMISERS, NLOPT_OPTIMISERS, nlopt_optimiser, run_constrained
from ._gradient_check import check_gradients
from ._limit import Limit
from ._multistart import run_multistart
from ._optimisers import lbfgsb, run_optax
from ._optimum import Optimum
from ._problem import trace_problem, objective_value
from ._search import Search
from ._starts import best_optimum, starting_points, run_optax_multistart
from ._variables import read_variables
from ._working_set import ConstrainedSearch


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
    starts: int | str | None = None,
    limits: Sequence[Limit] | Limit = (),
    check: bool = False,
    compile: str = "full",
) -> Optimum:
    """Find a design that makes an objective small, and keeps limits.

    The search steps back from a trial design whose objective or gradient is not finite, and never loses the
    best design.

    Args:
        objective: takes a design like `design0` (leaves as JAX arrays) to a real scalar, or to one and a dict of
            answers that `limits` name; it is traced.
        design0: first design, any pytree of numbers and arrays, typically a dict.
        bounds: None, or a pytree like `design0` with (lower, upper) or None in place of each leaf; each of
            the two is a number, an array in the shape of the leaf, or None.
        optimiser: "L-BFGS-B" (the default without limits; variables scaled by their bounds), "SLSQP" (the default
            with limits), "trust-constr", "MMA" or "CCSAQ" (where nlopt is installed), or an optax optimiser in the
            units of the design, projected on the bounds after each update.  L-BFGS-B and optax know no limits.
        steps: largest number of steps.
        tolerance: the search has converged when the gradient norm (see `History`; a difference of objectives)
            is below `tolerance` times the larger of the objective and the first such norm, or (L-BFGS-B) when
            a step lowers the objective by less than `tolerance` times itself.  With limits the norm is `kkt`, and
            where an optimiser finds no way on, a hundred times `tolerance` are enough.
        gradient: "reverse" mode, or "forward" for few variables and simulations that only run forward.
        progress: whether to show a progress bar.
        callback: called after each step with (step, design, objective); a true result stops the search.
        starts: search from so many first designs, side by side in one compiled program: `design0`, and points of
            Sobol's sequence between the two bounds that every variable needs.  "stacked": `design0` holds many
            designs along a leading axis of every leaf (`bounds` are those of one design).  Starts whose objective is
            not finite are left out.
        limits: what a design keeps, one `Limit` or many.  Of many the search differentiates those that hold it and
            the worst.  A design that keeps them to 1e-7 of each is better than any that does not; where none is
            found, the one that exceeds them least is the result.
        check: compare the gradients with differences at the first design, which costs two evaluations a variable.
        compile: "full", or "quick" for searches of some dozen evaluations: compiled in half the time, run two to four
            times as long.

    Returns:
        The best design found, with the history of the search and a table; with `starts` that of the best start,
        and those of all in `Optimum.starts`.

    Raises:
        TypeError: for a design leaf that is no number, or an optimiser of another type.
        ValueError: naming the variable, for a first design outside of its bounds or bounds that cross; for an
            objective that is no real scalar, or not finite at the first design (at all of them); naming the limit
            that limits nothing or has the name of another; for unknown options; with `check`, for gradients that
            disagree with differences.
        ImportError: for an optimiser of nlopt where that is not installed.
    """
    limits = (limits,) if isinstance(limits, Limit) else tuple(limits)
    _check(steps, tolerance, limits)
    optimiser = ("SLSQP" if limits else "L-BFGS-B") if optimiser is None else optimiser
    engine = _engine(optimiser, functools.partial(objective_value, objective), limits)
    together = [read_variables(design0, bounds)] if starts is None else starting_points(design0, bounds, starts)
    asked = trace_problem(objective, together[0], gradient, limits, compile)
    with tqdm(total=steps * len(together), disable=not progress, desc="minimise") as bar:
        options = (tolerance, callback, bar, starts is not None)
        if starts is not None and not isinstance(optimiser, str):
            value, every = functools.partial(objective_value, objective), jit(jax.vmap(asked.alone), compile=compile)
            ended = run_optax_multistart(every, value, together, optimiser, steps, *options[:3])
            return best_optimum([search.optimum() for search in ended])
        limited = isinstance(optimiser, str) and optimiser in _LIMITED

        def searched(variables, first, evaluate):
            """What the search from one design ends with, of what evaluates (x, rows)."""
            if limited:
                search: Search = ConstrainedSearch(asked, evaluate, variables, *options)
            else:
                search = Search(lambda x: evaluate(x, np.zeros(0, np.int32)), variables, *options)
            if check and first:
                check_gradients(search)
            if steps > 0 and not search.reason:
                engine(search, steps)
            return search.optimum()

        if starts is None:
            return searched(together[0], True, jit(asked.run, compile=compile))
        searches = [functools.partial(searched, variables, k == 0) for k, variables in enumerate(together)]
        return best_optimum(run_multistart(searches, asked.run, compile))


def _check(steps, tolerance, limits):
    """Raises: ValueError for steps or a tolerance below zero, and for limits of one name."""
    if isinstance(steps, bool) or not isinstance(steps, int | np.integer) or steps < 0:
        raise ValueError(f"steps is a whole number, zero or more, got {steps!r}")
    if not tolerance >= 0.0:
        raise ValueError(f"tolerance is zero or more, got {tolerance!r}")
    names = [limit.name for limit in limits if isinstance(limit, Limit)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"limits of one name: {', '.join(map(repr, twice))}; give each a name of its own")


_LIMITED = (*SCIPY_OPTIMISERS, *NLOPT_OPTIMISERS)


def _engine(optimiser, objective, limits) -> Callable:
    """What runs a search so many steps."""
    if isinstance(optimiser, str) and optimiser in _LIMITED:
        engine = SCIPY_OPTIMISERS[optimiser] if optimiser in SCIPY_OPTIMISERS else nlopt_optimiser(optimiser)
        return lambda search, steps: run_constrained(search, steps, engine)
    if isinstance(optimiser, str) and optimiser != "L-BFGS-B":
        known = ", ".join(map(repr, ("L-BFGS-B", *_LIMITED)))
        raise ValueError(f"the optimiser {optimiser!r} is not known: take one of {known} or an optax optimiser")
    if not isinstance(optimiser, str | optax.GradientTransformation):
        raise TypeError(
            f"an optimiser is a name such as 'L-BFGS-B' or an optax.GradientTransformation: {optimiser!r}"
        )
    if limits:
        raise ValueError("L-BFGS-B and optax know no limits: take 'SLSQP' (the default) or 'trust-constr'")
    if optimiser == "L-BFGS-B":
        return lbfgsb
    return lambda search, steps: run_optax(search, objective, steps, optimiser)
