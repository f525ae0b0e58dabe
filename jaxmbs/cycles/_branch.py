"""`Branch`: cycles over a parameter, with their stability and the points where it changes."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from ..assembly._state import State
from ..errors import ModelError
from ..motion._motion import Motion
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..tables import format_number
from ._cycle import Cycle


class StabilityChange(NamedTuple):
    """A point of a branch at which the number of cycles, or their stability, changes.

    Attributes:
        kind: "fold", "period doubling", "torus" or "branch point", where another branch crosses.
        value: of the parameter; place: number of the point along the branch.
    """

    kind: str
    value: float
    place: int

    def __str__(self) -> str:
        return f"{self.kind} at {format_number(self.value)}"


class Branch(Reported, eqx.Module):
    """Cycles (K,) along a branch, in the order in which they were found.

    Attributes:
        name: of the parameter (static).
        values: (K,) of the parameter, which need not rise.
        cycles: (K,) a `Cycle` whose numbers have one axis more in front.
        points: where stability changes (static); each is among the cycles.
        ended: why the branch ends (static).
    """

    name: str = eqx.field(static=True)
    values: Float[Array, " K"]
    cycles: Cycle
    points: tuple[StabilityChange, ...] = eqx.field(static=True)
    ended: str = eqx.field(static=True)
    _between: Callable[[int, float], Cycle] = eqx.field(static=True)

    def report(self) -> Report:
        along = (Axis(self.name, np.asarray(self.values)),)
        size = jnp.max(jnp.abs(self.cycles.multipliers), axis=-1, initial=0.0)
        found = [
            Quantity("period", self.cycles.period, "s", along),
            Quantity("stable", self.stable, "", along),
            Quantity("largest multiplier", size, "", along),
        ]
        words = "; ".join([f"{len(self)} cycles", *map(str, self.points), self.ended])
        return Report(found, words)

    def __len__(self) -> int:
        return self.values.shape[0]

    def __getitem__(self, k: int) -> Cycle:
        """The cycle at a place of the branch."""
        return jax.tree.map(lambda x: x[k], self.cycles)

    @property
    def stable(self) -> Bool[Array, " K"]:
        """True where the cycle is stable."""
        return self.cycles.stable

    def of_kind(self, kind: str) -> tuple[StabilityChange, ...]:
        """The points of one kind."""
        return tuple(point for point in self.points if point.kind == kind)

    def all_at(self, value: float) -> list[Cycle]:
        """All cycles of the branch at a value of the parameter, along the branch."""
        v = np.asarray(self.values) - float(value)
        inside = np.flatnonzero((v[:-1] * v[1:] < 0.0) | (v[:-1] == 0.0))
        found = [self._between(int(k), float(value)) for k in inside]
        return [*found, self[-1]] if v[-1] == 0.0 else found

    def at(self, value: float, near: State | Motion | None = None) -> Cycle:
        """The cycle at a value of the parameter.  Args: near: of several, the one with the nearest start.

        Raises: ModelError where the branch has none, or several and `near` does not say which.
        """
        found = self.all_at(value)
        if not found:
            low, high = (format_number(f(self.values)) for f in (jnp.min, jnp.max))
            fault = f"the branch has no cycle at {value}: it goes from {low} to {high}"
            raise ModelError([fault], "the branch")
        if len(found) > 1 and near is None:
            fault = f"the branch has {len(found)} cycles at {value}: say by near= which, or take all_at"
            raise ModelError([fault], "the branch")
        return min(found, key=lambda cycle: _distance(cycle, near)) if len(found) > 1 else found[0]


def _distance(cycle, near):
    """Distance of a cycle's start from another state."""
    near, first = (near[0] if isinstance(near, Motion) else near), cycle[0]
    faster = (first.velocities - near.velocities) * cycle.period / (2.0 * np.pi)
    return float(jnp.sum((first.coordinates - near.coordinates) ** 2) + jnp.sum(faster**2))
