"""What force elements, couplers and rows of the user do, by their names."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics import coordinate_rows
from ..kinematics.configuration import Moving
from ..model.rows import Drive
from ..model.system import System
from .efforts import Acting
from .joint_reactions import LawForce, RowLoad


def law_forces(system: System, acting: list[Acting]) -> dict[str, LawForce]:
    """By name, from what acts group by group; see `efforts`."""
    named = {}
    for group, found in zip(system.forces, acting, strict=True):
        read = jax.vmap(group.port.reading)(found.seen, found.effort)
        for i, name in enumerate(group.names):
            parts: list[Any] = [None if x is None else x[i] for x in read]
            named[name] = LawForce(*parts)
    return named


def row_loads(system: System, at: Moving, multipliers) -> dict[str, RowLoad]:
    """By name, of the rows that are no drives, from all multipliers (rows,)."""
    rows = [row for row in system.rows if not isinstance(row, Drive)]
    if not rows:
        return {}
    own = np.array([[name == row.name for name in system.topology.row_joint] for row in rows])
    alone = jnp.where(own, multipliers[None], 0.0)
    efforts = jax.vmap(lambda part: coordinate_rows.efforts(system, at.psi, at.t, part))(alone)
    named = {}
    for row, mine, effort in zip(rows, own, efforts, strict=True):
        joints = [j for j in system.topology.joints if j.num_velocities and _reads(row, j)]
        parts = {joint.name: effort[joint.velocities] for joint in joints}
        named[row.name] = RowLoad(multipliers[np.flatnonzero(mine)], parts)
    return named


def _reads(row, joint):
    """Whether a row looks at a joint: one without columns of its own looks at all."""
    return not row.columns or joint.first_velocity in row.columns
