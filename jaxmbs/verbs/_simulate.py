"""`simulate`: motion in time."""

from typing import Any

from ..motion._simulate import simulate as mechanism_simulate
from ..vibration._transient import simulate as linear_simulate
from ._dispatch import dispatch


@dispatch(mechanism_simulate, linear_simulate)
def simulate(system: Any, *args: Any, **options: Any) -> Any:
    """Motion in time: of a mechanism from a state on, or of a linear system under forces."""
