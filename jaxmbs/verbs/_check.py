"""`check`: a report on a model."""

from typing import Any, overload

from ..linear._check import Check
from ..linear._check import check as linear_check
from ..linear._system import LinearSystem
from ..model._entry_points import check_system
from ..model._system import System
from ..typing import ArrayLike
from ._dispatch import dispatch


def describe(system: System) -> str:
    """Bodies, joints, loops, freedoms and redundant constraints of a mechanism, as text."""
    check_system(system)
    return system.describe()


@overload
def check(system: System) -> str: ...


@overload
def check(
    system: LinearSystem, about: ArrayLike = (0.0, 0.0, 0.0), tolerance: float = 1e-6, throw: bool = False
) -> Check: ...


@dispatch(describe, linear_check)
def check(system: Any, *args: Any, **options: Any) -> Any:
    """Report on a model: the freedoms and constraints of a mechanism, or the faults of a linear system's matrices."""
