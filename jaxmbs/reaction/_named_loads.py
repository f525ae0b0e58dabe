"""Loads of drives, force elements, couplers and user constraints, by name."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from ..constraints._saddle_operator import constraint_operator
from ..dynamics._efforts import LawEffort
from ..kinematics._configuration import VelocityKinematics
from ..model._rows import drives, row_elements
from ..model._system import System
from ..named_arrays import NamedRows, NamedSlices
from ..runtime import gather_static
from ._result import DriveLoad, LawForce, RowLoads
from ._self_stress import UNIQUE_TOLERANCE, row_shares


def law_forces(system: System, acting: list[LawEffort]) -> NamedRows:
    """Forces of the force elements by name, from the `LawEffort` of each group; see `efforts`."""
    read = (
        LawForce(*jax.vmap(group.port.reading)(found.seen, found.effort))
        for group, found in zip(system.forces, acting, strict=True)
    )
    return NamedRows.of((group.names, force) for group, force in zip(system.forces, read, strict=True))


def drive_loads(system: System, multipliers, stresses, actuators: dict[str, slice], given) -> NamedSlices:
    """Drive loads by joint, from the multipliers (rows,), or for actuators from the efforts given (nv,).

    Args: stresses (n, rows + actuators): see `self_stresses`.
    """
    first, places, taken, columns = 0, [], [], []
    for row in drives(system.rows):
        places.append((row.name, first, first + len(row.places)))
        first, taken = places[-1][2], [*taken, *row.places]
    for name, part in actuators.items():
        places.append((name, first, first + part.stop - part.start))
        first, columns = places[-1][2], [*columns, *range(part.start, part.stop)]
    if not places:
        return NamedSlices(DriveLoad(multipliers[:0], jnp.ones(0, bool)), ())
    unique, rows = _is_unique(stresses), system.topology.num_rows
    efforts = jnp.concatenate([gather_static(multipliers, taken), gather_static(given, columns)])
    marks = jnp.concatenate([gather_static(unique, taken), unique[rows : rows + len(columns)]])
    return NamedSlices(DriveLoad(efforts, marks), tuple(places))


def row_loads(system: System, at: VelocityKinematics, multipliers, stresses) -> Mapping:
    """Loads of couplers, cables and user rows by name, from all multipliers (rows,); stresses: `self_stresses`."""
    rows = [row for row in row_elements(system.rows) if not row.group.law.prescribes]
    if not rows:
        return {}
    own = np.array([np.isin(np.arange(system.topology.num_rows), row.places) for row in rows])
    operator = constraint_operator(system, at)._replace(unit=jnp.ones_like(multipliers))
    efforts = jax.vmap(operator.efforts)(jnp.where(own, multipliers[None], 0.0))
    joints = [
        [
            (joint.name, joint.velocities.start, joint.velocities.stop)
            for joint in system.topology.joints
            if joint.num_velocities and _reads_joint(row, joint)
        ]
        for row in rows
    ]
    return RowLoads(
        multipliers,
        efforts,
        _is_unique(stresses)[: system.topology.num_rows],
        tuple(row.name for row in rows),
        tuple((row.places[0], row.places[-1] + 1) for row in rows),
        tuple(map(tuple, joints)),
    )


def _is_unique(stresses):
    """True (rows + actuators,) for each multiplier that is part of no self-stress."""
    return row_shares(stresses) <= UNIQUE_TOLERANCE[stresses.dtype.itemsize]


def _reads_joint(row, joint):
    """True if a row reads the coordinates of a joint, or may be moved by it."""
    return row.may_read_all or joint.first_velocity in row.columns
