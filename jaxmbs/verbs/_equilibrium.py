"""`equilibrium`: rest under constant forces."""

from collections.abc import Iterable, Mapping
from typing import Any, overload

from ..analysis._equilibrium import equilibrium as mechanism_equilibrium
from ..analysis._equilibrium_result import Equilibrium
from ..assembly._state import State
from ..linear._static_response import StaticResponse
from ..linear._static_response import equilibrium as linear_equilibrium
from ..linear._system import LinearSystem
from ..model._system import System
from ..typing import ArrayLike
from ._dispatch import dispatch


@overload
def equilibrium(
    system: System,
    state: State,
    moving: Iterable[str] = (),
    throw: bool = True,
    held: Iterable[str] = (),
    follow: bool | None = None,
) -> Equilibrium: ...


@overload
def equilibrium(system: LinearSystem, forces: Mapping | ArrayLike, free: bool = False) -> StaticResponse: ...


@dispatch(mechanism_equilibrium, linear_equilibrium)
def equilibrium(system: Any, *args: Any, **options: Any) -> Any:
    """Static equilibrium: of a mechanism near a state, or of a linear system under forces."""
