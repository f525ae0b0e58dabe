"""`simulate`: motion in time."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, overload

from ..assembly._state import State
from ..linear._static_response import StaticResponse
from ..linear._system import LinearSystem
from ..model._system import System
from ..motion._event import EventLike
from ..motion._formulation import Formulation
from ..motion._motion import Motion
from ..motion._simulate import simulate as mechanism_simulate
from ..typing import AnyArray, ArrayLike, WordedError
from ..vibration._linear_motion import CoordinateLaw, LinearMotion, LinearState
from ..vibration._transient import simulate as linear_simulate
from ._dispatch import dispatch


@overload
def simulate(
    system: System,
    state: State,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: Any = "reverse",
    formulation: str | type[Formulation] | None = None,
    event: WordedError[EventLike | Sequence[EventLike] | None] = None,
    interpolate: bool = False,
    loop: str = "jaxmbs",
    max_steps: int = 100_000,
    max_events: int = 64,
    progress: bool = False,
    throw: bool = True,
) -> Motion: ...


@overload
def simulate(
    system: LinearSystem,
    start: StaticResponse | LinearState | tuple | None = None,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    *,
    forces: Mapping | Callable | AnyArray | None = None,
    laws: Sequence[CoordinateLaw] = (),
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: Any = "reverse",
    event: WordedError[Callable | None] = None,
    interpolate: bool = False,
    max_steps: int = 100_000,
    progress: bool = False,
    throw: bool = True,
) -> LinearMotion: ...


@dispatch(mechanism_simulate, linear_simulate)
def simulate(system: Any, *args: Any, **options: Any) -> Any:
    """Motion in time: of a mechanism from a state on, or of a linear system under forces."""
