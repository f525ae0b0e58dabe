"""`random_response`: the response to stationary random inputs."""

from collections.abc import Mapping
from typing import Any, overload

from ..analysis._linearisation import Linearisation
from ..coupling._measured_network import MeasuredNetwork
from ..linear._system import LinearSystem
from ..qualification._random_response import RandomResponse
from ..qualification._random_response import random_response as linear_random
from ..qualification._state_response import random_response_of_measured, random_response_of_mechanism
from ..typing import ArrayLike
from ._dispatch import dispatch


@overload
def random_response(
    system: LinearSystem,
    inputs: Mapping[str, Any],
    out: Any,
    coherence: Mapping | None = None,
    ratios: ArrayLike | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
    order: int = 24,
) -> RandomResponse: ...


@overload
def random_response(
    linearisation: Linearisation, inputs: Mapping[str, Any], coherence: Mapping | None = None, order: int = 24
) -> RandomResponse: ...


@overload
def random_response(
    network: MeasuredNetwork,
    inputs: Mapping[str, Any],
    out: Any,
    coherence: Mapping | None = None,
    loss: ArrayLike = 0.0,
    tolerance: float = 0.02,
    **regular: Any,
) -> RandomResponse: ...


@dispatch(random_response_of_mechanism, linear_random, random_response_of_measured)
def random_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to stationary random inputs: RMS, spectra and rates of motions and loads, by name."""
