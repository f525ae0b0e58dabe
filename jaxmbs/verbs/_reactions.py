"""`reactions`: loads of joints, or of bonds."""

from typing import Any

from .. import coupling, reaction
from ._dispatch import dispatch


@dispatch(lambda: reaction.reactions, lambda: coupling.reactions, lambda: coupling.MeasuredNetwork.reactions)
def reactions(system: Any, *args: Any, **options: Any) -> Any:
    """Reactions: of a mechanism's joints at states or along a motion, or of the bonds of a network of components."""
