"""`frequency_response`: the response to harmonic inputs."""

from typing import Any

from ..analysis._linearise import frequency_response as mechanism_response
from ..coupling._measured_network import MeasuredNetwork
from ..vibration._system_analysis import frequency_response as linear_response
from ._dispatch import dispatch


@dispatch(mechanism_response, linear_response, MeasuredNetwork.frequency_response)
def frequency_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to harmonic inputs by frequency: of a linearised mechanism, or of a linear system."""
