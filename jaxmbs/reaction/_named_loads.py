"""Loads of drives, force elements, couplers and user constraints, by name."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..dynamics._efforts import LawEffort
from ..kinematics._configuration import VelocityKinematics
from ..kinematics._saddle_operator import constraint_operator
from ..model._rows import drives, row_elements
from ..model._system import System
from ._result import DriveLoad, LawForce, RowLoad
from ._self_stress import UNIQUE_TOLERANCE, row_shares


def law_forces(system: System, acting: list[LawEffort]) -> dict[str, LawForce]:
    """Forces of the force elements by name, from the `LawEffort` of each group; see `efforts`."""
    named = {}
    for group, found in zip(system.forces, acting, strict=True):
        read = jax.vmap(group.port.reading)(found.seen, found.effort)
        for i, name in enumerate(group.names):
            parts: list[Any] = [None if x is None else x[i] for x in read]
            named[name] = LawForce(*parts)
    return named


def drive_loads(system: System, multipliers, stresses, actuators: dict[str, slice], given) -> dict[str, DriveLoad]:
    """Drive loads by joint, from the multipliers (rows,), or for actuators from the efforts given (nv,).

    Args: stresses (n, rows + actuators): see `self_stresses`.
    """
    driven = drives(system.rows)
    if not driven and not actuators:
        return {}
    unique, named = _is_unique(stresses), {}
    for row in driven:
        place = np.array(row.places)
        named[row.name] = DriveLoad(multipliers[place], unique[place])
    first = system.topology.num_rows
    for name, columns in actuators.items():
        effort = given[columns]
        named[name] = DriveLoad(effort, unique[first : first + len(effort)])
        first += len(effort)
    return named


def row_loads(system: System, at: VelocityKinematics, multipliers, stresses) -> dict[str, RowLoad]:
    """Loads of couplers, cables and user rows by name, from all multipliers (rows,); stresses: `self_stresses`."""
    rows = [row for row in row_elements(system.rows) if not row.group.law.prescribes]
    if not rows:
        return {}
    own = np.array([np.isin(np.arange(system.topology.num_rows), row.places) for row in rows])
    operator = constraint_operator(system, at)._replace(unit=jnp.ones_like(multipliers))
    efforts = jax.vmap(operator.efforts)(jnp.where(own, multipliers[None], 0.0))
    named, unique = {}, _is_unique(stresses)
    for row, effort in zip(rows, efforts, strict=True):
        joints = [j for j in system.topology.joints if j.num_velocities and _reads_joint(row, j)]
        parts, place = {joint.name: effort[joint.velocities] for joint in joints}, np.array(row.places)
        named[row.name] = RowLoad(multipliers[place], parts, unique[place])
    return named


def _is_unique(stresses):
    """True (rows + actuators,) for each multiplier that is part of no self-stress."""
    return row_shares(stresses) <= UNIQUE_TOLERANCE[stresses.dtype.itemsize]


def _reads_joint(row, joint):
    """True if a row reads the coordinates of a joint, or may be moved by it."""
    return row.may_read_all or joint.first_velocity in row.columns
