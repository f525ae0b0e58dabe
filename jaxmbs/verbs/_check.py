"""`check`: a report on a model, and on a motion beside the limits of its joints."""

from collections.abc import Mapping
from typing import Any

from .. import linear
from ..errors import ModelError
from ..joints._limits import JointLimits
from ..model._entry_points import check_system
from ..model._system import System
from ..motion._joint_limits import JointUse, joint_use
from ..motion._motion import Motion
from ..reaction._result import Reactions
from ._dispatch import dispatch


def describe(
    system: System,
    motion: Motion | None = None,
    limits: Mapping[str, JointLimits] | None = None,
    efforts: Reactions | Mapping[str, Any] | None = None,
) -> str | JointUse:
    """Bodies, joints, loops, freedoms and redundant constraints of a mechanism, as text; with a motion and limits of
    joints (`mbs.io.read_urdf(...).limits`) a `motion.JointUse`: what the motion makes of them.

    Args: efforts: reactions of the motion, or (T,) by joint, for limits of effort.
    """
    check_system(system)
    if motion is None and limits is None:
        return system.describe()
    if motion is None or limits is None:
        raise ModelError(["limits of joints are checked along a motion: give both motion= and limits="], "the check")
    return joint_use(system, motion, limits, efforts)


@dispatch(lambda: describe, lambda: linear.check)
def check(system: Any, *args: Any, **options: Any) -> Any:
    """Report on a model: the freedoms and constraints of a mechanism, or the faults of a linear system's matrices."""
