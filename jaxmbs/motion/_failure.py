"""The likely cause of a failed motion, in words; on the host, for the message of an error."""

from typing import Any

import numpy as np

from ..constraints._constraint_rows import constraint_jacobian, constraint_residual
from ..dynamics._validity import validity
from ..model._system import System
from ..ode._failure import describe_end, mean_step
from ..status import Status
from ._infinite_rates import describe_infinite_rates
from ._motion import Motion
from ._stiffest_mode import describe_stiffest_mode

#: Ends that a rate of an internal state that is not finite, or grows without bound, may have.
_MAY_BE_RATES = (Status.MAX_STEPS, Status.STEP_SIZE, Status.NOT_FINITE, Status.FAILED)
_OPEN = 1e-6  # residual [m, rad] that counts as open: that of `_accounts.CLOSED`
_SINGULAR = 1e-4  # singular value of unit rows, over the largest: joint axes parallel to a ten-thousandth of a radian
_SHARE = 0.1  # entry of a unit singular vector above which a joint has part in the lost rank


def explain(system: System, motion: Motion, t0: float, solver: Any = None) -> str:
    """The end of one failed motion and its likely cause: joints whose constraints are open or singular there, or the
    stiffest mode where steps ran out.

    Args: t0: the time of its start [s]; solver: which advice does not name again.
    """
    end, num_steps = motion.end, motion.diagnostics.num_steps
    text = describe_end(motion.status, t0, end.t, _saved(motion), num_steps)
    if np.ndim(end.t):
        return text
    if motion.status in (Status.MAX_STEPS, Status.STEP_SIZE):
        text += describe_stiffest_mode(system, end, mean_step(t0, end.t, num_steps), solver)
    if motion.status in _MAY_BE_RATES and system.topology.internal:
        text += describe_infinite_rates(system, motion, mean_step(t0, end.t, num_steps))
    if motion.status == Status.VALIDITY:
        faults = validity(system, motion.states).faults() or validity(system, end).faults()
        text += f": {'; '.join(faults)}"
    if not (system.has_constraints and np.isfinite(end.coordinates).all()):
        return text
    open_rows, singular = _open(system, end), _singular(system, end)
    if open_rows:
        text += f"; open there: {', '.join(open_rows)}"
    if singular:
        text += f"; the pose is singular for: {', '.join(singular)}"
    return text


def _saved(motion):
    """Times of the saved states with finite numbers."""
    psi, u, ts = (np.asarray(x) for x in (motion.states.coordinates, motion.states.velocities, motion.ts))
    return ts[np.isfinite(ts) & np.isfinite(psi).all(1) & np.isfinite(u).all(1)]


def _open(system, state):
    """Names of joints and constraints whose position rows are open, worst first."""
    f = np.abs(np.asarray(constraint_residual(system, state)))
    names = np.array(system.topology.row_joint)[system.topology.position_rows]
    order = [k for k in np.argsort(-f) if f[k] > _OPEN]
    return list(dict.fromkeys(str(names[k]) for k in order))


def _singular(system, state):
    """Names of joints whose constraint rows lost rank against the count at build."""
    top = system.topology
    A = np.asarray(constraint_jacobian(system, state))
    if not np.isfinite(A).all():
        return []
    A = A / np.maximum(np.linalg.norm(A, axis=1, keepdims=True), 1e-12)
    U, s, _ = np.linalg.svd(A, full_matrices=False)
    lost = [k for k in range(min(top.analysis.rank, len(s))) if s[k] < _SINGULAR * s[0]]
    share = np.max(np.abs(U[:, lost]), axis=1, initial=0.0)
    return list(dict.fromkeys(name for name, x in zip(top.row_joint, share, strict=True) if x > _SHARE))
