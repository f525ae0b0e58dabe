"""`random_response`: the response to stationary random inputs."""

from typing import Any

from .. import qualification
from ..qualification._state_response import random_response_of_measured, random_response_of_mechanism
from ._dispatch import dispatch


@dispatch(
    lambda: random_response_of_mechanism,
    lambda: qualification.random_response,
    lambda: random_response_of_measured,
)
def random_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to stationary random inputs: RMS, spectra and rates of motions and loads, by name."""
