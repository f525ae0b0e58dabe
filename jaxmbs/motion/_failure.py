"""Which joints a failed motion points at, in words; on the host, for the message of an error."""

import numpy as np

from ..kinematics._constraint_rows import constraint_jacobian, constraint_residual
from ..model._system import System
from ..status import Status
from ._motion import Motion
from ._stiffest_mode import fastest_motion

_OPEN = 1e-6  # residual that counts as open
_SINGULAR = 1e-4  # singular value over the largest that counts as lost


def explain(system: System, motion: Motion, t0: float) -> str:
    """The status of one failed motion with its time, and what stands behind it there: joints whose constraints are
    open or singular, or the fastest motion where steps ran out.

    Args: t0: the time of its start [s].
    """
    text = f"the motion failed: {motion.status}"
    end = motion.end
    if np.ndim(end.t):
        return text
    text += f"; it reached t = {float(end.t):.6g} s"
    saved = _saved(motion)
    if len(saved):
        text += f", last saved state at t = {saved[-1]:.4g} s"
    if motion.status in (Status.MAX_STEPS, Status.STEP_SIZE):
        taken = max(int(motion.diagnostics.num_steps), 1)
        step = (float(end.t) - t0) / taken
        text += f", by {taken} steps of {step:.2g} s in the mean" + fastest_motion(system, end, step)
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
    return list(dict.fromkeys(name for name, x in zip(top.row_joint, share, strict=True) if x > 0.1))
