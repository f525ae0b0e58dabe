"""Levenberg-Marquardt for closing loops, in NumPy and within a trace, with one set of constants.

Coordinates near a start with the least residual f of the position rows: steps `-(A^T A + damping W)^-1 A^T f` in the
metric W of the system (Levenberg 1944; Marquardt 1963), kept where they lessen f . f.  Loops that cannot close end at
their least residual, redundant rows do no harm, and near closed loops the steps are Newton's of least size in W.
Builds and single states search in NumPy, which compiles nothing.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..checks import is_sparse
from ..constraints._sparse_rank import damped_solver

#: Largest number of passes.  Loops that close take some ten.
MAX_PASSES = 100
#: Damping of the first step.  Rows are lengths, or tangents of angles, per unit of W: directions in which singular
#: values of the rows exceed some 0.03 take Newton's step from the beginning.
FIRST_DAMPING = 1e-3
#: Factors on the damping after a step that lessens the residual, and after one that does not: Marquardt's.
DECREASE, INCREASE = 0.1, 10.0
#: Bounds of the damping: beside A^T A less would vanish in rounding; with more, steps vanish beside the coordinates.
LEAST_DAMPING, LARGEST_DAMPING = 1e-12, 1e8
#: A search ends where this damping still gives no step that lessens the residual.
STOP_DAMPING = 1e7
#: f . f [m^2, rad^2] from where on the search ends as soon as a pass gains nothing: residuals of 1e-10.
CLOSED_SQUARE = 1e-20
#: Relative gain of f . f that counts as none: the search is at a minimum, from where the loops do not close.
STALLED_GAIN = 1e-6
#: Residuals [m or rad] up to which loops count as closed, by precision: some 1e7 times the rounding of a model of one
#: metre, so that large models and flat poses pass, and far below any tolerance of manufacture.
CLOSED_RESIDUAL = {8: 1e-8, 4: 1e-3}
#: Random starts before loops count as impossible to close; a build, which may have no guess, takes more than a state.
STATE_RESTARTS, BUILD_RESTARTS = 12, 24


def minimise_on_host(
    evaluate: Callable, step: Callable, psi: np.ndarray, metric: np.ndarray
) -> tuple[np.ndarray, Any]:
    """Coordinates near psi (nq,) with the least residual, and what `evaluate` returned there, on the host.

    Args: evaluate: residual f (rows,), Jacobian A (rows, nv) and anything else at coordinates; where A is not finite
        the search does not go; step: `psi (+) delta`; metric: diagonal of W (nv,).
    """
    (f, A, more), damping = evaluate(psi), FIRST_DAMPING
    value = f @ f
    for _ in range(MAX_PASSES):
        if not value > CLOSED_SQUARE or damping >= STOP_DAMPING or not _is_finite(A):
            break
        trial = step(psi, -_damped_solution(A, damping * metric, A.T @ f))
        found = evaluate(trial)
        new = found[0] @ found[0]
        better = new < value and _is_finite(found[1])
        damping = np.clip(damping * (DECREASE if better else INCREASE), LEAST_DAMPING, LARGEST_DAMPING)
        if better:
            damping = LARGEST_DAMPING if value - new < STALLED_GAIN * value else damping
            psi, (f, A, more), value = trial, found, new
    return psi, more


def _is_finite(A):
    return bool(np.isfinite(abs(A).sum()))


def _damped_solution(A, damping, right):
    """`(A^T A + damping)^-1 right` of rows A (rows, nv), dense or sparse, and damping (nv,)."""
    if is_sparse(A):
        return damped_solver(A, damping)(right)
    try:
        return np.linalg.solve(A.T @ A + np.diag(damping), right)
    except np.linalg.LinAlgError:  # columns that no row moves, at a damping that has become nothing
        return np.linalg.lstsq(A.T @ A + np.diag(damping), right, rcond=None)[0]


def minimise_in_trace(linearise: Callable, damped_step: Callable, step: Callable, psi: Array) -> tuple[Array, Array]:
    """Coordinates near psi (nq,) with the least residual, and f . f there, within a trace; no derivative passes.

    Each pass evaluates a trial, keeps it if it is better and makes the next one, so that the rows are traced once.

    Args: linearise: residual f (rows,) and arrays of the linearised rows at coordinates; damped_step:
        `(A^T A + damping W)^-1 A^T f` of these arrays, f and a damping; step: `psi (+) delta`.
    """

    def evaluate_trial(carry: Any) -> Any:
        k, trial, damping, _, best = carry
        f, A = linearise(trial)
        found, (_, _, _, value) = (trial, f, A, jnp.dot(f, f)), best
        better = found[-1] < value
        stalled = better & (value - found[-1] < STALLED_GAIN * value)
        best = jax.tree.map(lambda new, old: jnp.where(better, new, old), found, best)
        damping = jnp.clip(damping * jnp.where(better, DECREASE, INCREASE), LEAST_DAMPING, LARGEST_DAMPING)
        damping = jnp.where(stalled, LARGEST_DAMPING, damping)
        psi, f, A, _ = best
        return k + 1, step(psi, -damped_step(A, f, damping)), damping, better, best

    def continues(carry: Any) -> Array:
        k, _, damping, better, (*_, value) = carry
        return (k <= MAX_PASSES) & (better | (value > CLOSED_SQUARE)) & (damping < STOP_DAMPING)

    number = lambda x: jnp.full((), x, psi.dtype)
    blank = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(linearise, psi))
    nothing = (psi, *blank, number(jnp.inf))
    # the start itself is the first trial
    start = (0, psi, number(FIRST_DAMPING / DECREASE), jnp.asarray(True), nothing)
    found, _, _, square = lax.while_loop(continues, evaluate_trial, start)[4]
    return found, square
