"""Trade-offs: how small one aim can be for every value of another."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from ..runtime import jit
from ._constrained import run_constrained, slsqp
from ._limit import Limit
from ._optimisers import lbfgsb
from ._optimum import Optimum
from ._problem import DesignProblem, trace_problem
from ._search import Search
from ._variables import Variables, read_variables
from ._working_set import FEASIBILITY, ConstrainedSearch


class ParetoFront(eqx.Module):
    """Designs of which none is better in both aims.

    Attributes:
        first, second: the aims (points,), the first rising, the second falling: points that others beat in both
            aims are left out.
        designs: a pytree like one design, with a leading axis (points,).
        exchange: (points,) what one unit less of the second aim costs of the first; nan at the ends.
        ok: (points,) whether each search converged.
    """

    first: np.ndarray
    second: np.ndarray
    designs: PyTree
    exchange: np.ndarray
    ok: np.ndarray

    def table(self) -> str:
        """The aims, their exchange and how each search ended, as text."""
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
    compile: str = "full",
) -> ParetoFront:
    """The front of two aims, both to be small: the best of each alone, and between them the first aim under limits
    on the second in equal steps, each search from where its neighbour ended; parts of it that bend inwards are found
    too.

    Args: points: how many, three at least (there are fewer where a search ends in a design that another one beats in
    both aims); the others as of `minimise`.  All searches run one compiled program.

    Raises: ValueError as `minimise`, for fewer than three points, or for an aim that alone has no least value.
    """
    if points < 3:
        raise ValueError(f"a front has three points at least, not {points}")
    limit = Limit("second aim", lambda held: (second(held[0]) - held[1]) / held[2], upper=0.0, scale=1.0)
    outer = (design0, 0.0, 1.0), None if bounds is None else (bounds, None, None)
    asked = trace_problem(lambda held: first(held[0]), read_variables(*outer), gradient, [limit], compile)
    aims = _TwoObjectives(asked, compile, outer)
    with tqdm(total=steps * points, disable=not progress, desc="pareto") as bar:
        ends = aims.ends(steps, tolerance, bar)
        (_, high), (_, low) = (aims.values(end.design[0]) for end in ends)
        span, found, start = high - low, [], ends[0].design[0]
        levels = np.linspace(high, low, points)[1:-1] if span > 1e-12 * (1.0 + abs(high)) else ()  # or no trade-off
        for level in levels:
            for begin in (start, ends[1].design[0]):  # where the limit has no slope there, from the other end
                search = aims.search(begin, level, span, tolerance, bar)
                run_constrained(search, steps, slsqp)
                if search.best.violation <= FEASIBILITY:
                    break
            found.append(search.optimum())
            start = found[-1].design[0]
    every = [ends[0], *found, ends[1]]
    values = np.array([aims.values(optimum.design[0]) for optimum in every])
    exchange = np.array([np.nan, *(-optimum.limits[0].price / span for optimum in found), np.nan])
    kept = _non_dominated(values)
    designs = [every[k].design[0] for k in kept]
    stacked = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *designs)
    first_aim, second_aim = values[kept].T
    return ParetoFront(first_aim, second_aim, stacked, exchange[kept], np.array([every[k].ok for k in kept]))


def _non_dominated(values: np.ndarray) -> list[int]:
    """The points (n, 2) that no other beats in both aims, the first aim rising; of like ones the first."""
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
    """Both aims and their gradients as one compiled program of (design, level, span), and the searches that use it.

    Level and span of the second aim are variables that bounds hold, so that one program serves all levels.
    """

    def __init__(self, asked: DesignProblem, compile: str, outer):
        self._asked, self._run, self._outer = asked, jit(asked.run, compile=compile), outer

    def ends(self, steps: int, tolerance: float, bar) -> list[Optimum]:
        """The best of each aim; of all designs that have it, one where the other aim is best too.

        Raises: ValueError for an aim that has no least value.
        """
        options = steps, tolerance, bar
        alone = [
            self._least(self._outer[0][0], weights, (0.0, 0.0), *options) for weights in ((1.0, 0.0), (0.0, 1.0))
        ]
        for name, end in zip(("first", "second"), alone, strict=True):
            if end.reason.startswith("unbounded"):
                raise ValueError(f"there is no front, the {name} aim alone has no least value: {end.reason}")
        values = np.array([self.values(end.design[0]) for end in alone])
        span = np.abs(values[0] - values[1])
        if not np.all(span > 0.0):
            return alone
        for which, end in enumerate(alone):
            weights = np.where(np.arange(2) == which, 1.0, _TIE_WEIGHT) / span
            both = self._least(end.design[0], weights, values[which], *options)
            if self.values(both.design[0])[which] <= values[which, which] + _TIE_LOSS * span[which]:
                alone[which] = dataclasses.replace(end, design=both.design)
        return alone

    def _least(self, start: PyTree, weights, origin, steps: int, tolerance: float, bar) -> Optimum:
        """The least weighted sum of both aims, counted from their values at the origin."""

        def weighted(x):
            value, slopes, excess, rows, _ = self._run(x, _ONLY_CONSTRAINT)
            sums = weights[0] * (value - origin[0]) + weights[1] * (excess[0] - origin[1])
            return sums, weights[0] * slopes + weights[1] * rows[0], (), (), ()

        search = Search(weighted, self._held(start, 0.0, 1.0), tolerance, None, bar)
        if steps > 0 and not search.reason:
            lbfgsb(search, steps)
        return search.optimum()

    def values(self, design: PyTree) -> tuple[float, float]:
        """Both aims of a design."""
        variables = self._held(design, 0.0, 1.0)
        value, _, excess, *_ = self._run(variables.vector(variables.start), _ONLY_CONSTRAINT)
        return float(value), float(excess[0])

    def search(self, begin: PyTree, level: float, span: float, tolerance: float, bar) -> ConstrainedSearch:
        """Of the first aim where the second is a level at most."""
        return ConstrainedSearch(self._asked, self._run, self._held(begin, level, span), tolerance, None, bar)

    def _held(self, design, level, span) -> Variables:
        variables = read_variables(*self._outer)
        x = np.concatenate([*(np.ravel(np.asarray(leaf)) for leaf in jax.tree.leaves(design)), [level, span]])
        lower, upper, scale = (part.copy() for part in variables[2:5])
        lower[-2:] = upper[-2:] = x[-2:]
        scale[-2:] = 1.0
        names = tuple(name.partition(".")[2] or "design" for name in variables.names)
        return Variables(names, np.clip(x, lower, upper), lower, upper, scale, variables.unravel)


_TIE_WEIGHT = 1e-7  # weight of the other aim at an end of the front, both over their spans
_TIE_LOSS = 1e-5  # what an end may lose by it
_ONLY_CONSTRAINT = np.zeros(1, np.int32)  # the one limit
