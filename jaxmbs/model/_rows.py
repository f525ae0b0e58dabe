"""Constraint rows on poses of frames and on coordinates: drives, couplers, cables, functions of the user.

Rows between two frames, of cut joints and constraints, are `ClosureGroup`s.
"""

from collections.abc import Container
from typing import NamedTuple

import equinox as eqx
import numpy as np

from ..joints._rows import AbstractRows
from ..named_arrays import element_of


class RowGroup(eqx.Module):
    """Elements of one law of rows, `joints.AbstractRows`, their parameters stacked.

    Attributes:
        names: of the elements; places: (n, r) of each one's rows among all rows.
        frames: (n, k) that it acts on; columns, coordinates: (n, m) velocities and coordinates of joints that it
            reads.  A law that reads all of them has none here, and stands alone in its group.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    law: AbstractRows
    places: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    frames: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    columns: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    coordinates: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    @property
    def acts_in_joints(self) -> bool:
        """True if the loads are efforts inside of joints, as those of teeth: neither on frames nor of a drive."""
        return (self.law.reads_all or bool(self.columns[0])) and not self.law.prescribes

    def without(self, gone: Container[str], number: np.ndarray) -> "RowGroup | None":
        """The group without some elements; None where nothing is left.  Args: number: new place of each row."""
        kept = np.array([k for k, name in enumerate(self.names) if name not in gone], int)
        if not len(kept):
            return None
        some = lambda each: tuple(each[k] for k in kept)
        places = tuple(tuple(int(number[k]) for k in own) for own in some(self.places))
        law = self.law if len(kept) == len(self.names) else element_of(self.law, kept)
        return RowGroup(some(self.names), law, places, some(self.frames), some(self.columns), some(self.coordinates))


class RowElement(NamedTuple):
    """One element of a group of rows."""

    group: RowGroup
    number: int

    @property
    def name(self) -> str:
        """Of the drive's joint, or of the constraint."""
        return self.group.names[self.number]

    @property
    def law(self) -> AbstractRows:
        """With the element's own numbers."""
        return element_of(self.group.law, self.number)

    @property
    def places(self) -> tuple[int, ...]:
        """Among all rows."""
        return self.group.places[self.number]

    @property
    def frames(self) -> tuple[int, ...]:
        """That it acts on."""
        return self.group.frames[self.number]

    @property
    def columns(self) -> tuple[int, ...]:
        """Velocities of joints that it reads."""
        return self.group.columns[self.number]

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Coordinates of joints that it reads."""
        return self.group.coordinates[self.number]

    @property
    def may_read_all(self) -> bool:
        """True if any velocity may change it, as those that move frames do."""
        return bool(self.frames) or not self.columns


def row_elements(groups: tuple[RowGroup, ...]) -> list[RowElement]:
    """All elements in the order of their rows."""
    each = [RowElement(group, k) for group in groups for k in range(len(group.names))]
    return sorted(each, key=lambda element: element.places)


def drives(groups: tuple[RowGroup, ...]) -> list[RowElement]:
    """The elements that prescribe a coordinate."""
    return [element for element in row_elements(groups) if element.group.law.prescribes]


def groups_without(groups: tuple[RowGroup, ...], gone: Container[str], kept: np.ndarray) -> tuple[RowGroup, ...]:
    """The groups without the elements of some names.  Args: kept: mask (rows,) of all rows, of those that stay."""
    number = np.cumsum(kept) - 1
    left = (group.without(gone, number) for group in groups)
    return tuple(group for group in left if group is not None)


def coupled_joint_mask(topology, by_column):
    """Boolean mask (joints,) of the joints that a row couples and those between them; none for a single one.

    These carry the contact forces of a coupler: teeth, threads, cams.  Args: by_column (nv,): mask of its velocities.
    """
    joints = len(topology.joints)
    joint_of = np.arange(joints)[:, None] == np.array(topology.node_joint, int)[None]
    tied = (joint_of.astype(float) @ by_column.astype(float)) > 0
    of_body = np.eye(joints)[list(topology.body_joint)]  # the tree's joint of each body
    below = of_body.T @ topology.bodies.path.T @ of_body  # how many bodies of the one joint hang on the other
    count, number = below @ tied.astype(float), tied.astype(float).sum()
    return (number > 1) & (count > 0) & ((count < number) | tied)


def coupled_names(topology, columns: tuple[int, ...]) -> tuple[str, ...]:
    """Names of the joints of `coupled_joint_mask`, for a row of these velocities."""
    tied = coupled_joint_mask(topology, np.isin(np.arange(topology.num_velocities), columns))
    return tuple(joint.name for joint, each in zip(topology.joints, tied, strict=True) if each)
