"""Reactions of networks of rigid bodies: trees by sums, loops by parameters or nodes, redundancy named."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._bonds import Bonds
    from ._indeterminacy import Redundancy, redundancy, with_redundancy
    from ._network import BodyNetwork
    from ._reaction_family import ReactionFamily, reaction_family
    from ._reaction_matrix import ReactionMatrix, reaction_matrix
    from ._solve import BondReaction, BondReactions, bond_reactions

__all__ = [
    "BodyNetwork",
    "BondReaction",
    "BondReactions",
    "Bonds",
    "ReactionFamily",
    "ReactionMatrix",
    "Redundancy",
    "bond_reactions",
    "reaction_family",
    "reaction_matrix",
    "redundancy",
    "with_redundancy",
]

import_when_asked(__name__, explain_arguments)
