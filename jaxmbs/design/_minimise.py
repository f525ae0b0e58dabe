"""`minimise`: a bounded design under limits, by optimisers of SciPy, nlopt and optax."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
import optax
from jaxtyping import PyTree
from tqdm import tqdm

from ..batching._batch import batch
from ..checks import as_flag, check_count, repeated
from ..errors import SearchError
from ..runtime import jit, kept_tiers, step_bar
from ._barrier_optimiser import from_end, interior_point_search, interior_points
from ._bound_formulation import at_largest, bound_formulation, with_bound, without_bound
from ._chance_verdict import judge_chances
from ._constrained import NLOPT_OPTIMISERS, SCIPY_OPTIMISERS, nlopt_optimiser, run_constrained
from ._gradient_check import check_gradients
from ._limit import Limit
from ._multistart import run_multistart
from ._optimisers import lbfgsb, run_optax
from ._optimum import Optimum
from ._problem import DesignProblem, objective_value, trace_problem
from ._saddle import SADDLE, lower_point
from ._search import Search
from ._starts import best_optimum, run_optax_multistart, starting_points
from ._variables import Variables, read_variables
from ._verdict import judge
from ._working_set import ConstrainedSearch, first_working_set
from ._worst import Worst


@kept_tiers()
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
    compile: str = "auto",
) -> Optimum:
    """Minimise an objective subject to bounds and limits; non-finite trials are retried nearer, the best design kept.

    Args:
        objective: function of a design like `design0` that returns a real scalar, or one and a dict of answers for
            `limits`; it is traced.  The largest of many numbers is `Worst(function)`: as a maximum it has kinks, at
            which a search ends without being `ok`.
        design0: first design, any pytree of numbers and arrays, typically a dict.
        bounds: None, or a pytree like `design0` with (lower, upper) or None for each leaf; numbers, arrays or None.
        optimiser: "L-BFGS-B" (default; no limits), "SLSQP" (default with limits), "trust-constr", "MMA" or "CCSAQ"
            (of nlopt), "interior point" (all steps in one program, one step of the history), or an optax optimiser in
            the design's units (no limits), projected on the bounds after each update.
        steps: largest number of steps.
        tolerance: relative to the larger of the objective and the first gradient norm (`History`; with limits the KKT
            residual): where the norm is below, the search has converged; for L-BFGS-B also where a step lowers the
            objective by less than `tolerance` of itself; a stalled constrained search passes with 100 `tolerance`.
        gradient: "reverse" mode, or "forward" for few variables and simulations that only run forward.
        progress: show a progress bar.
        callback: called after each step with (step, design, objective); a true result stops the search.
        starts: number of first designs, searched in one program: `design0` and Sobol points between the bounds; or
            "stacked" where `design0` has a leading axis of designs.  Starts without finite objective are left out.
        limits: constraints.  Satisfied to 1e-7 of each; else the result is the design with the least violation.
            Those with a probability are confirmed by samples at the end, or the result is not `ok`.
        check: compare the gradients with finite differences at the first design: two evaluations a variable.
        compile: "auto": without a compiler; where a search was long, the next one compiles beside its evaluations,
            and those after it run what is compiled: none changes within.  "tape", "quick" or "full", as of
            `mbs.jit`, where results are to be the same to the last bit.

    Returns: the best design found, history and tables; with `starts` that of the best, and all in `Optimum.starts`.

    Raises: TypeError, ValueError naming the variable, limit or option at fault; ImportError without nlopt.
    """
    limits = (limits,) if isinstance(limits, Limit) else tuple(limits)
    _check(steps, tolerance, limits)
    judged = functools.partial(judge_chances, limits=limits, compile=compile)
    if is_worst := isinstance(objective, Worst):
        objective, limits = bound_formulation(objective, limits)
        _check(steps, tolerance, limits)
        callback = callback and _of_design(callback)
    optimiser = ("SLSQP" if limits else "L-BFGS-B") if optimiser is None else optimiser
    run = _runner(optimiser, functools.partial(objective_value, objective), limits, compile)
    points = [read_variables(design0, bounds)] if starts is None else starting_points(design0, bounds, starts)
    points = [with_bound(point) for point in points] if is_worst else points
    problem = trace_problem(objective, points[0], gradient, limits, compile, tape_first=starts is None)
    with step_bar(steps * len(points), "minimise", is_wanted=as_flag("progress", progress)) as bar:
        options = _Options(steps, tolerance, callback, bar, starts is not None, check, compile, is_worst)
        if starts is not None and not isinstance(optimiser, str):
            return _optax_multistart(problem, objective, points, optimiser, options)
        is_constrained = isinstance(optimiser, str) and optimiser in _CONSTRAINED
        search = functools.partial(_search, problem, run, is_constrained)
        if starts is None:
            # small programs where `compile` says so; where they are compiled, optimised: a search runs them often
            how = "auto" if compile == "quick" else compile
            evaluate, values = (jit(f, compile=how) for f in (problem.evaluate, problem.evaluate_values))
            return judged(search(options, points[0], evaluate, values))
        checks = [options, *[options._replace(check=False)] * (len(points) - 1)]  # gradients are checked once
        searches = [functools.partial(search, *pair) for pair in zip(checks, points, strict=True)]
        if optimiser == _INTERIOR_POINT and steps > 0:
            begun = _at_largest_together(problem, points, compile) if is_worst else points
            runs = map(from_end, interior_points(problem, begun, tolerance, steps, compile))
            rows = zip(runs, checks, points, strict=True)
            searches = [functools.partial(_search, problem, run, True, one, point) for run, one, point in rows]
        return judged(best_optimum(run_multistart(searches, problem.evaluate, compile)))


class _Options(NamedTuple):
    """Options of one search, as of `minimise`; may_fail: a start without finite values is no error; is_worst: the
    last two variables are the bound of the largest number and its unit."""

    steps: int
    tolerance: float
    callback: Callable[[int, PyTree, float], Any] | None
    bar: tqdm
    may_fail: bool
    check: bool
    compile: str
    is_worst: bool


def _search(
    problem: DesignProblem,
    run: Callable[[Search, int], None],
    constrained: bool,
    options: _Options,
    variables: Variables,
    evaluate: Callable,
    evaluate_values: Callable | None = None,
) -> Optimum:
    """Search from one first design with an evaluator of (x, rows), and one of x for values alone."""
    if options.is_worst:
        rows = first_working_set(problem, variables)
        numbers = evaluate(variables.clip(variables.start), rows)[-1][0]
        variables = at_largest(variables, np.asarray(numbers))
    settings = (options.tolerance, options.callback, options.bar, options.may_fail, evaluate_values)
    if constrained:
        search: Search = ConstrainedSearch(problem, evaluate, variables, *settings)
    else:
        search = Search(lambda x: evaluate(x, np.zeros(0, np.int32)), variables, *settings)
    if options.check:
        check_gradients(search)
    optimum = lambda: without_bound(search.optimum()) if options.is_worst else search.optimum()
    try:
        if options.steps > 0 and not search.reason:
            run(search, options.steps)
        _leave_saddles(search, run, options.steps)
    except KeyboardInterrupt as error:
        search.reason = "interrupted"
        raise SearchError(f"the search was interrupted after {search.steps} steps", optimum()) from error
    judge(search)
    return optimum()


def _leave_saddles(search: Search, run: Callable[[Search, int], None], steps: int) -> None:
    """Go on beside saddles and maxima at which a search converged, or say so where no steps are left."""
    for count in range(_SADDLES + 1):
        beside = lower_point(search)
        if beside is None:
            return
        if count == _SADDLES or search.steps + 1 >= steps:
            search.reason = SADDLE
            return
        search.begin_at(beside)
        run(search, steps - search.steps)


_SADDLES = 3  # that a search leaves at most


def _at_largest_together(problem: DesignProblem, points: list[Variables], compile: str) -> list[Variables]:
    """Variables whose bounds begin at the largest of the numbers at their starts, which one batch evaluates."""
    starts = np.stack([np.asarray(point.clip(point.start)) for point in points])
    numbers = batch(lambda x: problem.evaluate_values(x)[-1][0], starts, progress=False, compile=compile).values
    return [at_largest(*pair) for pair in zip(points, np.asarray(numbers), strict=True)]


def _of_design(callback: Callable[[int, PyTree, float], Any]) -> Callable[[int, PyTree, float], Any]:
    """The callback of (step, design, objective) where a design has its bound and unit beside it."""
    return lambda step, x, value: callback(step, x[0], value * float(x[2]))


def _optax_multistart(
    problem: DesignProblem,
    objective: Callable,
    points: list[Variables],
    optimiser: optax.GradientTransformation,
    options: _Options,
) -> Optimum:
    """Search from many first designs by an optax optimiser, all of them in step."""
    evaluate = jit(jax.vmap(problem.evaluate_objective), compile=options.compile)
    value = functools.partial(objective_value, objective)
    searches = run_optax_multistart(evaluate, value, points, optimiser, *options[:4])
    for search in searches:
        judge(search, kinks=False)
    return best_optimum([search.optimum() for search in searches])


def _check(steps: int, tolerance: float, limits: Sequence[Limit]) -> None:
    """Raises: ValueError for steps or a tolerance below zero, and for limits of one name."""
    check_count("steps", steps)
    if not tolerance >= 0.0:
        raise ValueError(f"tolerance must be zero or more, got {tolerance!r}")
    names = [limit.name for limit in limits if isinstance(limit, Limit)]
    twice = repeated(names)
    if twice:
        raise ValueError(f"several limits are named {', '.join(map(repr, twice))}; give each a name of its own")


_INTERIOR_POINT = "interior point"
_CONSTRAINED = (*SCIPY_OPTIMISERS, *NLOPT_OPTIMISERS, _INTERIOR_POINT)


def _runner(
    optimiser: optax.GradientTransformation | str, objective: Callable, limits: Sequence[Limit], compile: str
) -> Callable[[Any, int], None]:
    """The function that runs a search for a number of steps."""
    if isinstance(optimiser, str) and optimiser == _INTERIOR_POINT:
        step = functools.partial(interior_point_search, compile=compile)
        return lambda search, steps: run_constrained(search, steps, step)
    if isinstance(optimiser, str) and optimiser in _CONSTRAINED:
        step = SCIPY_OPTIMISERS[optimiser] if optimiser in SCIPY_OPTIMISERS else nlopt_optimiser(optimiser)
        return lambda search, steps: run_constrained(search, steps, step)
    if isinstance(optimiser, str) and optimiser != "L-BFGS-B":
        known = ", ".join(map(repr, ("L-BFGS-B", *_CONSTRAINED)))
        raise ValueError(f"unknown optimiser {optimiser!r}: choose one of {known} or an optax optimiser")
    if not isinstance(optimiser, str | optax.GradientTransformation):
        raise TypeError(
            f"optimiser must be a name such as 'L-BFGS-B' or an optax.GradientTransformation, not {optimiser!r}"
        )
    if limits:
        raise ValueError(
            "L-BFGS-B and optax do not support limits, nor design.Worst: choose 'SLSQP' (the default with limits) or "
            "'trust-constr'"
        )
    if optimiser == "L-BFGS-B":
        return lbfgsb
    return lambda search, steps: run_optax(search, objective, steps, optimiser)
