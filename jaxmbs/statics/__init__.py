"""Reactions of networks of rigid bodies: trees by sums, loops by parameters or nodes, redundancy named."""

from .bonds import Bonds
from .family import ReactionFamily, reaction_family
from .indeterminacy import Redundancy, redundancy, with_redundancy
from .matrix import ReactionMatrix, reaction_matrix
from .network import Network
from .solve import BondReaction, BondReactions, bond_reactions

__all__ = [
    "BondReaction",
    "BondReactions",
    "Bonds",
    "Network",
    "ReactionFamily",
    "ReactionMatrix",
    "Redundancy",
    "bond_reactions",
    "reaction_family",
    "reaction_matrix",
    "redundancy",
    "with_redundancy",
]
