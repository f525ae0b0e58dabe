"""Reactions of networks of rigid bodies: trees by sums, loops by parameters or nodes, redundancy named."""

from .bonds import Bonds as Bonds
from .family import ReactionFamily as ReactionFamily
from .family import reaction_family as reaction_family
from .matrix import ReactionMatrix as ReactionMatrix
from .matrix import reaction_matrix as reaction_matrix
from .network import Network as Network
from .redundancy import Redundancy as Redundancy
from .redundancy import redundancy as redundancy
from .redundancy import with_redundancy as with_redundancy
from .solve import BondReaction as BondReaction
from .solve import BondReactions as BondReactions
from .solve import bond_reactions as bond_reactions
