"""Mobility of a model, counted on the host at several assembled poses, about that of the guess if there is one."""

import dataclasses
from collections.abc import Iterable

import jax.numpy as jnp
import numpy as np

from ..assembly._host_assembly import close_on_host, has_finite_rows, is_closed, search_on_host
from ..assembly._levenberg_marquardt import BUILD_RESTARTS, CLOSED_RESIDUAL
from ..assembly._state import State
from ..checks import is_sparse
from ..constraints._host_rows import evaluate_rows, step_on_host
from ..constraints._mobility import mobility_of, row_spaces, with_mobility
from ..constraints._rank import constraint_spaces
from ..errors import AssemblyError, ModelError
from ..joints._base import HALF_TURN_RESIDUAL
from ..kinematics._poses import neutral_coordinates
from ..model._system import System

_NUM_POSES = 4  # at which ranks are compared: one singular pose among them does no harm, nor do two
_STEP = 0.3  # between poses, about [rad]: beyond rounding, and near enough to close again
_STEP_NEAR_GUESS = 0.05  # the same about a pose of use, whose branch is to be kept
_SEED = 7  # of the poses looked at: any, but the same in every build, so that a model has one answer
_HALF_TURN_MARGIN = 1e-4  # relative residual, about a degree off half a turn
_ZERO_INERTIA = {8: 2e-14, 4: 1e-6}  # relative inertia that counts as none: rounding of the mass matrix


def _float_type():
    return jnp.result_type(float)


def analyse_mobility(system: System, independent: Iterable[str] | None = None) -> System:
    """A concrete system with its characteristic length and its mobility: the largest rank near the pose of use, or
    near the reference pose where no guess says which pose that is.

    Raises: ModelError when the loops cannot be closed, when a joint can move without inertia, or when the user's
    independent set does not determine the motion.
    """
    top, random = system.topology, np.random.default_rng(_SEED)
    psi, t = neutral_coordinates(top).astype(_float_type()), np.zeros((), _float_type())
    x = evaluate_rows(system, psi, t).positions
    length = float(np.max(np.linalg.norm(x - x.mean(0)[None], axis=1))) or 1.0
    system, weight = with_mobility(system, None, length), np.where(top.spins > 0, 1.0, length)
    psi = _pose_from_guess(system) if top.guess else _close_loops(system, psi, t, random)
    best, stresses = None, []
    fault: str | None = None
    for _ in range(_NUM_POSES):
        rows = evaluate_rows(system, psi, t)
        spaces = rank, Z, _ = row_spaces(system, rows)
        found = _inertia_fault(top, rows.M, Z)
        if best is None or rank > best[1][0]:
            best, fault, stresses = (rows, spaces), found, []
        elif rank == best[1][0]:  # one pose with inertia will do
            fault = fault and found
        if rank == best[1][0]:
            stresses.append(
                _self_stress_parts(row_spaces(system, rows._replace(A=rows.A[top.position_rows]))[2], rows)
            )
        if not top.num_rows and fault is None:
            break
        psi = _another_pose(system, psi, t, Z, weight, random)
    if fault:
        raise ModelError([fault])
    assert best is not None
    mobility = mobility_of(system, best[0], best[1], independent)
    return with_mobility(system, dataclasses.replace(mobility, pose_dependent_rows=_pose_dependent_rows(stresses)))


def _pose_dependent_rows(stresses):
    """Rows whose parts in the self-stresses (rows, k), one at each pose, are not the same."""
    change = np.max([np.abs(part - stresses[0]).max(1, initial=0.0) for part in stresses], axis=0)
    return tuple(int(k) for k in np.nonzero(change > 1e-3)[0])  # of one


def _self_stress_parts(Y, rows):
    """Parts along the self-stresses of vectors that are the same at each pose: unit vectors, or random ones of sparse
    rows."""
    return Y if is_sparse(rows.A) else Y @ Y.T


def check_closure_and_inertia(system: System) -> None:
    """ModelError if the loops of a concrete system cannot be closed, or a joint can move without inertia."""
    top, random = system.topology, np.random.default_rng(_SEED)
    weight, t = np.ones(top.num_velocities), np.zeros((), _float_type())
    psi = neutral_coordinates(top).astype(_float_type())
    psi = _pose_from_guess(system) if top.guess else _close_loops(system, psi, t, random)
    for _ in range(_NUM_POSES):
        rows = evaluate_rows(system, psi, t)
        Z = constraint_spaces(rows.A, 1.0)[1]
        if (fault := _inertia_fault(top, rows.M, Z)) is None:
            return
        psi = _another_pose(system, psi, t, Z, weight, random)
    raise ModelError([fault] if fault else [])


