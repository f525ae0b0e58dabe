"""Joints that couplers and rows of the user tie at a configuration."""

import jax
import jax.numpy as jnp
import numpy as np

from ..model._rows import CoordinateRows, Drive, joints_tied
from ..model._system import System
from . import _coordinate_rows as coordinate_rows
from ._configuration import Configuration


def coupled_joints(system: System, row: CoordinateRows, at: Configuration):
    """`joints_tied` (joints,) by a row; by rows of the user, which read all coordinates, the joints whose velocities
    move them here."""
    columns = np.isin(np.arange(system.topology.num_velocities), row.columns)
    return joints_tied(system.topology, columns if row.columns else _slopes(system, row, at))


def _slopes(system, row, at):
    """Whether (nv,) the user's row looks at each velocity."""
    top, u = system.topology, jnp.asarray(np.eye(system.topology.num_velocities), at.psi.dtype)
    A = jax.vmap(lambda u: coordinate_rows.rates(system, at.psi, at.t, u), out_axes=1)(u)
    names = top.row_joint[top.num_rows - len(A) :]
    return jnp.any(A[np.array([name == row.name for name in names])] != 0, axis=0)


def acting_rows(system: System) -> list[CoordinateRows]:
    """Couplers and rows of the user: those that are no drives."""
    return [row for row in system.rows if not isinstance(row, Drive)]
