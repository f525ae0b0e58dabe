"""Jam of the friction in joints as the cause of a failed motion; on the host, by a program of its own."""

import numpy as np
from jax import Array

from ..assembly._state import State
from ..checks import is_concrete
from ..dynamics._newton_euler import motion_with_friction
from ..friction._normal_loads import spectral_radius
from ..kinematics._configuration import at_state, with_velocities
from ..model._changes import with_changes
from ..model._internal_states import replace_field
from ..model._system import System
from ..runtime import jit
from ..status import Status
from ._motion import Motion

#: Ends that a jam may have: no step gets through it.
_MAY_BE_JAMS = (Status.STEP_SIZE, Status.NOT_FINITE, Status.INCONSISTENT, Status.FAILED, Status.MAX_STEPS)
#: Contraction of the loads at the end from which it counts as jammed: loads grow there as 1 / (1 - contraction), so
#: that no step reaches it.
_NEARLY_JAMMED = 0.9


def with_jam(system: System, motion: Motion) -> Motion:
    """The motion, with the status JAMMED where it failed at a state whose friction has no unique loads, or nearly
    none; within a trace the motion itself."""
    if system.friction is None or not is_concrete(motion.result, motion.end):
        return motion
    if int(np.asarray(motion.result)) not in map(int, _MAY_BE_JAMS):
        return motion
    if float(_contraction(with_changes(system, motion.end), motion.end)) < _NEARLY_JAMMED:
        return motion
    return replace_field(motion, "result", np.asarray(motion.result).dtype.type(int(Status.JAMMED)))


@jit
def _contraction(system: System, end: State) -> Array:
    """Spectral radius () of the derivative of the loads by the loads at a state; NaN where there is none."""
    at = with_velocities(system, at_state(system, end), end.velocities)
    return spectral_radius(motion_with_friction(system, at).loads.slope)
