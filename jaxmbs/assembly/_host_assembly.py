"""Assembly on the host, in NumPy on the rows of `evaluate_rows`; `_assembly` is the same within a trace."""

import numpy as np

from ..checks import is_sparse
from ..constraints._host_rows import RowEvaluation, evaluate_rows, step_on_host
from ..constraints._linear_rows import joints_first
from ..constraints._sparse_rank import least_norm_solution, scaled_columns
from ..model._system import System
from ._levenberg_marquardt import CLOSED_RESIDUAL, minimise_on_host

_NEWTON_STEPS = 3  # of least size, which bring residuals of 1e-10 to rounding; one is nearly always enough
_RANK_TOLERANCE = {8: 1e-7, 4: 1e-3}  # singular values of the rows that count as zero, relative


def assemble_on_host(system: System, psi, u, t, free_position, free_velocity, restarts: int = 0):
    """(coordinates, velocities, position residual, velocity residual, all rows A) from guesses; see `State.at`."""
    top, random = system.topology, np.random.default_rng(0)  # one seed: a state is a function of its arguments
    psi, rows = search_on_host(system, psi, t, free_position, random, restarts)
    if not has_finite_rows(rows):  # infinite residuals of rows without a slope
        smooth = rows.is_finite
        f, g = (np.where(at, x, np.inf) for at, x in ((smooth[top.position_rows], rows.f), (smooth, rows.f_t)))
        return psi, u, f, g, rows.A
    for free in joints_first(system, free_velocity):
        u = u + _least_norm_step(system, rows.A, free, -rows.f_t - rows.A @ u)
    return _unit_quaternions(top, psi), u, rows.f, rows.A @ u + rows.f_t, rows.A


def search_on_host(system: System, psi, t, free, random: np.random.Generator, restarts: int):
    """`close_on_host` from psi (nq,), and where loops stay open from random coordinates around it."""
    for stage in joints_first(system, free):
        found, rows = close_on_host(system, psi, t, stage)
        for _ in range(restarts):
            if is_closed(rows):
                break
            move = stage * random.normal(size=len(free)) / metric_root(system)
            found, rows = close_on_host(system, step_on_host(system.topology, psi, move), t, stage)
        if is_closed(rows):
            break
    return found, rows


def close_on_host(system: System, psi, t, free) -> tuple[np.ndarray, RowEvaluation]:
    """Coordinates near psi (nq,) with the least residual and the rows there: Levenberg-Marquardt, then Newton.

    Columns with free (nv,) = 0 stay.
    """
    top = system.topology

    def evaluate(psi):
        rows = evaluate_rows(system, psi, t)
        return rows.f, _in_columns(rows.A[top.position_rows], free if has_finite_rows(rows) else np.nan * free), rows

    def step(psi, delta):
        return step_on_host(top, psi, delta)

    psi, rows = minimise_on_host(evaluate, step, psi, metric_root(system) ** 2)
    for _ in range(_NEWTON_STEPS if has_finite_rows(rows) else 0):
        trial = step(psi, _least_norm_step(system, rows.A[top.position_rows], free, -rows.f))
        found = evaluate_rows(system, trial, t)
        if not found.f @ found.f < rows.f @ rows.f or not has_finite_rows(found):
            break
        psi, rows = trial, found
    return psi, rows


def metric_root(system: System) -> np.ndarray:
    """Root (nv,) of the metric: 1 for turning columns, 1 / length for sliding ones."""
    root = np.where(np.asarray(system.topology.spins) > 0, 1.0, 1.0 / np.asarray(system.length))
    return root.astype(system.gravity.dtype)


def is_closed(rows: RowEvaluation) -> bool:
    """True if the residuals of the position rows count as closed, and all rows have a slope."""
    closed = np.max(np.abs(rows.f), initial=0.0) < CLOSED_RESIDUAL[rows.f.dtype.itemsize]
    return bool(closed) and has_finite_rows(rows)


def has_finite_rows(rows: RowEvaluation) -> bool:
    """True if all rows have a slope."""
    return bool(np.all(rows.is_finite))


def _in_columns(A, factors):
    """Rows A (rows, nv), dense or sparse, times factors (nv,)."""
    return scaled_columns(A, factors.astype(A.dtype)) if is_sparse(A) else A * factors[None]


def _least_norm_step(system, A, free, gap):
    """The step (nv,) of least size in the metric with `A step = gap` in the free columns."""
    root = metric_root(system)
    if not A.shape[0]:
        return np.zeros_like(root)
    A, tolerance = _in_columns(A, free / root), _RANK_TOLERANCE[A.dtype.itemsize]
    if is_sparse(A):
        return (least_norm_solution(A, gap, tolerance) / root).astype(A.dtype)
    return np.linalg.lstsq(A, gap, rcond=tolerance)[0] / root


def _unit_quaternions(topology, psi):
    psi = np.array(psi)
    for first in topology.balls:
        at = slice(topology.node_coordinate[first], topology.node_coordinate[first] + 4)
        psi[at] /= np.linalg.norm(psi[at])
    return psi
