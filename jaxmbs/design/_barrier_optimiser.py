"""The interior-point method as an optimiser of `minimise`: one program for all steps, with a BFGS matrix, for one
search or for many side by side."""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..batching._batch import batch
from ..runtime import jit
from ._barrier_problem import BarrierProblem, bound_distances
from ._barrier_search import barrier_search, first_iterate, first_state
from ._constrained import run_constrained
from ._problem import DesignProblem
from ._search import Search
from ._variables import Variables
from ._working_set import ConstrainedSearch

_FIRST_MU = 0.1  # of the barrier, of few limits
#: The program is stopped by a tolerance below that of the search, which looks at its end again.
_CLOSER = 0.01


def interior_point_search(search: ConstrainedSearch, steps: int, compile: str) -> None:
    """Search from the current point in scaled variables; its end is a step of the search."""
    variables = search.variables._replace(start=search.current.x)
    solve = _program(search.problem, search.working_set, search.tolerance, steps)
    _accept(search, *jit(solve, compile=compile)(_columns(variables)))


def interior_points(
    problem: DesignProblem, points: Sequence[Variables], tolerance: float, steps: int, compile: str
) -> list[tuple[np.ndarray, int]]:
    """Ends (n,) of searches from many first designs in one batch, under all limits, and their evaluations."""
    solve = _program(problem, np.arange(problem.num_constraints), tolerance, steps)
    columns = [_columns(variables) for variables in points]
    stacked = {name: np.stack([one[name] for one in columns]) for name in columns[0]}
    x, evaluations = batch(solve, stacked, progress=False, compile=compile).values
    return [(np.asarray(end), int(count)) for end, count in zip(x, evaluations, strict=True)]


def from_end(end: tuple[np.ndarray, int]) -> Callable[[Search, int], None]:
    """The run of a search whose end is known; the search judges it."""
    ends = iter([end])

    def once(search, steps):
        for found in ends:
            _accept(search, *found)

    return lambda search, steps: run_constrained(search, steps, once)  # type: ignore[arg-type]


def _accept(search, x, evaluations):
    search.count(int(evaluations))
    search.accept(search.evaluate(np.asarray(x)), by_decrease=False)


def _columns(variables):
    return {name: np.asarray(getattr(variables, name), float) for name in ("start", "lower", "upper", "scale")}


def _program(problem: DesignProblem, rows: np.ndarray, tolerance: float, steps: int) -> Callable:
    """Function of start, bounds and scale of variables (n,) to the end of a search and its evaluations."""

    def solve(point):
        start, scale = point["start"], point["scale"]

        def functions(z):
            value, constraints, _ = problem.evaluate_values(start + scale * z)
            return value, jnp.zeros(0), constraints[rows]

        z = jnp.zeros_like(start)
        lower, upper = ((point[end] - start) / scale for end in ("lower", "upper"))
        converted = eqx.filter_closure_convert(functions, z)
        barrier = BarrierProblem(converted, lower, upper, False, problem.gradient == "reverse", "unit")
        first = first_iterate(barrier, z, None)
        where, mu = bound_distances(barrier, first.x), jnp.asarray(_FIRST_MU / max(1.0, len(rows) / 4.0))
        # multipliers of the central path: of hundreds of limits ones would bend the first BFGS matrix for long
        low = jnp.where(where.has_lower, mu / where.below, 0.0)
        high = jnp.where(where.has_upper, mu / where.above, 0.0)
        first = first._replace(z=jnp.full_like(first.z, jnp.inf), low=low, high=high)
        found = barrier_search(barrier, first_state(barrier, first, None, mu), _CLOSER * tolerance, steps)
        return start + scale * found.at.x, found.evaluations

    return solve
