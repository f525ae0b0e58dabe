"""Friction in joints, fed by the loads that the joints carry: parameters and places of all rubbing joints."""

import equinox as eqx
from jaxtyping import Array, Float

from ..errors import ModelError


class JointFriction(eqx.Module):
    """Rubbing surfaces of a system, their parameters stacked: one of each joint, two of a universal joint.

    Attributes:
        names: of the surfaces, those of the friction elements; joints: index of each joint.
        kinds: key of each surface's geometry in `dynamics._friction_surfaces`.
        axes, points: frames whose axes and whose origin each surface has; parents, children: frames of the joint.
        basis: (n, 3, 3) from the surface's axes, z along its own axis, to those of its frame.
        mu, static_ratio: sliding coefficient, and breakaway over sliding friction.
        radius: at which a rotation rubs [m]; length: between the two ends of the bearing [m].
        preload: load that is there without any other [N]; transition_speed: below which the surface creeps [m/s].
        pitch: advance of a screw [m/rad], zero for all others.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    joints: tuple[int, ...] = eqx.field(static=True)
    kinds: tuple[str, ...] = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True)
    points: tuple[int, ...] = eqx.field(static=True)
    parents: tuple[int, ...] = eqx.field(static=True)
    children: tuple[int, ...] = eqx.field(static=True)
    basis: Float[Array, "n 3 3"]
    mu: Float[Array, " n"]
    static_ratio: Float[Array, " n"]
    radius: Float[Array, " n"]
    length: Float[Array, " n"]
    preload: Float[Array, " n"]
    transition_speed: Float[Array, " n"]
    pitch: Float[Array, " n"]


def refuse_friction(system, what: str, instead: str) -> None:
    """Raises: ModelError for a system whose joints rub."""
    if system.friction is not None:
        names = ", ".join(map(repr, system.friction.names))
        raise ModelError([f"{what}: no answer with friction in joints ({names}); {instead}"], what="the question")
