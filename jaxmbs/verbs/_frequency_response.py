"""`frequency_response`: the response to harmonic inputs."""

from typing import Any

from .. import analysis, coupling, vibration
from ._dispatch import dispatch


@dispatch(
    lambda: analysis.frequency_response,
    lambda: vibration.frequency_response,
    lambda: coupling.MeasuredNetwork.frequency_response,
)
def frequency_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to harmonic inputs by frequency: of a linearised mechanism, or of a linear system."""
