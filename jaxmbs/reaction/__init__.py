"""Reactions of mechanisms: loads of every joint, drive and constraint row, and the efforts that a motion needs."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._bonds import reaction_bonds
    from ._inverse_dynamics import Actuation, inverse_dynamics
    from ._result import DriveLoad, JointReaction, LawForce, Reactions, RowLoad
    from ._solve import reactions

__all__ = [
    "Actuation",
    "DriveLoad",
    "JointReaction",
    "LawForce",
    "Reactions",
    "RowLoad",
    "inverse_dynamics",
    "reaction_bonds",
    "reactions",
]

import_when_asked(__name__, explain_arguments)
