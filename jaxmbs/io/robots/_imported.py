"""Result of reading a mechanism's file: a builder, and the data that a mechanism here does not hold."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ...builder import SystemBuilder
from ...joints._limits import JointLimits


@dataclass(frozen=True)
class Imported:
    """A mechanism read from a file; `str` of it says what was found and what was left out.

    Attributes:
        builder: a `SystemBuilder` that builds at once and takes further bodies, forces and drives.
        dropped: what the file has and the mechanism has not, one sentence each; empty where nothing is lost.
        limits: by joint; they hold nothing back unless bump stops were asked for.
        start: coordinates by joint of the file's own initial pose, where not zero: `State.at(system, start)`.
        poses: such coordinates by the name of the file's key frames.
        notes: what was taken otherwise than the file says it, one sentence each: names that collide, inertias mended.
    """

    builder: SystemBuilder
    dropped: tuple[str, ...] = ()
    limits: Mapping[str, JointLimits] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)
    poses: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __str__(self):
        return "\n".join([repr(self.builder), *(f"  {sentence}" for sentence in self.remarks)])

    @property
    def remarks(self) -> list[str]:
        """Omissions and assumptions, one sentence each."""
        return [*(f"left out: {sentence}" for sentence in self.dropped), *(f"note: {note}" for note in self.notes)]


class UniqueNames:
    """Names of one kind of thing: what is taken gets a number behind it.

    Attributes:
        renamed: by new name, the one that was taken.
    """

    def __init__(self, *taken: str) -> None:
        self._taken = set(taken)
        self._next: dict[str, int] = {}
        self.renamed: dict[str, str] = {}

    def __call__(self, wanted: str) -> str:
        name, number = wanted, self._next.get(wanted, 2)
        while name in self._taken:
            name, number = f"{wanted} {number}", number + 1
        self._taken.add(name)
        self._next[wanted] = number
        if name != wanted:
            self.renamed[name] = wanted
        return name

    def notes(self, what: str) -> list[str]:
        """A sentence for each name that was changed."""
        return [f"{what} {old!r} is called {new!r}, as its name is taken" for new, old in self.renamed.items()]


def frame_names_of_joints(joints: Iterable[str]) -> list[str]:
    """Names that the frames of joints take."""
    return [f"{joint}.{end}" for joint in joints for end in ("parent", "child")]


def count_nouns(number: int, one: str, many: str | None = None) -> str:
    """`3 cameras`, `1 camera`."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def quote_names(names, most: int = 6) -> str:
    """Names in quotes, the first few of many."""
    names = list(names)
    rest = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(repr, names[:most])) + rest
