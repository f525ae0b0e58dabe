"""`modes`: modes of vibration."""

from typing import Any

from ..analysis._mechanism_modes import modes as mechanism_modes
from ..vibration._system_analysis import modes as linear_modes
from ._dispatch import dispatch


@dispatch(mechanism_modes, linear_modes)
def modes(system: Any, *args: Any, **options: Any) -> Any:
    """Modes of vibration: of a mechanism about a state, or of a linear system."""
