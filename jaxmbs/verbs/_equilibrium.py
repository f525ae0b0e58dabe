"""`equilibrium`: rest under constant forces."""

from typing import Any

from ..analysis._equilibrium import equilibrium as mechanism_equilibrium
from ..linear._static_response import equilibrium as linear_equilibrium
from ._dispatch import dispatch


@dispatch(mechanism_equilibrium, linear_equilibrium)
def equilibrium(system: Any, *args: Any, **options: Any) -> Any:
    """Static equilibrium: of a mechanism near a state, or of a linear system under forces."""
