"""What reading a mechanism's file gives: a builder, and beside it what a mechanism here does not hold."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...builder import SystemBuilder


class JointLimits(NamedTuple):
    """What a file says a joint can do: coordinates [m or rad], velocity, effort [N or N m]; infinite where unsaid."""

    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    effort: float = np.inf


@dataclass(frozen=True)
class Imported:
    """A mechanism read from a file; `str` of it says what was found and what was left out.

    Attributes:
        builder: a `SystemBuilder` that builds at once and takes further bodies, forces and drives.
        dropped: what the file has and the mechanism has not, one sentence each; empty where nothing is lost.
        limits: by joint; they hold nothing back unless bump stops were asked for.
        start: coordinates by joint of the file's own initial pose, where not zero: `State.at(system, start)`.
        poses: such coordinates by the name of the file's key frames.
    """

    builder: SystemBuilder
    dropped: tuple[str, ...] = ()
    limits: Mapping[str, JointLimits] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)
    poses: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def __str__(self):
        return "\n".join([repr(self.builder), *(f"  left out: {sentence}" for sentence in self.dropped)])


class Names:
    """Names of one kind of thing: what is taken gets a number behind it."""

    def __init__(self, *taken: str) -> None:
        self._taken = set(taken)

    def __call__(self, wanted: str) -> str:
        name, number = wanted, 2
        while name in self._taken:
            name, number = f"{wanted} {number}", number + 1
        self._taken.add(name)
        return name


def counted(number: int, one: str, many: str | None = None) -> str:
    """`3 cameras`, `1 camera`."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def listed(names, most: int = 6) -> str:
    """Names in quotes, the first few of many."""
    names = list(names)
    rest = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(repr, names[:most])) + rest
