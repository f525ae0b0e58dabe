"""Freedoms, redundancy and the independent set, counted on the host at several assembled poses."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import scipy.linalg

from ..checks import no_such
from ..errors import ModelError
from ..joints.base import HALF_TURN
from ..kinematics import constraints
from ..kinematics.evaluate import evaluate, moved
from ..kinematics.poses import neutral_coordinates
from ..math.host import as_array
from ..model.system import System
from ..model.topology import Mobility

_POSES = 4
_RANK = {8: 1e-7, 4: 1e-3}  # singular values that count as zero, by precision
_CLOSED = {8: 1e-9, 4: 1e-4}  # residuals that count as closed
_HALF_TURN_OFF = 1e-4  # relative: about a degree
_INERTIA = {8: 1e-13, 4: 1e-6}  # relative inertia that counts as none


def _precision():
    return jnp.result_type(float)


def analyse(system: System, independent=None) -> tuple[Mobility, float]:
    """Mobility of a concrete system, see `Mobility`, and its characteristic length [m].

    Raises: ModelError when the loops cannot be closed, when a joint can move without inertia, or when the user's
    independent set does not determine the motion.
    """
    top, random = system.topology, np.random.default_rng(7)
    psi, t = neutral_coordinates(top).astype(_precision()), np.zeros((), _precision())
    x = evaluate(system, psi, t).positions
    length = float(np.max(np.linalg.norm(x - x.mean(0)[None], axis=1))) or 1.0
    weight = np.where(top.spins > 0, 1.0, length)
    psi = _close(system, psi, t, weight, random)
    best, fault = None, None
    for _ in range(_POSES):
        rows = evaluate(system, psi, t)
        A, B, M = rows.A, rows.reactions, rows.M
        rank, Z, Y = _spaces(A * weight[None], length)
        found = _inertia_fault(top, M, Z, weight)
        if best is None or rank > best[0]:
            best, fault = (rank, Z, Y, B, _spaces((A * weight[None])[top.position_rows], length)[1]), found
        elif rank == best[0]:  # one pose with inertia will do
            fault = fault and found
        if not top.num_rows and fault is None:
            break
        psi = _elsewhere(system, psi, t, Z, weight, random)
    if fault:
        raise ModelError([fault])
    rank, Z, Y, B, Z_positions = best
    chosen = _independent(top, Z, independent)
    undetermined, names = _undetermined(constraints.carriers(system), B, Y, length)
    positions = _extended(Z_positions, chosen)
    return Mobility(rank, top.num_rows, top.num_velocities, chosen, undetermined, names, positions), length


def check_numbers(system: System) -> None:
    """ModelError if the loops of a concrete system cannot be closed, or a joint can move without inertia."""
    top, random = system.topology, np.random.default_rng(7)
    weight, t = np.ones(top.num_velocities), np.zeros((), _precision())
    psi, fault = _close(system, neutral_coordinates(top).astype(_precision()), t, weight, random), None
    for _ in range(_POSES):
        rows = evaluate(system, psi, t)
        Z = _spaces(rows.A, 1.0)[1]
        fault = _inertia_fault(top, rows.M, Z, weight)
        if fault is None:
            return
        psi = _elsewhere(system, psi, t, Z, weight, random)
    raise ModelError([fault])


def _elsewhere(system, psi, t, Z, weight, random):
    """Another closed pose, some way along the motions Z."""
    move = weight * (Z @ random.normal(size=Z.shape[1]) * 0.3)
    return _newton(system, moved(system.topology, psi, move), t, weight)[0]


def _spaces(A, length):
    """Rank, null space of A (columns) and of A^T.

    Rows are of the size of 1 (angles) or of the model's length [m]; where all cancel, rounding is no rank.
    """
    if A.shape[0] == 0:
        return 0, np.eye(A.shape[1]), np.zeros((0, 0))
    U, s, Vt = np.linalg.svd(A)
    rank = int(np.sum(s > _RANK[_precision().itemsize] * max(s[0], 1e-3 * min(1.0, length)))) if s.size else 0
    return rank, Vt[rank:].T, U[:, rank:]


def _newton(system, psi, t, weight, iterations=60):
    """Least-squares Newton from psi with damping: (coordinates, largest residual)."""
    top, damping = system.topology, 1e-3
    f, A, *_ = evaluate(system, psi, t)
    for _ in range(iterations):
        cost = float(np.dot(f, f))
        if not np.isfinite(cost) or cost < 1e-24:
            break
        J = np.asarray(A)[top.position_rows] * weight[None]
        step = (
            -weight
            * np.linalg.lstsq(
                np.vstack([J, np.sqrt(damping) * np.eye(J.shape[1])]), np.r_[f, np.zeros(J.shape[1])], rcond=None
            )[0]
        )
        trial = moved(top, psi, step)
        g, B, *_ = evaluate(system, trial, t)
        if float(np.dot(g, g)) < cost:
            psi, f, A, damping = trial, g, B, max(damping * 0.05, 1e-15)
        else:
            damping *= 10
            if damping > 1e8:
                break
    return psi, float(np.max(np.abs(np.asarray(f)), initial=0.0))


def _close(system, psi, t, weight, random):
    """An assembled pose near the neutral one; ModelError when none is found."""
    top = system.topology
    if not top.num_rows:
        return psi
    start = psi
    _refuse_half_turns(system, evaluate(system, psi, t).f)
    for _ in range(25):
        found, error = _newton(system, psi, t, weight)
        if error < _CLOSED[_precision().itemsize]:
            return found
        psi = moved(top, start, weight * random.normal(size=top.num_velocities))
    f, least = np.abs(evaluate(system, found, t).f), _CLOSED[_precision().itemsize]
    open_rows = sorted({top.row_joint[k] for k, value in zip(top.position_rows, f, strict=True) if not value < least})
    raise ModelError(
        [
            f"the loops cannot be closed; still open (largest residual {error:.3g}): {', '.join(open_rows)}; "
            "check the joint frames and link lengths"
        ]
    )


def _refuse_half_turns(system, f):
    """ModelError where the frames of a closing joint stand half a turn apart in the reference pose."""
    faults, first = [], 0
    for group in system.closures:
        units = group.kind.row_units[: group.kind.num_rows - group.kind.num_slips]
        turns = np.array([unit == "rad" for unit in units], bool)
        rows = f[first : first + len(group.names) * len(turns)].reshape(len(group.names), len(turns))
        first += rows.size
        for name, angle in zip(group.names, np.linalg.norm(rows[:, turns], axis=1), strict=True):
            if angle > HALF_TURN * (1.0 - _HALF_TURN_OFF):
                turn = np.rad2deg(np.arccos(1.0 - min(angle, HALF_TURN) / 2.0))
                faults.append(
                    f"joint {name!r}: in the reference pose its frames stand half a turn ({turn:.4f} degrees) from "
                    "closed; turn one of them by half a turn (rotation of parent_frame or child_frame)"
                )
    if faults:
        raise ModelError(faults)


def _inertia_fault(top, M, Z, weight):
    """What is wrong where a motion among Z moves no inertia; else None."""
    reduced = (Z * weight[:, None]).T @ M @ (Z * weight[:, None])
    if reduced.size == 0:
        return None
    values, vectors = np.linalg.eigh(reduced)
    if values[0] > _INERTIA[_precision().itemsize] * max(values[-1], 1e-300) and values[-1] > 0:
        return None
    mode = np.abs(Z @ vectors[:, 0])
    names = sorted({top.column_joint_name[k] for k in np.nonzero(mode > 0.1 * mode.max())[0]})
    return f"a motion of joint(s) {', '.join(names)} moves no inertia: give the bodies there mass or inertia"


def _independent(top, Z, wanted):
    """Velocity columns of the independent set: the user's joints, else by pivoting on scaled null vectors."""
    if Z.shape[1] == 0 and not wanted:
        return ()
    if wanted is None:
        pivots = scipy.linalg.qr(Z.T, pivoting=True, mode="r")[1]
        return tuple(sorted(int(k) for k in pivots[: Z.shape[1]]))
    unknown = [n for n in wanted if n not in top.joint_index]
    if unknown:
        raise ModelError([f"independent: {no_such('joint', n, top.joint_names)}" for n in unknown])
    columns = [k for n in wanted for k in range(*top.joints[top.joint_index[n]].velocities.indices(10**9))]
    part = Z[columns]
    if len(columns) != Z.shape[1] or np.linalg.svd(part, compute_uv=False)[-1] < 1e-9:
        raise ModelError(
            [
                f"independent: joints {', '.join(wanted)} give {len(columns)} velocities that do not determine "
                f"the motion; the mobility is {Z.shape[1]}"
            ]
        )
    return tuple(columns)


