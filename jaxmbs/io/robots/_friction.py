"""Friction losses of joints and tendons: a force that follows no load, with a transition through rest."""

from ...builder import SystemBuilder
from ...forces import FrictionForce
from ...friction import SmoothCoulomb


def friction_law(loss: float) -> FrictionForce:
    """A loss [N or N m] as smooth Coulomb friction of its default transition speed."""
    return FrictionForce(SmoothCoulomb(loss))


def add_friction(builder: SystemBuilder, losses: dict[str, float], mode: str) -> list[str]:
    """A force "joint.friction" for each joint with a loss; the names of those that are left out."""
    if mode == "ignore":
        return list(losses)
    for joint, loss in losses.items():
        builder.force(f"{joint}.friction", friction_law(loss), joint=joint)
    return []
