"""`modes`: modes of vibration."""

from collections.abc import Sequence
from typing import Any, overload

from ..analysis._linearisation import Linearisation
from ..analysis._mechanism_modes import modes as mechanism_modes
from ..assembly._state import State
from ..linear._system import LinearSystem
from ..model._system import System
from ..vibration._modes import Modes
from ..vibration._system_analysis import modes as linear_modes
from ._dispatch import dispatch


@overload
def modes(mechanism: Linearisation | System, state: State | None = None, without: Sequence[str] = ()) -> Modes: ...


@overload
def modes(system: LinearSystem, num: int | None = None, damped: bool | None = None) -> Modes: ...


@dispatch(mechanism_modes, linear_modes)
def modes(system: Any, *args: Any, **options: Any) -> Any:
    """Modes of vibration: of a mechanism about a state, or of a linear system."""
