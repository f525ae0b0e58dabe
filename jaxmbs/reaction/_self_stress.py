"""Self-stresses: loads of joints, drives and couplers that balance each other, so that statics leaves them open.

The multipliers y of a self-stress move no velocity, `A^T y = 0`, at the pose asked: another pose, branch or singular
place has others.  A few random vectors, projected onto the self-stresses, show every component that any self-stress
has (a randomised range finder: Halko, Martinsson, Tropp, SIAM Review 53, 2011).  No derivative passes.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..constraints import _constraints as constraints
from ..constraints._saddle_operator import constraint_operator, row_kinds
from ..dynamics._newton_euler import Bias, saddle_sides
from ..dynamics._saddle import saddle_without_matrix
from ..kinematics._configuration import VelocityKinematics
from ..model._system import System

#: Number and seed of the random vectors: a component is below `UNIQUE_TOLERANCE` in all of them with the probability
#: `UNIQUE_TOLERANCE`^3.  The seed is fixed so that marks do not change from call to call.
_PROBES, _SEED = 3, 5
#: Remainder of a column of A after projection off the others below which it counts as a combination of them, relative
#: to the largest column (double, single precision): poses within 1e-6 of a singular one count as singular.
_RANK_TOLERANCE = {8: 1e-6, 4: 1e-3}
#: Components of a self-stress that count as none, relative to its largest.
UNIQUE_TOLERANCE = {8: 1e-6, 4: 1e-3}
#: Least part of a random vector that a self-stress keeps; a smaller one is rounding of the projection.
_PROBE_ROUNDING = 1e-3


class SaddleSolution(NamedTuple):
    """Accelerations a (nv,), multipliers (rows,), gaps (rows,) of the rows, and self-stresses (n, rows) in the rows'
    common unit."""

    accelerations: Array
    multipliers: Array
    gaps: Array
    stresses: Array


def random_multipliers(system: System, dtype, more: int = 0):
    """Random multipliers (n, rows), with `more` entries for actuators; the same in every trace."""
    size = system.topology.num_rows + more
    return jnp.asarray(np.random.default_rng(_SEED).normal(size=(_PROBES, size)), dtype)


def self_stresses(system: System, at: VelocityKinematics, columns=()):
    """Self-stresses (n, rows + actuators), multipliers in the rows' common unit.

    Args: columns: (first, last) velocity of each actuator, which holds them as a drive does.

    Source: S1 (28), the homogeneous part of the family.
    """
    own = np.concatenate([np.arange(a, b) for a, b in columns]).astype(int) if columns else np.zeros(0, int)
    tried = random_multipliers(system, at.u.dtype, len(own))
    if not system.closures and not len(row_kinds(system).others):
        return jnp.zeros_like(tried)  # a tree: drives and actuators alone are not redundant
    A, length = constraints.jacobian(system, at), jnp.asarray(system.length, at.u.dtype)
    scale = jnp.where(np.asarray(system.topology.spins) > 0, 1.0, length)
    A = constraints.row_scale(system).unit[:, None] * A * scale[None]
    if len(own):
        A = jnp.concatenate([A, np.eye(len(scale), dtype=A.dtype)[own]])
    return project_out_range(*lax.stop_gradient((A, tried)))


def project_out_range(A, y):
    """Vectors y (n, rows) less their parts along the columns of A (rows, m): Gram-Schmidt, the largest column first.

    A small program, and an explicit decision about the rank, `_RANK_TOLERANCE`; a singular value decomposition would
    call LAPACK for every pose.
    """
    columns, least = A.shape[1], jnp.max(jnp.sum(A * A, axis=0), initial=0.0) * _RANK_TOLERANCE[A.dtype.itemsize] ** 2
    among, number = np.arange(columns + len(y)) < columns, np.arange(columns + len(y))

    def take_off(_, B):
        squares = jnp.where(among, jnp.sum(B * B, axis=0), 0.0)
        largest = jnp.max(squares)
        q = B @ (number == jnp.argmax(squares)).astype(B.dtype)
        q = q * jnp.where(largest > least, lax.rsqrt(largest), 0.0)
        return B - q[:, None] * (q @ B)[None]

    return lax.fori_loop(0, min(A.shape), take_off, jnp.concatenate([A, y.T], axis=1))[:, columns:].T


def sparse_saddle_with_stresses(
    system: System, at: VelocityKinematics, loads, method: str, bias: Bias | None = None
) -> SaddleSolution:
    """Accelerations by a block-sparse solver with the self-stresses: one solve, so that one solver is compiled.

    From a random vector the least multipliers with the same efforts are subtracted; the rest exerts no effort.
    """
    need, gamma = saddle_sides(system, at, loads, bias)
    rows, tried = constraint_operator(system, at), random_multipliers(system, at.u.dtype)
    b = jnp.concatenate([need[None], -lax.stop_gradient(jax.vmap(rows.efforts)(tried))])
    c = jnp.concatenate([gamma[None], jnp.zeros_like(tried)])
    a, y = jax.vmap(lambda b, c: saddle_without_matrix(method, system, at, rows, b, c))(b, c)
    gaps = rows.rates(a[0]) / rows.unit - gamma
    return SaddleSolution(a[0], -y[0], gaps, lax.stop_gradient(tried + y[1:] / rows.unit[None]))


def row_shares(stresses):
    """Share (rows + actuators,) of each multiplier in the self-stresses (n, rows + actuators)."""
    return relative_share(jnp.max(jnp.abs(stresses), axis=0))


def relative_share(size):
    """Magnitudes relative to the largest of them; where all are rounding, they remain small."""
    return size / jnp.maximum(jnp.max(size, initial=0.0), _PROBE_ROUNDING)
