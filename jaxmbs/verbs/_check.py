"""`check`: a report on a model."""

from typing import Any

from ..linear._check import check as linear_check
from ..model._entry_points import check_system
from ..model._system import System
from ._dispatch import dispatch


def describe(system: System) -> str:
    """Bodies, joints, loops, freedoms and redundant constraints of a mechanism, as text."""
    check_system(system)
    return system.describe()


@dispatch(describe, linear_check)
def check(system: Any, *args: Any, **options: Any) -> Any:
    """Report on a model: the freedoms and constraints of a mechanism, or the faults of a linear system's matrices."""
