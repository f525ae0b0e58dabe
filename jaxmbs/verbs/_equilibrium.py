"""`equilibrium`: rest under constant forces."""

from typing import Any

from .. import analysis, linear
from ._dispatch import dispatch


@dispatch(lambda: analysis.equilibrium, lambda: linear.equilibrium)
def equilibrium(system: Any, *args: Any, **options: Any) -> Any:
    """Static equilibrium: of a mechanism near a state, or of a linear system under forces."""
