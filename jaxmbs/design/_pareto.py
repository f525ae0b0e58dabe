"""Pareto front of two objectives by the epsilon-constraint method, from its ends found by weighted sums."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from ..checks import as_flag
from ..quantities import Axis, Quantity, entries
from ..reports import Report, Reported, failures
from ..runtime import jit, step_bar
from ._barrier_optimiser import interior_points
from ._constrained import run_constrained, slsqp
from ._limit import Limit
from ._optimisers import lbfgsb
from ._optimum import Optimum
from ._problem import DesignProblem, trace_problem
from ._search import Search
from ._variables import Variables, read_variables
from ._verdict import judge
from ._working_set import FEASIBILITY, ConstrainedSearch
from ._worst import Worst


class ParetoFront(Reported, eqx.Module):
    """Pareto-optimal designs: none is better in both objectives.

    Attributes:
        first, second: the objectives (points,), the first ascending, the second descending: dominated points are left
            out.
        designs: a pytree like one design, with a leading axis (points,).
        exchange: (points,) trade-off rate: cost in the first objective of one unit less of the second; nan at the
            ends, and where the search did not converge.
        ok: (points,) True where the search converged.
        names: of the two objectives (static).
    """

    first: np.ndarray
    second: np.ndarray
    designs: PyTree
    exchange: np.ndarray
    ok: np.ndarray
    names: tuple[str, str] = eqx.field(static=True, default=("first objective", "second objective"))

    def report(self) -> Report:
        point = Axis("point", np.arange(len(self.first)))
        objectives = {"first": self.first, "second": self.second, "exchange": self.exchange, "converged": self.ok}
        variables = [
            entries(f"design {jax.tree_util.keystr(path, simple=True, separator=' ')}", leaf, "", (point,))
            for path, leaf in jax.tree_util.tree_leaves_with_path(self.designs)
        ]
        found = [Quantity(name, values, "", (point,)) for name, values in objectives.items()]
        return Report(
            [*found, *variables], f"{len(self.first)} designs", failures(self.ok, "searches did not converge")
        )

    def table(self) -> str:
        """Table of the objectives, their trade-off rate, and a mark for searches that did not converge."""
        lines = [f"{'first':>14}{'second':>14}{'exchange':>14}"]
        for a, b, rate, ok in zip(self.first, self.second, self.exchange, self.ok, strict=True):
            lines.append(f"{a:14.6g}{b:14.6g}{rate:14.4g}" + ("" if ok else "  not converged"))
        return "\n".join(lines)


def pareto(
    first: Callable[[PyTree], Any],
    second: Callable[[PyTree], Any],
    design0: PyTree,
    bounds: PyTree | None = None,
    points: int = 9,
    steps: int = 200,
    tolerance: float = 1e-8,
    gradient: str = "reverse",
    progress: bool = True,
    compile: str = "auto",
) -> ParetoFront:
    """Find the Pareto front of two objectives, both to be minimised.

    Its ends are the minimum of each objective alone.  Between them the first one is minimised subject to limits on
    the second in equal steps (epsilon-constraint method), each search from the result of its neighbour; non-convex
    parts of the front are found too.  All searches run one compiled program.

    Args: points: their number, at least three (fewer are returned where a search ends in a dominated design); the
    others as of `minimise`.  The objectives have the names of their functions in pictures.

    Raises: TypeError for a `Worst`; ValueError as `minimise`, for fewer than three points, or for an objective that
    has no minimum alone.
    """
    if isinstance(first, Worst) or isinstance(second, Worst):
        raise TypeError(
            "a Pareto front takes smooth objectives, not design.Worst: minimise the one under a Limit on the other, "
            "level by level"
        )
    if points < 3:
        raise ValueError(f"a Pareto front needs at least three points, not {points}")
    limit = Limit("second objective", lambda x: (second(x[0]) - x[1]) / x[2], upper=0.0, scale=1.0)
    outer = (design0, 0.0, 1.0), None if bounds is None else (bounds, None, None)
    problem = trace_problem(lambda x: first(x[0]), read_variables(*outer), gradient, [limit], compile)
    objectives = _TwoObjectives(problem, compile, outer)
    with step_bar(steps * points, "pareto", is_wanted=as_flag("progress", progress)) as bar:
        ends = objectives.ends(steps, tolerance, bar)
        (_, high), (_, low) = (objectives.values(end.design[0]) for end in ends)
        span, found, start = high - low, [], ends[0].design[0]
        levels = (
            np.linspace(high, low, points)[1:-1] if span > 1e-12 * (1.0 + abs(high)) else ()
        )  # else there is no trade-off
        begun = objectives.side_by_side([end.design[0] for end in ends], levels, span, steps, tolerance)
        for level, end in zip(levels, begun, strict=True):
            # where a search of the batch did not end, its neighbour is the next start, then the other end
            for begin in (end, start, ends[1].design[0]):
                search = objectives.search(begin, level, span, tolerance, bar)
                if not search.reason and search.is_optimal(tolerance):
                    search.reason = "converged"
                run_constrained(search, steps, slsqp)
                judge(search)
                if search.best.violation <= FEASIBILITY:
                    break
            found.append(search.optimum())
            start = found[-1].design[0]
    every = [ends[0], *found, ends[1]]
    values = np.array([objectives.values(optimum.design[0]) for optimum in every])
    rates = [-optimum.limits[0].price / span if optimum.ok else np.nan for optimum in found]
    exchange = np.array([np.nan, *rates, np.nan])
    kept = _non_dominated(values)
    designs = [every[k].design[0] for k in kept]
    stacked = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *designs)
    first_values, second_values = values[kept].T
    ok, names = np.array([every[k].ok for k in kept]), (_name(first, "first"), _name(second, "second"))
    return ParetoFront(first_values, second_values, stacked, exchange[kept], ok, names)


def _name(objective, place) -> str:
    """Name of a function, or of its place if it has none."""
    name = getattr(objective, "__name__", "<lambda>")
    return f"{place} objective" if name == "<lambda>" else name.replace("_", " ")


def _non_dominated(values: np.ndarray) -> list[int]:
    """Indices of the non-dominated points among (n, 2), the first objective ascending; of equal ones the first."""
    kept: list[int] = []
    close = 1e-9 * np.ptp(values, axis=0) + 1e-12 * (1.0 + np.max(np.abs(values), axis=0))
    for k in np.lexsort((values[:, 1], values[:, 0])):
        if kept and values[k, 1] >= values[kept[-1], 1] - close[1]:
            continue
        while kept and values[k, 0] <= values[kept[-1], 0] + close[0]:
            kept.pop()
        kept.append(int(k))
    return kept


class _TwoObjectives:
    """Both objectives and their gradients as one compiled program of (design, level, span), and searches that use it.

    Level and span of the second objective are variables that their bounds fix, so that one program serves all levels.
    """

    def __init__(self, problem: DesignProblem, compile: str, outer: tuple) -> None:
        self._problem, self._evaluate, self._outer = problem, jit(problem.evaluate, compile=compile), outer
        self._compile, self._outer_variables = compile, read_variables(*outer)

    def ends(self, steps: int, tolerance: float, bar: tqdm) -> list[Optimum]:
        """The minimum of each objective; of all designs that reach it, one with the best other objective.

        Raises: ValueError for an objective that has no minimum.
        """
        options = steps, tolerance, bar
        alone = [
            self._minimise_sum(self._outer[0][0], weights, (0.0, 0.0), *options)
            for weights in ((1.0, 0.0), (0.0, 1.0))
        ]
        for name, end in zip(("first", "second"), alone, strict=True):
            if end.reason.startswith("unbounded"):
                raise ValueError(f"there is no Pareto front, the {name} objective has no minimum: {end.reason}")
        values = np.array([self.values(end.design[0]) for end in alone])
        span = np.abs(values[0] - values[1])
        if not np.all(span > 0.0):
            return alone
        for which, end in enumerate(alone):
            weights = np.where(np.arange(2) == which, 1.0, _TIE_WEIGHT) / span
            both = self._minimise_sum(end.design[0], weights, values[which], *options)
            if self.values(both.design[0])[which] <= values[which, which] + _TIE_LOSS * span[which]:
                alone[which] = dataclasses.replace(end, design=both.design)
        return alone

    def _minimise_sum(
        self, start: PyTree, weights: Any, origin: Any, steps: int, tolerance: float, bar: tqdm
    ) -> Optimum:
        """Minimise the weighted sum of both objectives less their values at the origin."""

        def weighted(x):
            value, gradient, constraints, jacobian, values = self._evaluate(x, _ONLY_CONSTRAINT)
            sums = weights[0] * (value - origin[0]) + weights[1] * (constraints[0] - origin[1])
            return sums, weights[0] * gradient + weights[1] * jacobian[0], (), (), values[-1:]

        search = Search(weighted, self._variables(start, 0.0, 1.0), tolerance, None, bar)
        if steps > 0 and not search.reason:
            lbfgsb(search, steps)
        judge(search)
        return search.optimum()

    def values(self, design: PyTree) -> tuple[float, float]:
        """Both objectives of a design."""
        variables = self._variables(design, 0.0, 1.0)
        value, _, constraints, *_ = self._evaluate(variables.clip(variables.start), _ONLY_CONSTRAINT)
        return float(value), float(constraints[0])

    def side_by_side(self, ends: list, levels: Any, span: float, steps: int, tolerance: float) -> list[PyTree]:
        """Designs with the least first objective at levels of the second, of searches from between both ends."""
        if not len(levels):
            return []
        shares = np.linspace(0.0, 1.0, len(levels) + 2)[1:-1]
        between = [
            jax.tree.map(lambda a, b, s=s: (1.0 - s) * np.asarray(a) + s * np.asarray(b), *ends) for s in shares
        ]
        if steps < 1:
            return between
        points = [self._variables(x, level, span) for x, level in zip(between, levels, strict=True)]
        found = interior_points(self._problem, points, tolerance, steps, self._compile)
        return [self._outer_variables.unravel(jnp.asarray(x))[0] for x, _ in found]

    def search(self, begin: PyTree, level: float, span: float, tolerance: float, bar: tqdm) -> ConstrainedSearch:
        """Search for the minimum of the first objective where the second is at most a level."""
        return ConstrainedSearch(
            self._problem, self._evaluate, self._variables(begin, level, span), tolerance, None, bar
        )

    def _variables(self, design: PyTree, level: float, span: float) -> Variables:
        """Variables (design, level, span) of which the last two are fixed by their bounds."""
        variables = self._outer_variables
        x = np.concatenate([*(np.ravel(np.asarray(leaf)) for leaf in jax.tree.leaves(design)), [level, span]])
        lower, upper, scale = (part.copy() for part in variables[2:5])
        lower[-2:] = upper[-2:] = x[-2:]
        scale[-2:] = 1.0
        names = tuple(name.partition(".")[2] or "design" for name in variables.names)
        return Variables(names, np.clip(x, lower, upper), lower, upper, scale, variables.unravel)


#: Weight of the other objective at an end of the front, both over their spans: it decides between designs of equal
#: first objective, and is small enough not to move a minimum by more than the loss allowed below.
_TIE_WEIGHT = 1e-7
#: Share of its span that an objective may lose at its end by that; more means that the design was not equal.
_TIE_LOSS = 1e-5
#: The working set of these searches: the one constraint.
_ONLY_CONSTRAINT = np.zeros(1, np.int32)
