"""`interior_point`: minima under equations, inequalities and bounds, as a pure function."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree

from ..checks import as_flag, count_faults, is_concrete, number_faults, require_reals
from ..errors import ModelError
from ..quantities import Axis, Quantity, entries
from ..reports import Report, Reported, failures
from ..runtime import jit, not_tracing
from ._barrier_problem import BarrierProblem
from ._barrier_search import (
    CONVERGED,
    REASONS,
    STEP_LIMIT,
    BarrierSolution,
    SearchState,
    barrier_search,
    first_iterate,
    first_state,
)
from ._optimum import History
from ._variables import bounds_by_leaf

_FIRST_MU, _WARM_MU = 0.1, 1e-5


class InteriorPoint(Reported, eqx.Module):
    """A minimum, or many with a leading axis of designs.

    Attributes:
        design: the best design, like the first one; value: its objective.
        equalities: (p,) multipliers of the equations: change of the objective if the right side of `e(x) = 0` falls
            by one unit.
        inequalities: (m,) multipliers, not negative, of `c(x) <= 0`; lower, upper: (n,) of the bounds,
            zero of variables whose bounds are equal.
        violation: largest violation of equations and inequalities; residual: of the KKT conditions.  Both are scaled
            as for `tolerance`.
        steps, evaluations: steps taken, and evaluations of the functions.
        reason: number of the entry of `InteriorPoint.reasons` that says why it ended.
        history: of the steps if asked: objective, residual of the KKT conditions and evaluations (..., steps + 1),
            nan after the end of a search.

    Of these `design`, `value` and the multipliers have derivatives by all numbers of the problem.
    """

    design: PyTree
    value: Array
    equalities: Array
    inequalities: Array
    lower: Array
    upper: Array
    violation: Array
    residual: Array
    steps: Array
    evaluations: Array
    reason: Array
    _at: Any
    _search: Any
    history: History | None = None

    reasons = REASONS

    @property
    def ok(self) -> Array:
        """True where the search converged."""
        return self.reason == CONVERGED

    @property
    def active(self) -> Array:
        """True (..., m) for inequalities that hold the optimum: their multiplier is larger than their slack."""
        return self._at.z > self._at.s

    def report(self) -> Report:
        shape = jnp.shape(self.value)
        axes = tuple(Axis("design", range(n)) for n in shape)
        found = [Quantity("objective", self.value, "", axes)]
        for path, leaf in jax.tree_util.tree_leaves_with_path(self.design):
            name = jax.tree_util.keystr(path, simple=True, separator=" ") or "design"
            found.append(entries(name, leaf, "", axes))
        for name in ("inequalities", "equalities"):
            if jnp.shape(getattr(self, name))[-1]:
                found.append(entries(f"multiplier of {name}", getattr(self, name), "", axes))
        found += [Quantity("steps", self.steps, "", axes), Quantity("residual", self.residual, "", axes)]
        numbers = np.unique(np.asarray(self.reason))
        ended = "; ".join(REASONS[k] for k in numbers if k != CONVERGED)
        ended = f"searches did not converge: {ended}" if shape else ended
        return Report(found, "", failures(self.ok, ended))


def interior_point(
    objective: Callable[[PyTree], Any],
    design0: PyTree,
    bounds: PyTree | None = None,
    equalities: Callable[[PyTree], Any] | None = None,
    inequalities: Callable[[PyTree], Any] | None = None,
    hessian: str = "exact",
    tolerance: float = 1e-8,
    steps: int = 200,
    gradient: str = "reverse",
    warm: InteriorPoint | None = None,
    compile: str = "auto",
    history: bool = False,
) -> InteriorPoint:
    """Minimise by a primal-dual interior-point method, all of it in JAX.

    It is a pure function of all numbers in it: `jax.vmap` or `mbs.batch` of it optimise thousands of designs side by
    side, each with its own verdict, and `jax.grad` or `jax.jacfwd` differentiate optima by what the functions close
    over, by the implicit function theorem.  The derivatives are those of the limits that are active.

    Args:
        objective: of a design to a number.
        design0: first design, a pytree of numbers and arrays.
        bounds: as of `minimise`.
        equalities: of a design to numbers, or a pytree of them, that are to be zero.
        inequalities: of a design to numbers that are to be zero or less; `load / allowed - 1` has a good scale.
        hessian: "exact", by second derivatives of the functions, or "bfgs", for motions and whatever has first ones:
            a saddle is told by second ones alone.
        tolerance: of the KKT conditions, where gradients at the start are at most a hundred, and the objective, the
            equations and the inequalities are not all below 1e-2 with theirs.
        steps: at most.
        gradient: "reverse" or "forward" mode.
        warm: result of a problem nearby, of which multipliers and curvature serve as well; `design0` is the start
            still.  With the design of a search that ended at its limit of steps it goes on.
        compile: as of `minimise`; in a program of yours it is a part of that.
        history: record the steps.

    Raises: TypeError, ValueError, ModelError for what is none of these.

    Source: Waechter and Biegler 2006, On the implementation of an interior-point filter line-search algorithm for
    large-scale nonlinear programming; here steps are judged by a merit function.
    """
    check_options(hessian, gradient, tolerance, steps)
    has_history = as_flag("history", history)
    x0, lower, upper, unravel = flat_variables(design0, bounds)
    functions = lambda x: values_of(objective, equalities, inequalities, unravel(x))
    exact, reverse = hessian == "exact", gradient == "reverse"

    def solve(x0, lower, upper, at):
        problem = barrier_problem(functions, lower, upper, exact, reverse, at is not None, has_history)
        first = first_search(problem, x0, at)
        return barrier_search(problem, jax.lax.stop_gradient(first), tolerance, steps)

    at = None if warm is None else (warm._at, warm._search)
    if not_tracing() and is_concrete(x0, lower, upper, at):
        solve = jit(solve, compile=compile)
    return optimum_of(solve(x0, lower, upper, at), unravel)


def optimum_of(found: BarrierSolution, unravel: Callable) -> InteriorPoint:
    """The end of a search in the units of its functions."""
    (unit, of_equations, of_inequalities), at = found.factors, found.at
    history = History(*(found.history[..., k] for k in range(3))) if len(found.history) else None
    return InteriorPoint(
        unravel(at.x), found.value, at.y * of_equations / unit, at.z * of_inequalities / unit, at.low / unit,
        at.high / unit, found.violation, found.residual, found.steps, found.evaluations, found.reason, at,
        found.search, history,
    )  # fmt: skip


def values_of(objective: Callable, equalities: Callable | None, inequalities: Callable | None, design: PyTree):
    """(objective (), equalities (p,), inequalities (m,)) of a design."""
    value = jnp.asarray(objective(design), float)
    if value.ndim:
        raise ValueError(f"the objective must be one number, it has shape {value.shape}")
    return value, _flat(equalities, design), _flat(inequalities, design)


def barrier_problem(
    functions: Callable,
    lower: Array,
    upper: Array,
    exact: bool,
    reverse: bool,
    is_warm: bool,
    has_history: bool = False,
) -> BarrierProblem:
    """The problem of functions of variables (n,)."""
    converted = eqx.filter_closure_convert(functions, lower)
    return BarrierProblem(converted, lower, upper, exact, reverse, "steepest", is_warm, has_history)


def first_search(problem: BarrierProblem, x0: Array, warm: tuple | None) -> SearchState:
    """A search that begins at x0, or from (unknowns, search) of one nearby, or goes on with that."""
    start = jnp.clip(x0, problem.lower, problem.upper)
    if warm is None:
        return first_state(problem, first_iterate(problem, start, None), None, _FIRST_MU)
    at, search = warm
    first = first_state(problem, first_iterate(problem, start, at), search.W / search.factors[0], _WARM_MU)
    goes_on = (search.reason == STEP_LIMIT) & jnp.all(x0 == at.x)
    return jax.tree.map(lambda a, b: jnp.where(goes_on, a, b), search, first)


def _flat(function, design):
    """Numbers of a function of a design as one vector; none without a function."""
    if function is None:
        return jnp.zeros(0)
    return jnp.asarray(ravel_pytree(function(design))[0], float)


def flat_variables(design0: PyTree, bounds: PyTree | None) -> tuple[Array, Array, Array, Callable]:
    """First design, lower and upper bounds (n,), and the function back to a pytree."""
    require_reals((design0, bounds))
    leaves, structure = jax.tree.flatten(design0)
    if not leaves:
        raise ValueError("design0 has no variables")
    x0, unravel = ravel_pytree(jax.tree.map(lambda leaf: jnp.asarray(leaf, float), design0))
    if is_concrete(x0) and not np.all(np.isfinite(np.asarray(x0))):
        raise ValueError(f"design0 must be finite numbers, not {design0}")
    ends = []
    for pair in bounds_by_leaf(design0, structure, bounds):
        pair = (None, None) if pair is None else pair
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise ValueError(f"bounds must be (lower, upper) or None, not {pair!r}")
        default = (-jnp.inf, jnp.inf)
        ends.append([jnp.asarray(d if x is None else x, float) for x, d in zip(pair, default, strict=True)])
    rows = list(zip(leaves, ends, strict=True))
    over = lambda side: [jnp.broadcast_to(pair[side], jnp.shape(leaf)).ravel() for leaf, pair in rows]
    lower, upper = (jnp.concatenate(over(side)) for side in (0, 1))
    if is_concrete(lower, upper) and not np.all(np.asarray(lower) <= np.asarray(upper)):
        raise ValueError("the bounds cross: a lower one is above its upper one")
    return x0, lower, upper, unravel


def check_options(hessian: str, gradient: str, tolerance: float, steps: int) -> None:
    """Raises: ModelError for options that do not exist or make no sense."""
    faults = count_faults("steps", steps, 1) + number_faults("tolerance", tolerance, positive=True)
    for what, value, known in (
        ("hessian", hessian, ("exact", "bfgs")),
        ("gradient", gradient, ("reverse", "forward")),
    ):
        if value not in known:
            faults.append(f"{what} must be {' or '.join(map(repr, known))}, not {value!r}")
    if faults:
        raise ModelError(faults, "the question")
