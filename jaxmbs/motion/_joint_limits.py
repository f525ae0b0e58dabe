"""Limits of joints, as robot files give them, beside what a motion makes of them."""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..checks import no_such
from ..errors import UnknownNameError
from ..joints._limits import JointLimits
from ..model._system import System
from ..quantities import Quantity
from ..reaction._result import Reactions
from ..reports import Report, Reported, faults_in_short
from ..tables import format_number
from ._motion import Motion


class _Bound(NamedTuple):
    """One bound of a joint: its words, the values (T,) that may not exceed it, their unit."""

    words: str
    values: np.ndarray
    bound: float
    unit: str

    def in_words(self, t):
        excess, first = np.max(self.values - self.bound), t[np.argmax(self.values > self.bound)]
        size = -self.bound if self.words == _LOWER else self.bound
        reached = f"{self.words} {format_number(size)} {self.unit}"
        return f"{reached}, by {format_number(excess)}, first at {format_number(first)} s"


@dataclasses.dataclass(frozen=True, repr=False)
class JointUse(Reported):
    """Use of the limits of joints by a motion; `print` is a table, `ok` the verdict.

    Attributes:
        t: (T,) times [s].
        coordinates, velocities: (T,) by joint; efforts: of the drives, where they are known.
        limits: by joint.
    """

    t: np.ndarray
    coordinates: Mapping[str, np.ndarray]
    velocities: Mapping[str, np.ndarray]
    efforts: Mapping[str, np.ndarray]
    limits: Mapping[str, JointLimits]
    units: Mapping[str, str]

    @property
    def ok(self) -> bool:
        """True where no joint goes beyond a limit."""
        return not self.faults()

    @property
    def use(self) -> dict[str, float]:
        """Largest share of a limit of velocity or effort by joint; 0 for joints without either."""
        return {
            name: max(
                (float(np.max(b.values)) / b.bound for b in self._bounds(name) if b.words in _SIZES), default=0.0
            )
            for name in self.limits
        }

    def faults(self) -> list[str]:
        """A sentence for each limit that is passed, with the time when it first is."""
        return [
            f"joint {name!r} passes {bound.in_words(self.t)}"
            for name in self.limits
            for bound in self._bounds(name)
            if np.any(bound.values > bound.bound)
        ]

    def _bounds(self, name) -> Iterator[_Bound]:
        held, unit = self.limits[name], self.units[name]
        q, v = self.coordinates[name], self.velocities[name]
        found = [
            _Bound(_LOWER, -q, -held.lower, unit),
            _Bound("its upper limit", q, held.upper, unit),
            _Bound(_SIZES[0], np.abs(v), held.velocity, f"{unit}/s"),
        ]
        if name in self.efforts:
            force = "N" if unit == "m" else "N m"
            found.append(_Bound(_SIZES[1], np.abs(self.efforts[name]), held.effort, force))
        return (bound for bound in found if np.isfinite(bound.bound))

    def report(self) -> Report:
        parts = ("", self.coordinates), ("velocity of ", self.velocities), ("effort of ", self.efforts)
        rates = {"m": ("m", "m/s", "N"), "rad": ("rad", "rad/s", "N m")}
        quantities = [
            Quantity(f"{words}{name}", values[name], rates[self.units[name]][k])
            for k, (words, values) in enumerate(parts)
            for name in self.limits
            if name in values
        ]
        beyond = self.faults()
        summary = f"{len(self.limits)} joints with limits, {len(beyond) or 'none'} passed"
        return Report(quantities, summary, faults_in_short(beyond), self.t, [_HEAD, *map(self._row, self.limits)])

    def _row(self, name):
        held, q = self.limits[name], self.coordinates[name]
        effort = format_number(np.max(np.abs(self.efforts[name]))) if name in self.efforts else "-"
        sizes = format_number(np.max(np.abs(self.velocities[name]))), effort
        cells = [format_number(np.min(q)), format_number(np.max(q)), _text(held.lower), _text(held.upper)]
        return (name, *cells, sizes[0], _text(held.velocity), sizes[1], _text(held.effort), self.units[name])


_LOWER = "its lower limit"
_SIZES = ("its limit of velocity", "its limit of effort")
_HEAD = ("joint", "least", "largest", "lower", "upper", "fastest", "allowed", "effort", "allowed", "unit")


def _text(bound):
    return format_number(bound) if np.isfinite(bound) else "-"


def joint_use(
    system: System,
    motion: Motion,
    limits: Mapping[str, JointLimits],
    efforts: Reactions | Mapping[str, Any] | None = None,
) -> JointUse:
    """Use of the limits of joints by a motion, on the host.

    Args:
        limits: by joint, as `mbs.io.read_urdf(...).limits`.
        efforts: reactions of the motion, whose drives' efforts are taken, or (T,) of `inverse_dynamics` by joint.

    Raises: UnknownNameError for limits of joints that are not in the system.
    """
    q, v = system.coordinates(motion.states), system.velocities(motion.states)
    for name in limits:
        if name not in q:
            raise UnknownNameError(no_such("joint with coordinates", name, tuple(q)))
    single = {name: held for name, held in limits.items() if np.ndim(q[name]) == 1}
    top = system.topology
    units = {name: top.joints[top.joint_index[name]].units[0] for name in single}
    turns, rates = ({name: np.asarray(values[name]) for name in single} for values in (q, v))
    return JointUse(np.asarray(motion.ts), turns, rates, _efforts(efforts, single), single, units)


def _efforts(given, names):
    if given is None:
        return {}
    if isinstance(given, Reactions):
        given = {name: given[name].effort for name in names if given[name].effort is not None}
    return {name: np.asarray(given[name]).reshape(len(given[name])) for name in names if name in given}
