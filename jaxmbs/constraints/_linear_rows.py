"""Rows of a mechanism linearised at a pose, within a trace: as a matrix, or without one by the frontal method.

Steps are least in the metric W of the system, `metric`.  Columns with free = 0 stay.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..kinematics._configuration import Configuration
from ..math._linalg import RowScale, saddle_solve
from ..math._spd import spd_inverse
from ..model._system import System
from . import _constraints as constraints
from . import _rows as rows
from ._frontal_saddle import frontal_damped_solver, frontal_saddle
from ._linear_solver import linear_solver
from ._saddle_operator import ConstraintOperator, constraint_operator, loop_entries


def metric(system: System):
    """Diagonal weights (nv,) that make lengths and angles comparable: 1 for turning, 1/L^2 for sliding columns."""
    spins = np.asarray(system.topology.spins)
    return spins + (1.0 - spins) / lax.stop_gradient(system.length) ** 2


def joints_first(system: System, free) -> tuple:
    """Free columns (nv,) of steps that close the loops, one after the other: those of joints, then all.

    Elastic bodies keep their deformations where joints alone can close the loops: a gap of a millimetre that they
    would close by a stretch would carry tons.
    """
    deformations = system.topology.deformations
    if not len(deformations):
        return (free,)
    joints = np.ones(len(free), free.dtype)
    joints[deformations] = 0
    return joints * free, free


def metric_matrix(system: System):
    """`metric` as a matrix (nv, nv)."""
    return metric(system)[:, None] * np.eye(system.topology.num_velocities)


class MatrixRows(eqx.Module):
    """Rows A (rows, nv) as a matrix, in the free columns."""

    system: System
    A: Array
    scale: RowScale

    @property
    def numbers(self) -> Array:
        """The numbers that depend on the pose."""
        return self.A

    @property
    def for_ranks(self) -> Array:
        """The rows in the form for `constraint_rank` and `branch_signs`."""
        return self.A

    def rates(self, u):
        """Rates `A u` (rows,)."""
        return self.A @ u

    def least_step(self, gap, fading: bool = False):
        """The least step (nv,) with `A step = gap` (rows,), of rows that nearly vanish too if `fading`."""
        still = jnp.zeros(self.A.shape[1], self.A.dtype)
        return saddle_solve(metric_matrix(self.system), self.A, still, gap, self.scale, fading=fading)[0]

    def damped_step(self, gap, damping):
        """`(A^T A + damping W)^-1 A^T gap` (nv,)."""
        A = self.A
        return spd_inverse(A.T @ A + damping * metric_matrix(self.system)) @ (A.T @ gap)


class FrontalRows(eqx.Module):
    """The same without a matrix: rows at their static places among all, in the free columns (nv,)."""

    system: System
    at: Configuration
    free: Array
    places: np.ndarray

    @property
    def numbers(self) -> Configuration:
        """The numbers that depend on the pose."""
        return self.at

    @property
    def for_ranks(self) -> "FrontalRows":
        """The rows in the form for `constraint_rank` and `branch_signs`."""
        return self

    def rates(self, u):
        """Rates `A u` (rows,)."""
        return self._operator(jnp.ones(self._num_rows, u.dtype)).rates(u)[self.places]

    def least_step(self, gap, fading: bool = False):
        """The least step (nv,) with `A step = gap` (rows,), of rows that nearly vanish too if `fading`."""
        weight, still = metric(self.system).astype(gap.dtype), jnp.zeros_like(self.free)
        rows = self._operator(constraints.row_scale(self.system).unit.astype(gap.dtype))
        return frontal_saddle(self.system, rows.at, rows, still, self._on_all(gap), 0.0, weight, fading=fading)[0]

    def damped_step(self, gap, damping):
        """`(A^T A + damping W)^-1 A^T gap` (nv,)."""
        rows = self._operator(jnp.ones(self._num_rows, gap.dtype))
        weight = damping * metric(self.system).astype(gap.dtype)
        return frontal_damped_solver(self.system, rows.at, rows, weight)(rows.efforts(self._on_all(gap)))

    def normal_solver(self, weight, damping):
        """Function that solves with `A_w^T A_w + damping` of the rows `A_w = A diag(weight)`."""
        rows = self._operator(jnp.ones(self._num_rows, weight.dtype))
        solve = frontal_damped_solver(self.system, rows.at, rows, damping / weight**2)
        return lambda b: solve(b / weight) / weight

    def entries(self):
        """(rows, columns, values): those of closures in the columns of their loops, then all of the other rows."""
        system, n = self.system, len(self.free)
        entries, first = loop_entries(system, self.at), sum(len(g.names) * g.kind.num_rows for g in system.closures)
        others = rows.matrix(system, self.at)
        row = np.concatenate([entries.row, np.repeat(np.arange(first, self._num_rows), n)])
        column = np.concatenate([entries.column, np.tile(np.arange(n), self._num_rows - first)])
        return row, column, jnp.concatenate([entries.value, others.reshape(-1)])

    @property
    def _num_rows(self):
        return self.system.topology.num_rows

    def _on_all(self, gap):
        return jnp.zeros(self._num_rows, gap.dtype).at[self.places].set(gap, unique_indices=True)

    def _operator(self, unit) -> ConstraintOperator:
        free = self.free.astype(self.at.S.dtype)
        held = eqx.tree_at(lambda at: at.S, self.at, self.at.S * free[:, None])
        rows = constraint_operator(self.system, held)
        return rows._replace(unit=jnp.zeros_like(unit).at[self.places].set(unit[self.places]), free=free)


def linear_rows(system: System, at: Configuration, free, places=None) -> Any:
    """The rows at some places, by default all, of a configuration with the directions of its closures."""
    places = np.arange(system.topology.num_rows) if places is None else places
    if linear_solver(system) == "frontal":
        return rows_of_numbers(system, at, free, places)
    return rows_of_numbers(system, constraints.jacobian(system, at)[places] * free[None, :], free, places)


def rows_of_numbers(system: System, numbers, free, places) -> Any:
    """Linear rows from the `numbers` of others at another pose."""
    if linear_solver(system) == "frontal":
        return FrontalRows(system, numbers, free, places)
    scale = constraints.row_scale(system)
    return MatrixRows(system, numbers, RowScale(scale.unit[places], scale.block[places]))
