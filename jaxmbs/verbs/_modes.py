"""`modes`: modes of vibration."""

from typing import Any

from .. import analysis, vibration
from ._dispatch import dispatch


@dispatch(lambda: analysis.modes, lambda: vibration.modes)
def modes(system: Any, *args: Any, **options: Any) -> Any:
    """Modes of vibration: of a mechanism about a state, or of a linear system."""
