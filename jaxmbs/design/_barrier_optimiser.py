"""The interior-point method as an optimiser of `minimise`: one program for all steps, with a BFGS matrix."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..runtime import jit
from ._barrier_problem import BarrierProblem, bound_distances
from ._barrier_search import barrier_search, first_iterate
from ._working_set import ConstrainedSearch

_FIRST_MU = 0.1  # of the barrier, of few limits
#: The program is stopped by a tolerance below that of the search, which looks at its end again.
_CLOSER = 0.01


def interior_point_search(search: ConstrainedSearch, steps: int, compile: str) -> None:
    """Search from the current point in scaled variables; its end is a step of the search."""
    problem, variables = search.problem, search.variables
    start, scale = search.current.x, variables.scale
    unit = float(np.max(np.abs(search.current.gradient * scale))) or 1.0
    rows = search.working_set

    def functions(z):
        value, constraints, _ = problem.evaluate_values(start + scale * z)
        return value / unit, jnp.zeros(0), constraints[rows]

    def solve(z, lower, upper):
        converted = eqx.filter_closure_convert(functions, z)
        barrier = BarrierProblem(converted, lower, upper, False, problem.gradient == "reverse")
        first = first_iterate(barrier, z, None)
        where, mu = bound_distances(barrier, first.x), jnp.asarray(_FIRST_MU / max(1.0, len(rows) / 4.0))
        # multipliers of the central path: of hundreds of limits ones would bend the first BFGS matrix for long
        low, high = (
            jnp.where(where.has_lower, mu / where.below, 0.0),
            jnp.where(where.has_upper, mu / where.above, 0.0),
        )
        first = first._replace(z=jnp.full_like(first.z, jnp.inf), low=low, high=high)
        return barrier_search(barrier, first, mu, _CLOSER * search.tolerance, steps)

    ends = [jnp.asarray((end - start) / scale) for end in (variables.lower, variables.upper)]
    found = jit(solve, compile=compile)(jnp.zeros(len(start)), *ends)
    search.count(int(found.evaluations))
    search.accept(search.evaluate(start + scale * np.asarray(found.at.x)), by_decrease=False)
