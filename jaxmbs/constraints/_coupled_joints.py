"""Joints that couplers and user rows connect at a configuration."""

import jax.numpy as jnp
import numpy as np

from ..kinematics._configuration import Configuration
from ..model._rows import RowElement, coupled_joint_mask, row_elements
from ..model._system import System
from ._rows import slopes


def coupled_joints(system: System, row: RowElement, at: Configuration):
    """`coupled_joint_mask` (joints,) of a row; a user's row, which has all coordinates as arguments, counts for the
    joints whose velocities change it at this configuration."""
    columns = np.isin(np.arange(system.topology.num_velocities), row.columns)
    return coupled_joint_mask(system.topology, columns if row.columns else _columns_read(system, row, at))


def _columns_read(system, row, at):
    """Boolean mask (nv,) of the velocities that change the user's row."""
    slope = slopes(system, at)[next(k for k, group in enumerate(system.rows) if group is row.group)]
    return jnp.any(slope.columns[row.number] != 0, axis=0)


def couplers_and_user_rows(system: System) -> list[RowElement]:
    """Couplers and rows of the user, which act inside of joints: drives and cables do not count."""
    return [row for row in row_elements(system.rows) if row.group.acts_in_joints]
