"""`reactions`: loads of joints, or of bonds."""

from collections.abc import Mapping, Sequence
from typing import Any, overload

from ..assembly._state import HasStates, State
from ..coupling._bond_loads import BondLoads
from ..coupling._measured_network import MeasuredNetwork
from ..coupling._network import reactions as network_reactions
from ..linear._static_response import StaticResponse
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..model._system import System
from ..reaction._result import Reactions
from ..reaction._solve import reactions as mechanism_reactions
from ..typing import ArrayLike
from ..vibration._harmonic_response import HarmonicResponse
from ..vibration._linear_motion import LinearMotion
from ._dispatch import dispatch


@overload
def reactions(
    system: System,
    motion: State | HasStates,
    frame: str = "world",
    side: str = "child",
    compliance: Mapping | None = None,
    method: str = "auto",
    accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None,
    actuators: Sequence[str] | None = None,
) -> Reactions: ...


@overload
def reactions(network: LinearSystem, answer: LinearMotion | StaticResponse | HarmonicResponse) -> BondLoads: ...


@overload
def reactions(
    network: MeasuredNetwork, response: TransferFunctions, loss: ArrayLike = 0.0, **regular: Any
) -> BondLoads: ...


@dispatch(mechanism_reactions, network_reactions, MeasuredNetwork.reactions)
def reactions(system: Any, *args: Any, **options: Any) -> Any:
    """Reactions: of a mechanism's joints at states or along a motion, or of the bonds of a network of components."""