def _pose_from_guess(system):
    """Coordinates of the pose that the guesses of the model lead to."""
    try:
        return np.asarray(State.at(system).coordinates)
    except AssemblyError as error:
        raise ModelError([f"guess: {error}"]) from error


def _another_pose(system, psi, t, Z, weight, random):
    """Another closed pose, along the motions Z."""
    step = _STEP_NEAR_GUESS if system.topology.guess else _STEP
    move = weight * (Z @ random.normal(size=Z.shape[1]) * step)
    found, rows = close_on_host(system, step_on_host(system.topology, psi, move), t, np.ones(len(weight)))
    return found if has_finite_rows(rows) else psi


def _close_loops(system, psi, t, random):
    """An assembled pose near the neutral one.  Raises: ModelError where none is found."""
    top = system.topology
    if not top.num_rows:
        return psi
    _refuse_half_turns(system, evaluate_rows(system, psi, t).f)
    found, rows = search_on_host(system, psi, t, np.ones(top.num_velocities), random, BUILD_RESTARTS)
    if is_closed(rows):
        return found
    f, steep = np.abs(rows.f), ~rows.is_finite
    if np.any(steep):
        names = ", ".join(repr(name) for name in sorted({top.row_joint[k] for k in np.nonzero(steep)[0]}))
        raise ModelError([f"the slope of {names} is not finite at any pose that was tried; check the function"])
    is_open = ~(f < CLOSED_RESIDUAL[f.dtype.itemsize])
    open_rows = sorted({top.row_joint[k] for k in top.position_rows[is_open]})
    raise ModelError(
        [
            f"the loops cannot be closed; still open (largest residual {np.max(f):.3g}): {', '.join(open_rows)}; "
            "check the joint frames and link lengths"
        ]
    )


def _refuse_half_turns(system, f):
    """Raises: ModelError where the frames of a closing joint are half a turn apart in the reference pose."""
    faults, first = [], 0
    for group in system.closures:
        units = group.kind.row_units[: group.kind.num_rows - group.kind.num_slips]
        turns = np.array([unit == "rad" for unit in units], bool)
        rows = f[first : first + len(group.names) * len(turns)].reshape(len(group.names), len(turns))
        first += rows.size
        for name, angle in zip(group.names, np.linalg.norm(rows[:, turns], axis=1), strict=True):
            if angle > HALF_TURN_RESIDUAL * (1.0 - _HALF_TURN_MARGIN):
                turn = np.rad2deg(np.arccos(1.0 - min(angle, HALF_TURN_RESIDUAL) / 2.0))
                faults.append(
                    f"joint {name!r}: in the reference pose its frames are half a turn ({turn:.4f} degrees) from "
                    "closed; turn one of them by half a turn (rotation of parent_frame or child_frame)"
                )
    if faults:
        raise ModelError(faults)


def _inertia_of_columns(top, M):
    """Inertia (nv,) of each velocity alone, zero where it is rounding of that of others of its unit on its branch."""
    path = np.asarray(top.nodes.path, float)
    spins = np.asarray(top.spins) > 0
    together = (path.T @ path > 0) & (spins[:, None] == spins[None])
    own = np.maximum(np.asarray(M.diagonal()), 0.0)
    return np.where(own > 16 * np.finfo(_float_type()).eps * np.max(together * own[None], axis=1), own, 0.0)


def _inertia_fault(top, M, Z) -> str | None:
    """Message where a motion among Z moves no inertia, beside that of its velocities one by one; else None.

    So neither ratios of masses nor units count.
    """
    if Z.shape[1] == 0:
        return None
    least = _ZERO_INERTIA[_float_type().itemsize]
    own = np.sqrt(_inertia_of_columns(top, M))
    columns = np.linalg.norm(own[:, None] * Z, axis=0)
    unit = np.where(columns > 0.0, columns, 1.0)
    U, size, Vt = np.linalg.svd(own[:, None] * Z / unit, full_matrices=False)
    mode = Vt[-1] / unit
    if size[-1] > least * size[0]:
        inverse = np.where(own > 0.0, 1.0 / np.where(own > 0.0, own, 1.0), 0.0)[:, None]
        values, vectors = np.linalg.eigh((inverse * U).T @ (M @ (inverse * U)))
        if values[0] > least:
            return None
        mode = Vt.T @ (vectors[:, 0] / size) / unit
    mode = np.abs(Z @ mode)
    names = sorted({top.column_joint_name[k] for k in np.nonzero(mode > 0.1 * mode.max())[0]})
    return f"a motion of joint(s) {', '.join(names)} moves no inertia: give the bodies there mass or inertia"
