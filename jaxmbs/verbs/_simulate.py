"""`simulate`: motion in time."""

from typing import Any

from .. import motion, vibration
from ._dispatch import dispatch


@dispatch(lambda: motion.simulate, lambda: vibration.simulate)
def simulate(system: Any, *args: Any, **options: Any) -> Any:
    """Motion in time: of a mechanism from a state on, or of a linear system under forces."""
