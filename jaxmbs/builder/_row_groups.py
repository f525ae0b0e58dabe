"""Groups of the declared constraint rows that are not between two frames."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..errors import ModelError
from ..joints._rows import AbstractRows
from ..model._rows import RowGroup
from ..model._topology import JointRecord
from ._groups import group_by_structure
from ._user_rows import row_count


class RowItem(NamedTuple):
    """A declared element of rows: its law, the frames that it acts on and the joints whose coordinates it reads."""

    name: str
    law: AbstractRows
    frames: tuple[int, ...] = ()
    joints: tuple[JointRecord, ...] = ()

    @property
    def columns(self) -> tuple[int, ...]:
        """Velocities of the joints."""
        return tuple(joint.first_velocity for joint in self.joints)

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Coordinates of the joints."""
        return tuple(joint.first_coordinate for joint in self.joints)


def row_groups(items: list[RowItem], first: int, joints: Iterable[JointRecord]) -> tuple:
    """Groups of rows, the name of each row, and the numbers of those of velocity alone, which come last.

    Args: first: number of the rows before them; joints: all of the mechanism.

    Raises: ModelError for functions of the user that cannot be evaluated.
    """
    items = sorted(items, key=lambda item: item.law.is_nonholonomic)
    joints = list(joints)
    psi, u = (np.zeros(sum(getattr(j, of) for j in joints)) for of in ("num_coordinates", "num_velocities"))
    counts = [row_count(item.name, item.law, psi, u, len(item.frames), len(item.joints)) for item in items]
    if faults := [fault for _, own in counts for fault in own]:
        raise ModelError(faults)
    names: list[str] = []
    slips: list[int] = []
    members = []
    for number, (item, (size, _)) in enumerate(zip(items, counts, strict=True)):
        place = tuple(range(first + len(names), first + len(names) + size))
        names += [item.name] * size
        slips += place if item.law.is_nonholonomic else ()
        kind = len(item.frames), len(item.joints), number if item.law.reads_all else None
        members.append((item.name, item.law, place, (item.frames, item.columns, item.coordinates), kind))
    groups = (
        RowGroup(n, law, place, *zip(*of, strict=True)) for _, n, law, place, of, _ in group_by_structure(members)
    )
    return tuple(groups), names, slips
