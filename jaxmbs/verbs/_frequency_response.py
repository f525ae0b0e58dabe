"""`frequency_response`: the response to harmonic inputs."""

from collections.abc import Iterable, Sequence
from typing import Any, overload

from ..analysis._linearisation import Linearisation
from ..analysis._linearise import frequency_response as mechanism_response
from ..blocks import StateSpace
from ..coupling._measured_network import MeasuredNetwork
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..typing import AnyArray, ArrayLike, CoordinateLike
from ..vibration._system_analysis import frequency_response as linear_response
from ._dispatch import dispatch


@overload
def frequency_response(
    space: StateSpace | Linearisation,
    omega: ArrayLike,
    into: Iterable[CoordinateLike] | None = None,
    out: Iterable[CoordinateLike] | None = None,
) -> AnyArray | TransferFunctions: ...


@overload
def frequency_response(
    system: LinearSystem,
    omega: ArrayLike,
    into: Iterable[CoordinateLike],
    out: Iterable[CoordinateLike],
    method: str = "direct",
    loss: ArrayLike = 0.0,
    **options: Any,
) -> TransferFunctions: ...


@overload
def frequency_response(
    network: MeasuredNetwork, omega: ArrayLike, into: Sequence, out: Sequence, loss: ArrayLike = 0.0, **regular: Any
) -> TransferFunctions: ...


@dispatch(mechanism_response, linear_response, MeasuredNetwork.frequency_response)
def frequency_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to harmonic inputs by frequency: of a linearised mechanism, or of a linear system."""
