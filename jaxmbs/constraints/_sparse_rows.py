"""Constraint rows of large concrete systems: sparse matrices of SciPy, and products in place of dense matrices."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics._configuration import configuration
from ..kinematics._elastic import mass_operator
from ..kinematics._poses import node_parameters
from ..model._system import System
from ..runtime import gather_static, jit
from . import _closures as closures
from . import _constraints as constraints
from . import _reaction_map as reaction_map
from . import _rows as rows
from ._joint_wrenches import joint_wrenches, wrenches_at_frames
from ._rounding import loop_entries_without_rounding, residual_without_rounding
from ._saddle_operator import closure_pattern

_TOGETHER = 8  # vectors of one product, so that one program serves any number


class MassOperator(NamedTuple):
    """The mass matrix of a system at a pose: `M @ Z` (nv, k) of velocities Z (nv, k)."""

    system: System
    psi: np.ndarray
    t: np.ndarray

    def __matmul__(self, Z):
        return _by_chunks(lambda z: _momenta(self.system, self.psi, self.t, z), Z.T).T

    def diagonal(self) -> np.ndarray:
        """Inertia (nv,) of each velocity alone; a few columns of the matrix are there at a time."""
        number, found = self.system.topology.num_velocities, []
        for first in range(0, number, _TOGETHER):
            places = np.arange(first, min(first + _TOGETHER, number))
            units = np.zeros((number, len(places)), self.psi.dtype)
            units[places, places - first] = 1.0
            found.append((self @ units)[places, places - first])
        return np.concatenate(found)


class ReactionOperator(NamedTuple):
    """`reaction_map` of a system at a pose: `B @ Y` (carriers, 6, k) of multipliers Y (rows, k)."""

    system: System
    psi: np.ndarray
    t: np.ndarray

    def __matmul__(self, Y):
        return _by_chunks(lambda y: _reactions(self.system, self.psi, self.t, y), Y.T).transpose(1, 2, 0)


def evaluate_sparse_rows(system: System, psi, t):
    """(f, A, f_t, reactions, M, positions) as in `RowEvaluation`, A sparse, reactions and M as operators."""
    f, values, others, f_t, x = map(np.asarray, _rows(system, psi, t))
    row, column = closure_pattern(system)
    shape = system.topology.num_rows, system.topology.num_velocities
    i, j = np.nonzero(others)
    entries = np.concatenate([values, others[i, j]])
    place = np.concatenate([row, i + shape[0] - len(others)]), np.concatenate([column, j])
    from scipy.sparse import csr_array  # a tenth of a second that small machines do not need

    A = csr_array((entries, place), shape)
    return f, A, f_t, ReactionOperator(system, psi, t), MassOperator(system, psi, t), x


@jit(compile="tape")
def _rows(system, psi, t):
    at = configuration(system, node_parameters(system), psi, t, inertias=False)
    parts, at = closures.residual_and_directions(system, at)
    f = residual_without_rounding(system, at, constraints.rows_together(system, at, parts))
    values = loop_entries_without_rounding(system, at)
    return f, values, rows.matrix(system, at), constraints.time_rate(system, at), at.x


@jit(compile="tape")
def _momenta(system, psi, t, Z):
    at = configuration(system, node_parameters(system), psi, t)
    return jax.vmap(mass_operator(system, at))(Z)


@jit(compile="tape")
def _reactions(system, psi, t, Y):
    at = configuration(system, node_parameters(system), psi, t, inertias=False)
    at = closures.residual_and_directions(system, at)[1]
    own = [b for *_, b in reaction_map.reaction_carriers(system)]
    R, x = gather_static(at.R, own), gather_static(at.x, own)

    def along(y):
        wrench = joint_wrenches(system, at, jnp.zeros((system.topology.bodies.size, 6), y.dtype), y).wrench
        return jnp.concatenate(wrenches_at_frames(wrench, R, x, "joint", 1.0), axis=1)

    return jax.vmap(along)(Y)


def _by_chunks(function, vectors):
    """A function of `_TOGETHER` vectors for all of them (k, n)."""
    found = []
    for first in range(0, max(len(vectors), 1), _TOGETHER):
        part = vectors[first : first + _TOGETHER]
        padded = np.concatenate([part, np.zeros((_TOGETHER - len(part), part.shape[1]), part.dtype)])
        found.append(np.asarray(function(padded))[: len(part)])
    return np.concatenate(found)
