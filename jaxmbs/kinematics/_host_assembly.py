"""Assembly on the host, in NumPy on the rows that `evaluate_rows` gives; `_assembly` is the same in a trace."""

import numpy as np

from ..model._system import System
from ._host_rows import evaluate_rows, step_on_host

_ITERATIONS = 100  # of Levenberg and Marquardt; what closes takes some ten
_NEWTON = 3  # steps of least size at the end
_RANK_TOLERANCE = {8: 1e-7, 4: 1e-3}  # singular values of the rows that count as zero, relative


def assemble_on_host(system: System, psi, u, t, free_position, free_velocity):
    """(coordinates, velocities, position residual, velocity residual, all rows A) from guesses; see `State.at`."""
    top = system.topology
    root = np.where(np.asarray(top.spins) > 0, 1.0, 1.0 / np.asarray(system.length))  # of the metric
    root = root.astype(psi.dtype)

    def least(A, free, gap):
        """The least step (nv,) with `A step = gap` in the free columns."""
        if not A.size:
            return np.zeros_like(root)
        return np.linalg.lstsq(A * (free / root)[None], gap, rcond=_RANK_TOLERANCE[psi.dtype.itemsize])[0] / root

    psi, rows = _newton(system, psi, t, free_position, root, least)
    if not has_finite_rows(rows):  # open without end where a row has no slope, so that a search starts elsewhere
        smooth = np.all(np.isfinite(rows.A), axis=1)
        f, g = (np.where(at, x, np.inf) for at, x in ((smooth[top.position_rows], rows.f), (smooth, rows.f_t)))
        return psi, u, f, g, rows.A
    u = u + least(rows.A, free_velocity, -rows.f_t - rows.A @ u)
    return _unit_quaternions(top, psi), u, rows.f, rows.A @ u + rows.f_t, rows.A


def _newton(system, psi, t, free, root, least):
    """Coordinates near psi with the least residual and the rows there: Levenberg and Marquardt, then Newton."""
    top, rows, damping = system.topology, evaluate_rows(system, psi, t), 1e-3
    value = rows.f @ rows.f

    for _ in range(_ITERATIONS):
        if not value > 1e-20 or damping >= 1e7 or not has_finite_rows(rows):
            break
        A = rows.A[top.position_rows] * free[None]
        delta = -np.linalg.solve(A.T @ A + damping * np.diag(root**2), A.T @ rows.f)
        trial = step_on_host(top, psi, delta)
        found = evaluate_rows(system, trial, t)
        new = found.f @ found.f
        better = new < value and has_finite_rows(found)
        damping = np.clip(damping * (0.1 if better else 10.0), 1e-12, 1e8)
        if better:
            stuck = value - new < 1e-6 * value  # at the bottom, and open: what cannot close ends here
            psi, rows, value = trial, found, new
            damping = 1e8 if stuck else damping
    for _ in range(_NEWTON if has_finite_rows(rows) else 0):
        trial = step_on_host(top, psi, least(rows.A[top.position_rows], free, -rows.f))
        found = evaluate_rows(system, trial, t)
        if not found.f @ found.f < value or not has_finite_rows(found):
            break
        psi, rows, value = trial, found, found.f @ found.f
    return psi, rows


def has_finite_rows(rows):
    """Whether all rows have a slope."""
    return bool(np.all(np.isfinite(rows.A)))


def _unit_quaternions(topology, psi):
    psi = np.array(psi)
    for first in topology.balls:
        at = slice(topology.node_coordinate[first], topology.node_coordinate[first] + 4)
        psi[at] /= np.linalg.norm(psi[at])
    return psi
