"""Starting points of a multistart search, optax from all of them at once, and the best result."""

import dataclasses
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree

from ..batching._sampling import sobol_points
from ._optimisers import HALVINGS, standard_promotion
from ._optimum import Optimum
from ._search import Search
from ._variables import Variables, read_variables


def starting_points(design0: PyTree, bounds: PyTree | None, starts: int | str) -> list[Variables]:
    """Variables at many first designs: `design0` and points of Sobol's sequence between its bounds, `starts` in all;
    or designs that are "stacked" along a leading axis of every leaf.

    Raises: as `read_variables`, with the number of the start; ValueError for a leaf without the leading axis that
        others have, and for variables without bounds where points are to be spread.
    """
    if starts == "stacked":
        return _stacked_starts(design0, bounds)
    if isinstance(starts, bool) or not isinstance(starts, int | np.integer) or starts < 1:
        raise ValueError(
            f"starts must be a positive whole number, or 'stacked' for designs along a first axis, not {starts!r}"
        )
    return _sobol_starts(read_variables(design0, bounds), int(starts))


def _stacked_starts(designs: PyTree, bounds: PyTree | None) -> list[Variables]:
    """Variables at each of the stacked designs."""
    leaves = jax.tree_util.tree_flatten_with_path(designs)[0]
    if not leaves:
        raise ValueError("design0 has no variables")
    number = next((np.shape(leaf)[0] for _, leaf in leaves if np.ndim(leaf)), 0)
    for path, leaf in leaves:
        if np.shape(leaf)[:1] != (number,):
            name = jax.tree_util.keystr(path, simple=True, separator=".") or "design"
            raise ValueError(f"{name} has shape {np.shape(leaf)}: {number} stacked starts need that leading axis")
    if not number:
        raise ValueError("there are no stacked starts: the leading axis is empty")
    found = []
    for k in range(number):
        try:
            found.append(read_variables(jax.tree.map(lambda leaf, k=k: np.asarray(leaf)[k], designs), bounds))
        except ValueError as error:
            raise ValueError(f"start {k}: {error}") from error
    return found


def _sobol_starts(variables: Variables, starts: int) -> list[Variables]:
    """Variables at the design itself and at points of Sobol's sequence between its bounds."""
    unbounded = [name for name, bounded in zip(variables.names, variables.is_bounded, strict=True) if not bounded]
    if unbounded:
        raise ValueError(
            f"{starts} starts from one design need both bounds of every variable: {', '.join(unbounded)}; "
            "where design0 holds many designs along a first axis, say starts='stacked'"
        )
    points = sobol_points(len(variables.start), max(starts - 1, 1), seed=0)[: starts - 1]
    points = variables.lower + points * (variables.upper - variables.lower)
    return [variables, *(variables._replace(start=point) for point in points)]


def best_optimum(found: Sequence[Optimum]) -> Optimum:
    """The best optimum, with all of them in `starts`; a gain by the tolerance of limits does not count.

    Raises: ValueError when no search could start.
    """
    values = np.array([optimum.value + _tolerance_gain(optimum) for optimum in found])
    if np.all(np.isnan(values)):
        raise ValueError(f"no search can start at any of the {len(found)} first designs: see `History` of one alone")
    missed = np.array(
        [max((-limit.margin for limit in optimum.limits if not limit.ok), default=0.0) for optimum in found]
    )
    first = np.lexsort((values, np.where(np.isnan(values), np.inf, missed)))[0]
    return dataclasses.replace(found[int(first)], starts=tuple(found))


def _tolerance_gain(optimum: Optimum) -> float:
    """Gain in the objective by limits violated within their tolerance, by their prices; twice, to be safe."""
    violated = [
        (limit, abs(limit.after[limit.worst] - limit.bound)) for limit in optimum.limits if limit.margin < 0.0
    ]
    return 2.0 * float(sum(np.sum(np.abs(limit.prices)) * excess for limit, excess in violated))


class _BatchedObjective:
    """Evaluates a trial design of every start at once and gives each search its own row."""

    def __init__(self, evaluate: Callable) -> None:
        self._evaluate = evaluate
        self.values = self.slopes = self.is_outside = np.zeros(0)

    def evaluator(self, k: int) -> Callable:
        """Evaluator of search k, which returns its row of the last batch."""
        return lambda vector: (self.values[k], self.slopes[k], (), (), (self.is_outside[k],))

    def evaluate(self, x: np.ndarray) -> None:
        """Evaluate the designs (starts, n)."""
        values, slopes, *_, answers = self._evaluate(jnp.asarray(x, float))
        self.values, self.slopes = np.asarray(values, float), np.asarray(slopes, float)
        self.is_outside = np.asarray(answers[-1])


def run_optax_multistart(
    evaluate: Callable,
    objective: Callable,
    variables: list[Variables],
    optimiser: optax.GradientTransformation,
    steps: int,
    tolerance: float,
    callback: Callable | None,
    progress,
) -> list[Search]:
    """Run an optax optimiser from all starts in step; each search stops, steps back and records its best on its own.

    `evaluate` takes all designs (starts, n).
    """
    batch, unravel = _BatchedObjective(evaluate), variables[0].unravel
    batch.evaluate(np.stack([v.start for v in variables]))
    searches = [
        Search(batch.evaluator(k), v, tolerance, callback, progress, may_fail=True) for k, v in enumerate(variables)
    ]
    optimiser = optax.with_extra_args_support(optimiser)

    @jax.jit
    @jax.vmap
    def update(x, value, slopes, state):
        slopes = unravel(slopes)
        updates, state = optimiser.update(slopes, state, unravel(x), value=value, grad=slopes, value_fn=objective)
        return ravel_pytree(updates)[0], state

    def stacked(part):
        return jnp.asarray(np.stack([getattr(search.current, part) for search in searches]), float)

    with standard_promotion():
        state = jax.vmap(lambda x: optimiser.init(unravel(x)))(stacked("x"))
    for _ in range(steps):
        if all(search.reason for search in searches):
            break
        with standard_promotion():
            move, state = update(stacked("x"), stacked("value"), stacked("gradient"), state)
        _accept_steps(searches, batch, np.asarray(move, float))
    return searches


def _accept_steps(searches: list[Search], batch: _BatchedObjective, move: np.ndarray) -> None:
    """Accept a finite trial of every running search, halving the moves (starts, n) that do not lead to one."""
    waiting = {k for k, search in enumerate(searches) if not search.reason}
    trial = np.stack([search.current.x for search in searches])
    for halving in range(HALVINGS):
        for k in waiting:
            trial[k] = np.asarray(searches[k].variables.clip(searches[k].current.x + 0.5**halving * move[k]))
        batch.evaluate(trial)
        for k in sorted(waiting):
            point = searches[k].evaluate(trial[k])
            if point.finite:
                searches[k].accept(point, by_decrease=False)
                waiting.discard(k)
        if not waiting:
            return
    for k in waiting:
        searches[k].reason = "non-finite"
