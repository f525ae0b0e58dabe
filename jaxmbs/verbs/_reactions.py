"""`reactions`: loads of joints, or of bonds."""

from typing import Any

from ..coupling._measured_network import MeasuredNetwork
from ..coupling._network import reactions as network_reactions
from ..reaction._solve import reactions as mechanism_reactions
from ._dispatch import dispatch


@dispatch(mechanism_reactions, network_reactions, MeasuredNetwork.reactions)
def reactions(system: Any, *args: Any, **options: Any) -> Any:
    """Reactions: of a mechanism's joints at states or along a motion, or of the bonds of a network of components."""
