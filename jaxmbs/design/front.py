"""Trade-offs: how small one aim can be for every value of another."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from jaxmbs.design.constrained import run_limited, slsqp
from jaxmbs.design.drivers import lbfgsb
from jaxmbs.design.limit import Limit
from jaxmbs.design.limited import KEPT, LimitedSearch
from jaxmbs.design.optimum import Optimum
from jaxmbs.design.program import Program, program
from jaxmbs.design.search import Search
from jaxmbs.design.variables import Variables, read_variables
from jaxmbs.math.jit import jit


class Front(eqx.Module):
    """Designs of which none is better in both aims.

    Attributes:
        first, second: the aims (points,), the first rising, the second falling.
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
) -> Front:
    """The front of two aims, both to be small: the best of each alone, and between them the first aim under limits
    on the second in equal steps, each search from where its neighbour ended; parts of it that bend inwards are found
    too.

    Args: points: how many, three at least; the others as of `minimise`.  All searches run one compiled program.

    Raises: ValueError as `minimise`, or for fewer than three points.
    """
    if points < 3:
        raise ValueError(f"a front has three points at least, not {points}")
    limit = Limit("second aim", lambda held: (second(held[0]) - held[1]) / held[2], upper=0.0, scale=1.0)
    outer = (design0, 0.0, 1.0), None if bounds is None else (bounds, None, None)
    asked = program(lambda held: first(held[0]), read_variables(*outer), gradient, [limit], compile)
    aims = _Aims(asked, compile, outer)
    with tqdm(total=steps * points, disable=not progress, desc="pareto") as bar:
        ends = [aims.alone(which, steps, tolerance, bar) for which in (0, 1)]
        (_, high), (_, low) = (aims.values(end.design[0]) for end in ends)
        span = max(high - low, 1e-12 * (1.0 + abs(high)))
        found, start = [], ends[0].design[0]
        for level in np.linspace(high, low, points)[1:-1]:
            for begin in (start, ends[1].design[0]):  # where the limit has no slope there, from the other end
                search = aims.search(begin, level, span, tolerance, bar)
                run_limited(search, steps, slsqp)
                if search.best.violation <= KEPT:
                    break
            found.append(search.optimum())
            start = found[-1].design[0]
    every = [ends[0], *found, ends[1]]
    values = np.array([aims.values(optimum.design[0]) for optimum in every])
    exchange = [np.nan, *(-optimum.limits[0].price / span for optimum in found), np.nan]
    designs = [optimum.design[0] for optimum in every]
    stacked = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *designs)
    return Front(values[:, 0], values[:, 1], stacked, np.array(exchange), np.array([optimum.ok for optimum in every]))


class _Aims:
    """Both aims and their gradients as one compiled program of (design, level, span), and the searches that use it.

    Level and span of the second aim are variables that bounds hold, so that one program serves all levels.
    """

    def __init__(self, asked: Program, compile: str, outer):
        self._asked, self._run, self._outer = asked, jit(asked.run, compile=compile), outer

    def alone(self, which: int, steps: int, tolerance: float, bar) -> Optimum:
        """The best of one aim."""
        first = Search(lambda x: self._alone(x, which), self._held(self._outer[0][0], 0.0, 1.0), tolerance, None, bar)
        if steps > 0 and not first.reason:
            lbfgsb(first, steps)
        return first.optimum()

    def _alone(self, x, which):
        value, slopes, excess, rows, _ = self._run(x, _ROW)
        return (value, slopes, (), (), ()) if which == 0 else (excess[0], rows[0], (), (), ())

    def values(self, design: PyTree) -> tuple[float, float]:
        """Both aims of a design."""
        variables = self._held(design, 0.0, 1.0)
        value, _, excess, *_ = self._run(variables.vector(variables.start), _ROW)
        return float(value), float(excess[0])

    def search(self, begin: PyTree, level: float, span: float, tolerance: float, bar) -> LimitedSearch:
        """Of the first aim where the second is a level at most."""
        return LimitedSearch(self._asked, self._run, self._held(begin, level, span), tolerance, None, bar)

    def _held(self, design, level, span) -> Variables:
        variables = read_variables(*self._outer)
        x = np.concatenate([*(np.ravel(np.asarray(leaf)) for leaf in jax.tree.leaves(design)), [level, span]])
        lower, upper, scale = (part.copy() for part in variables[2:5])
        lower[-2:] = upper[-2:] = x[-2:]
        scale[-2:] = 1.0
        return variables._replace(start=np.clip(x, lower, upper), lower=lower, upper=upper, scale=scale)


_ROW = np.zeros(1, np.int32)  # the one limit
