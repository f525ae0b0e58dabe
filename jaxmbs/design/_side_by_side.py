"""`interior_point_batch`: the optimum of every one of many problems, in rounds of a few steps."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..batching._batch import evaluate_batch
from ..batching._table import num_designs, read_designs, select_designs
from ..checks import as_flag, count_faults
from ..errors import ModelError
from ..runtime import not_tracing, step_bar
from ._barrier_search import STEP_LIMIT, barrier_search
from ._interior_point import (
    InteriorPoint,
    barrier_problem,
    check_options,
    first_search,
    flat_variables,
    optimum_of,
    values_of,
)


class _Round(NamedTuple):
    """Some steps of the search of one problem: a function of its case, bounds and search to the end of the round.

    Without arrays, so that batches keep its program from call to call.
    """

    objective: Callable
    equalities: Callable | None
    inequalities: Callable | None
    structure: Any  # of a design
    shapes: tuple
    exact: bool
    reverse: bool
    tolerance: float
    steps: int
    is_warm: bool

    def design(self, x):
        """A design of its variables (n,)."""
        ends = np.cumsum([0, *(int(np.prod(shape)) for shape in self.shapes)])
        leaves = [x[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], self.shapes, strict=False)]
        return jax.tree.unflatten(self.structure, leaves)

    def problem(self, case, lower, upper):
        """The problem of a case."""

        def functions(x):
            design = self.design(x)
            of_case = lambda f: None if f is None else (lambda design: f(design, case))
            return values_of(
                lambda design: self.objective(design, case), of_case(self.equalities), of_case(self.inequalities),
                design,
            )  # fmt: skip

        return barrier_problem(functions, lower, upper, self.exact, self.reverse, self.is_warm)

    def __call__(self, row):
        search = jax.lax.stop_gradient(row["search"])
        problem = self.problem(row["case"], row["lower"], row["upper"])
        return barrier_search(problem, search, self.tolerance, self.steps)


def _steps_of(end):
    return end.steps


def interior_point_batch(
    objective: Callable[[PyTree, PyTree], Any],
    design0: PyTree,
    cases: PyTree,
    bounds: PyTree | None = None,
    equalities: Callable[[PyTree, PyTree], Any] | None = None,
    inequalities: Callable[[PyTree, PyTree], Any] | None = None,
    *,
    hessian: str = "exact",
    tolerance: float = 1e-8,
    steps: int = 200,
    round_steps: int = 2,
    gradient: str = "reverse",
    warm: InteriorPoint | None = None,
    chunk: int | None = None,
    progress: bool = True,
    compile: str = "auto",
) -> InteriorPoint:
    """Optimise under limits for each of many cases, by `interior_point` of all of them side by side.

    A batch takes as long as its slowest design.  Therefore all searches go on for a few steps in turn, and after each
    round those that have ended make room for the others; they are the searches of `interior_point`, step by step.
    Curvatures and slopes of all cases stay in memory: N n (n + p + m) numbers, of n variables, p equations, m limits.

    Args:
        objective, equalities, inequalities: as of `interior_point`, of a design and a case.
        design0: the first design of all cases.
        cases: a pytree whose leaves have a leading axis of N cases, a list of N dicts, or a table, as for `batch`.
        bounds, hessian, tolerance, gradient: as of `interior_point`.
        steps: of each case at most, up to a whole round.
        round_steps: steps of a round; more where a step takes less than some milliseconds for all of them.
        warm: result of `interior_point` for one case nearby: all begin with its multipliers and its curvature.  Give
            its design as `design0`.
        chunk, progress, compile: as of `batch`.  Chunks of 8 suit designs of whole machines.

    Returns: InteriorPoint with a leading axis of N cases.  For derivatives of optima call `interior_point` with them.

    Raises: TypeError, ValueError, ModelError for what is none of these; TypeError inside of a program.

    Source: that of `interior_point`.
    """
    check_options(hessian, gradient, tolerance, steps)
    if faults := count_faults("round_steps", round_steps, 1):
        raise ModelError(faults, "the question")
    if not not_tracing():
        raise TypeError("interior_point_batch is no part of a program: use jax.vmap of interior_point there")
    cases = read_designs(cases)
    x0, lower, upper, _ = flat_variables(design0, bounds)
    leaves, structure = jax.tree.flatten(design0)
    lane = _Round(
        objective, equalities, inequalities, structure, tuple(map(np.shape, leaves)), hessian == "exact",
        gradient == "reverse", tolerance, min(round_steps, steps), warm is not None,
    )  # fmt: skip
    first = jax.tree.map(lambda x: jnp.asarray(x[0]), cases)
    search = first_search(lane.problem(first, lower, upper), x0, None if warm is None else (warm._at, warm._search))
    rows = {"lower": lower, "upper": upper, "search": search}
    rows = jax.tree.map(lambda x: np.repeat(np.asarray(x)[None], num_designs(cases), axis=0), rows)
    end = _rounds(lane, {"case": cases, **rows}, steps, chunk, progress, compile)
    return jax.vmap(lambda end: optimum_of(end, lane.design))(end)


def _rounds(lane, rows, steps, chunk, progress, compile):
    """Ends of all searches, round by round."""
    number = num_designs(rows["case"])
    end, open_ = None, np.arange(number)
    with step_bar(number, "interior points", is_wanted=as_flag("progress", progress), unit=" optima") as bar:
        for _ in range(-(-steps // lane.steps)):
            part = select_designs(rows, open_)
            found = evaluate_batch(
                lane, part, chunk, progress=False, cost=_steps_of, compile=compile, total=number
            ).values
            if end is None:
                end = jax.tree.map(np.array, found)
            else:
                counted = found._replace(
                    steps=end.steps[open_] + found.steps, evaluations=end.evaluations[open_] + found.evaluations
                )
                jax.tree.map(lambda old, new, where=open_: old.__setitem__(where, new), end, counted)
            jax.tree.map(lambda old, new, where=open_: old.__setitem__(where, new), rows["search"], found.search)
            left = open_[np.asarray(found.reason) == STEP_LIMIT]
            bar.update(len(open_) - len(left))
            open_ = left
            if not len(open_):
                break
    return end
