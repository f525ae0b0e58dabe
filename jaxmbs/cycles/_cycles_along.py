"""`cycles_along`: a branch of cycles over a parameter, with folds, period doublings and torus points."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..assembly._state import State
from ..checks import count_faults, faults_if
from ..errors import ModelError, SimulationError
from ..motion._event import EventLike
from ..motion._motion import Motion
from ..runtime import as_array
from ..tables import format_number
from ..typing import ArrayLike, WordedError
from ._arguments import check_samples
from ._branch import Branch, StabilityChange
from ._continuation import Family, cycle_at, directions, first_place, next_place, with_size
from ._crossings import changed, is_of_kind, locate, test_values
from ._cycle import without_trivial
from ._periodic import CycleOptions, flow_of, periodic, problem_of
from ._whole import size_of_motion

_FIRST_STEP, _LEAST_STEP = 0.2, 1e-6  # of the largest one; of the range
_STRAIGHT = 0.95  # cosine between two tangents, below which a step is repeated, shorter
_LONGER, _EASY = 1.5, 3  # growth of steps whose corrections are so few
_MOST_POINTS = 100_000
_LEAST_SIZE = 1e-6  # of the motion, of the length of the system


def cycles_along(
    system_of: Callable[[Any], Any],
    values: WordedError[tuple[ArrayLike, ArrayLike]],
    period: WordedError[ArrayLike | Callable[[Any], Any]],
    near: WordedError[State | Motion | None] = None,
    at: ArrayLike | None = None,
    free: str | None = None,
    name: str = "parameter",
    most_points: WordedError[int] = 300,
    longest_step: ArrayLike = 0.1,
    segments: WordedError[int] = 1,
    periods: WordedError[int] = 1,
    turns: WordedError[Mapping[str, int] | None] = None,
    held: WordedError[Sequence[str]] = (),
    steps: WordedError[int] = 120,
    solver: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    formulation: Any = None,
    event: WordedError[EventLike | None] = None,
    max_steps: int = 100_000,
) -> Branch:
    """The branch of cycles over a parameter, around its folds, with stability along it.

    Args:
        system_of: function of the parameter () that gives the system; it is traced, so its `build` takes `like=`.
        values: first and last of the parameter; the branch begins at the first one and ends where it leaves their
            range, at either end.
        period: [s], or a function of the parameter; a first guess where the period is free.
        near: a state near the cycle at the first value, or a motion or cycle: which branch is asked for.
        at: another value at which `near` is: the branch is followed both ways from there.
        name: of the parameter, in tables and plots.
        most_points: at most so many on a branch; longest_step: along it, in units of the range and of the motion's
            size.
        free, segments, periods, turns, held, steps, solver, rtol, atol, formulation, event, max_steps: as of
            `periodic`.

    Steps along the arc, predicted by the tangent, shortened where the branch turns or corrections do not end.  Folds,
    period doublings, torus points and points where branches cross are found by the signs of test functions from
    multipliers, and located by the Illinois method to rounding; two of a kind within one step are not seen.  Beyond a
    doubling the other branch is asked for with `periods=2` and a `near` beside the doubled cycle.

    Returns: a Branch.  One that is lost ends there, and `ended` says so.

    Raises: ModelError, SimulationError as `periodic`, for the first cycle.
    Source: Keller (1977); Seydel, Practical bifurcation and stability analysis (2010), chapters 4 and 7.
    """
    first, last = _range(values, at, most_points, longest_step)
    at = first if at is None else float(np.asarray(at))
    cycle: dict[str, Any] = {"turns": turns, "held": held, "segments": segments, "steps": steps}
    flow: dict[str, Any] = {"solver": solver, "rtol": rtol, "atol": atol, "event": event, "formulation": formulation}
    flow["max_steps"] = max_steps
    one: Any = period if callable(period) else lambda value: period
    period_of = lambda value: periods * one(value)
    system = system_of(jnp.asarray(at))
    begin = periodic(system, as_array(period_of(at)), near, free, **cycle, **flow)
    options = CycleOptions(turns, held, free is not None, segments, steps)
    problem = problem_of(system, begin[0], flow_of(begin[0], **flow), begin.period, options)
    span = jnp.asarray(abs(last - first), begin.period.dtype)
    given = None if free else lambda value: as_array(period_of(value)).astype(span.dtype)
    family = Family(problem, span, system_of, given)
    walk = _Continuation(family, system, (first, last), float(np.asarray(longest_step)), most_points, name)
    return walk.from_cycle(begin, at)


def _range(values, at, most_points, longest_step):
    """First and last value.  Raises: ModelError."""
    kinds = {np.asarray(x).dtype.kind for x in values} if isinstance(values, tuple | list) else set("?")
    ends = np.asarray(values, float) if kinds <= set("iuf") else np.zeros(0)
    faults = faults_if(
        (ends.shape != (2,) or not np.all(np.isfinite(ends)), "values= takes two numbers, the first and the last"),
        (ends.shape == (2,) and bool(ends[0] == ends[-1]), "values= must differ"),
        (
            at is not None and ends.size == 2 and not min(ends) <= float(at) <= max(ends),
            f"at={at} must lie between the values",
        ),
        (not 0.0 < float(longest_step) <= 1.0, f"longest_step={longest_step} must be above 0, at most 1"),
    )
    faults += count_faults("most_points", most_points, 2) or faults_if(
        (most_points > _MOST_POINTS, f"most_points must be at most {_MOST_POINTS}")
    )
    if faults:
        raise ModelError(faults, "the branch")
    return float(ends[0]), float(ends[1])


class _Continuation:
    """Steps along a branch, on the host."""

    def __init__(self, family, system, ends, longest, most, name):
        self.family, self.system, self.ends, self.most, self.name = family, system, ends, most, name
        self.longest = longest

    def from_cycle(self, begin, at) -> Branch:
        """The branch through a cycle."""
        ahead = np.sign(self.ends[1] - self.ends[0])
        places, cycles, points, ended = self._one_way(begin, at, ahead)
        if at not in self.ends and ended != _CLOSED:
            back, earlier, more, also = self._one_way(begin, at, -ahead)
            number = len(back) - 1
            moved = [point._replace(place=number - point.place) for point in reversed(more)]
            points = moved + [point._replace(place=point.place + number) for point in points]
            back = [place._replace(tangent=-place.tangent) for place in back]
            places, cycles = [*back[:0:-1], *places], [*earlier[:0:-1], *cycles]
            ended = f"{also}; {ended}"
        stacked = jax.tree.map(lambda *x: jnp.stack(x), *cycles)
        values = jnp.stack([place.value for place in places])
        return Branch(self.name, values, stacked, tuple(points), ended, self._between(places))

    def _one_way(self, begin, at, sense):
        """Places, cycles and points from a cycle on, and why they end."""
        every = (len(begin) - 1) // self.family.problem.shooting.segments
        states = jax.tree.map(lambda x: x[:-1:every], begin.states)
        size = self._size(begin)
        place = first_place(self.family, jnp.asarray(at, size.dtype), states, begin.period, size, jnp.asarray(sense))
        places, cycles, points, length = [place], [begin], [], _FIRST_STEP * self.longest
        while len(places) < self.most:
            found = self._step(places[-1], length)
            if found is None:
                return (
                    places,
                    cycles,
                    points,
                    f"lost at {format_number(float(place.value))}: no cycle near it was found",
                )
            new, cycle, length = found
            new, cycle, part, end = self._within(places[-1], new, cycle, length)
            for kind, point, there in self._points(places[-1], cycles[-1], new, cycle, part):
                points.append(StabilityChange(kind, float(point.value), len(places)))
                places.append(point)
                cycles.append(there)
            closed = len(places) > 2 and self._passes(places[0], places[-1], new)
            place = with_size(new, jnp.maximum(new.size, self._size(cycle)))
            places.append(place)
            cycles.append(cycle)
            if end or closed:
                return places, cycles, points, end or _CLOSED
            if int(new.corrections) <= _EASY:
                length = min(_LONGER * length, self.longest)
        return places, cycles, points, f"stopped after {self.most} points (most_points)"

    def _size(self, cycle) -> Array:
        """Size of a cycle's motion, the unit of its states along the branch."""
        segments = self.family.problem.shooting.segments
        size = size_of_motion(cycle, cycle.period) + _LEAST_SIZE * self.system.length
        return size * np.sqrt(segments)

    def _step(self, place, length):
        """The next place and its cycle, and the length that was taken."""
        while length > _LEAST_STEP:
            new = next_place(self.family, place, jnp.asarray(length, place.value.dtype))
            if bool(new.found) and float(new.turn) > _STRAIGHT:
                check_samples(self.system, new.period, self.family.problem.shooting.segments)
                cycle = cycle_at(self.family, new)
                if bool(cycle.ok):
                    return new, cycle, length
            length *= 0.5
        return None

    def _at(self, place, length):
        """BranchPlace and cycle at a length along, or (None, None)."""
        new = next_place(self.family, place, jnp.asarray(length, place.value.dtype))
        return (new, cycle_at(self.family, new)) if bool(new.found) else (None, None)

    def _within(self, place, new, cycle, length):
        """Place, cycle and length of the new place, or of the end of the range before it, and words for that end."""
        for end, words in zip(reversed(self.ends), ("last value reached", "first value reached again"), strict=True):
            outside = np.sign(end - np.mean(self.ends)) * (float(new.value) - end)
            if outside >= 0.0:
                there = self._located(place, length, lambda p, c, end=end: float(p.value) - end, new, cycle)
                part, new, cycle = (length, new, cycle) if there is None else there
                return new._replace(value=jnp.asarray(end, new.value.dtype)), cycle, part, words
        return new, cycle, length, ""

    def _located(self, place, length, value_of, new, cycle):
        """Length, place and cycle between two places where a function of both is zero; None where it fails."""
        before, after = value_of(place, None), value_of(new, cycle)
        if after == 0.0 or before * after > 0.0:
            return length, new, cycle

        def function(part):
            found = self._at(place, part)
            return (0.0, None) if found[0] is None else (value_of(*found), found)

        there = locate(function, length, (before, after))
        return None if there is None else (there[0], *there[1])

    def _points(self, place, before, new, cycle, length):
        """Kinds, places and cycles of the points between two places, along the branch."""
        values = [self._tests(p, c) for p, c in ((place, before), (new, cycle))]
        found = []
        for kind in changed(*values):
            known = lambda p, c, kind=kind: self._tests(p, before if c is None else c)[kind]
            there = self._located(place, length, known, new, cycle)
            if there is not None and is_of_kind(kind, self._others(there[2])):
                found.append((there[0], kind, *there[1:]))
        return [part[1:] for part in sorted(found, key=lambda x: x[0])]

    def _tests(self, place, cycle):
        return test_values(float(place.tangent[-1]), self._others(cycle))

    def _others(self, cycle):
        """Multipliers of a cycle without the trivial ones."""
        return np.asarray(without_trivial(cycle.multipliers, cycle.num_trivial))

    def _between(self, places):
        """Function of an interval and a value that gives the cycle there."""

        def cycle(k, value):
            place, new = places[k], places[k + 1]
            length = float(jnp.sqrt(jnp.sum((self._row(new) - self._row(place)) ** 2)))
            there = self._located(place, length, lambda p, c: float(p.value) - value, new, None)
            if there is None:
                raise SimulationError(f"the branch was lost between {float(place.value)} and {float(new.value)}")
            return there[2] if there[2] is not None else cycle_at(self.family, new)

        return cycle

    def _row(self, place):
        """A place as one row of numbers, in units of the arc."""
        states, size = place.states, place.size
        rate = 2.0 * np.pi / place.period
        parts = [states.coordinates / size, states.velocities / (size * rate), place.value[None] / self.family.span]
        return jnp.concatenate([x.reshape(-1) for x in parts])

    def _passes(self, first, before, after):
        """True where the step between two places goes through the first one."""
        a, b = (self._row(x._replace(size=first.size)) - self._row(first) for x in (before, after))
        near = jnp.sqrt(jnp.sum((b - a) ** 2))
        aside = jnp.sqrt(jnp.sum(a**2)) + jnp.sqrt(jnp.sum(b**2)) - near
        return bool((aside < 0.1 * near) & (directions(after) @ directions(first) > 0.5))


_CLOSED = "closed: the first cycle is reached again"
