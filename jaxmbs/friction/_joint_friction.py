"""Friction in joints, fed by the loads that the joints carry: parameters and places of all rubbing joints."""

from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from ..errors import ModelError
from ._groups import Groups
from ._surfaces import SURFACES


class JointFriction(eqx.Module):
    """Rubbing surfaces of a system, their numbers stacked: one of each joint, two of a universal joint.

    Attributes:
        names: of the surfaces, those of the friction elements; joints: index of each joint.
        kinds: key of each surface's geometry in `_surfaces`.
        axes, points: frames whose axes and whose origin each surface has; parents, children: frames of the joint.
        models: the models of all surfaces.
        basis: (n, 3, 3) from the surface's axes, z along its own axis, to those of its frame.
        radius: at which a rotation rubs [m]; length: between the two ends of the bearing [m].
        preload: load that is there without any other [N].
        pitch: advance of a screw [m/rad], zero for all others.
        is_shared: true where redundant constraints leave the load of a surface open: by least compliance it is
            shared.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    joints: tuple[int, ...] = eqx.field(static=True)
    kinds: tuple[str, ...] = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True)
    points: tuple[int, ...] = eqx.field(static=True)
    parents: tuple[int, ...] = eqx.field(static=True)
    children: tuple[int, ...] = eqx.field(static=True)
    models: Groups
    basis: Float[Array, "n 3 3"]
    radius: Float[Array, " n"]
    length: Float[Array, " n"]
    preload: Float[Array, " n"]
    pitch: Float[Array, " n"]
    is_shared: bool = eqx.field(static=True, default=False)

    @property
    def bristle_sizes(self) -> tuple[int, ...]:
        """Components of the slip of each surface with bristles, zero for all others."""
        bristly = {k for group in self.models if group.model.has_bristles for k in group.surfaces}
        return tuple(len(SURFACES[kind].slips) if k in bristly else 0 for k, kind in enumerate(self.kinds))

    @property
    def groups(self) -> tuple["BristleGroup", ...]:
        """The surfaces with bristles."""
        return tuple(
            BristleGroup((name,), (("bristle", () if size == 1 else (size,), "m"),))
            for name, size in zip(self.names, self.bristle_sizes, strict=True)
            if size
        )


class BristleGroup(NamedTuple):
    """A surface with bristles as the layout of internal states takes it: names and (name, shape, unit) of states."""

    names: tuple[str, ...]
    internal: tuple[tuple[str, tuple[int, ...], str], ...]


def bristle_groups(friction) -> tuple[BristleGroup, ...]:
    """Surfaces with bristles of the friction of a system, none where it has none."""
    return () if friction is None else friction.groups


def refuse_friction(system, what: str, instead: str) -> None:
    """Raises: ModelError for a system whose joints rub."""
    if system.friction is not None:
        names = ", ".join(
            f"{system.topology.joints[j].name!r} by {name!r}"
            for j, name in zip(system.friction.joints, system.friction.names, strict=True)
        )
        raise ModelError([f"{what}: no answer with friction in joints ({names}); {instead}"], what="the question")


def without_friction(system):
    """The system whose joints do not rub."""
    return system if system.friction is None else eqx.tree_at(lambda s: s.friction, system, None)