def _extended(Z, chosen):
    """The chosen columns and those that complete them to coordinates of the null space Z, by pivoting."""
    missing = Z.shape[1] - len(chosen)
    if missing == 0:
        return chosen
    known = np.linalg.qr(Z[list(chosen)].T)[0] if chosen else np.zeros((Z.shape[1], 0))
    pivots = scipy.linalg.qr(Z.T - known @ (known.T @ Z.T), pivoting=True, mode="r")[1]
    return tuple(sorted([*chosen, *(int(k) for k in pivots[:missing])]))


def _undetermined(carriers, B, Y, length):
    """Reaction components that a self-stress of redundant rows changes, and the carriers they belong to."""
    if Y.shape[1] == 0:
        return tuple((False,) * 6 for _ in carriers), ()
    change = np.abs(B @ Y) / np.r_[np.ones(3), np.full(3, length)][None, :, None]
    marks = change.max(axis=2) > 1e-6 * max(change.max(), 1e-300)
    flags = tuple(tuple(bool(m) for m in row) for row in marks)
    return flags, tuple(name for (name, *_), row in zip(carriers, flags, strict=True) if any(row))


def with_analysis(system: System, found: Mobility, length) -> System:
    """The system with the counted mobility in its topology, and its characteristic length [m]."""
    topology = dataclasses.replace(system.topology, analysis=found)
    return dataclasses.replace(system, topology=topology, length=as_array(length))
