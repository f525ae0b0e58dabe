"""Joints that couplers and user rows connect at a configuration."""

import jax
import jax.numpy as jnp
import numpy as np

from ..model._rows import CableRow, CoordinateRows, Drive, coupled_joint_mask
from ..model._system import System
from . import _coordinate_rows as coordinate_rows
from ._configuration import Configuration


def coupled_joints(system: System, row: CoordinateRows, at: Configuration):
    """`coupled_joint_mask` (joints,) of a row; a user's row, which has all coordinates as arguments, counts for the
    joints whose velocities change it at this configuration."""
    columns = np.isin(np.arange(system.topology.num_velocities), row.columns)
    return coupled_joint_mask(system.topology, columns if row.columns else _columns_read(system, row, at))


def _columns_read(system, row, at):
    """Boolean mask (nv,) of the velocities that change the user's row."""
    top, u = system.topology, jnp.asarray(np.eye(system.topology.num_velocities), at.psi.dtype)
    A = jax.vmap(lambda u: coordinate_rows.rates(system, at.psi, at.t, u), out_axes=1)(u)
    names = top.row_joint[top.num_rows - len(A) :]
    return jnp.any(A[np.array([name == row.name for name in names])] != 0, axis=0)


def couplers_and_user_rows(system: System) -> list[CoordinateRows]:
    """Couplers and rows of the user, which act inside of joints: drives and cables do not count."""
    return [row for row in system.rows if not isinstance(row, Drive | CableRow)]
