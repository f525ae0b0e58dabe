"""Named frames of an SDF and their poses: each is given relative to another one."""

from typing import NamedTuple

from ...builder._arrays import compose_poses, invert
from ...checks import no_such
from ._link_tree import IDENTITY

WORLD = "world"


class NamedPose(NamedTuple):
    """Pose (rotation, position) of a link, joint, frame or model relative to the frame of a full name.

    Attributes:
        on: full name of the link, or of what leads to it, that the thing is fixed to.
    """

    pose: tuple
    relative_to: str
    on: str | None = None


class PoseTable:
    """Poses by full name; "world" is there.  Faults say what is unknown or relative to itself."""

    def __init__(self, faults: list[str]) -> None:
        self._items: dict[str, NamedPose] = {}
        self._poses: dict[str, tuple] = {WORLD: IDENTITY}
        self._faults = faults

    def add(self, name: str, item: NamedPose) -> None:
        """Enter a thing."""
        if name in self._items:
            self._faults.append(f"the name {name!r} is given twice")
        self._items[name] = item

    def __contains__(self, name: str) -> bool:
        return name == WORLD or name in self._items

    def resolve(self) -> None:
        """Find the poses of all things, and the faults of those that have none."""
        for name in self._items:
            self.pose(name)

    def pose(self, name: str) -> tuple:
        """Pose in the world (rotation, position)."""
        chain: list[str] = []
        while name not in self._poses:
            if name in chain:
                self._faults.append(f"the pose of {name!r} is given relative to itself")
            elif name not in self._items:
                self._faults.append(
                    f"the pose of {chain[-1] if chain else ''!r}: {no_such('frame', name, self._items)}"
                )
            if name in chain or name not in self._items:
                self._poses[name] = IDENTITY
                break
            chain.append(name)
            name = self._items[name].relative_to
        for name in reversed([one for one in chain if one not in self._poses]):
            item = self._items[name]
            self._poses[name] = compose_poses(self._poses[item.relative_to], item.pose)
        return self._poses[name]

    def link_of(self, name: str, where: str) -> str:
        """Full name of the link, or "world", that a thing is fixed to."""
        seen: set[str] = set()
        while name != WORLD and name in self._items and (on := self._items[name].on) is not None:
            if name in seen:
                self._faults.append(f"{where}: {name!r} is attached to itself, by way of others")
                return WORLD
            seen.add(name)
            name = on
        if name not in self:
            self._faults.append(f"{where}: {no_such('link', name, self._items)}")
            return WORLD
        return name

    def between(self, first: str, second: str) -> tuple:
        """Pose of the second in the axes of the first."""
        return compose_poses(invert(self.pose(first)), self.pose(second))
