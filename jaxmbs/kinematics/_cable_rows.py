"""Rows of inextensible cables: residuals from the poses of their frames, and the loads of tensions on bodies."""

import jax.numpy as jnp
import numpy as np

from ..forces import PathKinematics
from ..math._spatial import cross
from ..model._rows import CableRow
from ..model._system import System
from ..runtime import gather_static
from ._configuration import Configuration, configuration
from ._poses import node_parameters
from ._wrench_targets import WrenchTargets


def cable_rows(system: System) -> list[CableRow]:
    """Rows of inextensible cables."""
    return [row for row in system.rows if isinstance(row, CableRow)]


def frames_of(R, x, V) -> PathKinematics:
    """Poses and velocities of frames (n, ...) from the twists V (n, 6) of their bodies about the origin."""
    return PathKinematics(R, x, V[:, :3], V[:, 3:] + cross(V[:, :3], x))


def cable_residual(system: System, row: CableRow, psi, t):
    """Length (1,) that is left of a cable at coordinates psi (nq,) [m]."""
    at = configuration(system, node_parameters(system), psi, t, inertias=False)
    return row.law.residual(gather_static(at.R, row.frames), gather_static(at.x, row.frames), t)


def cable_places(system: System) -> np.ndarray:
    """Place of each cable among all rows (static)."""
    return np.array([system.topology.row_joint.index(row.name) for row in cable_rows(system)], int)


def without_cables(system: System, multipliers):
    """Multipliers (rows,) with zero tensions."""
    places = cable_places(system)
    return multipliers.at[places].set(0.0) if len(places) else multipliers


def cable_wrenches(system: System, at: Configuration, owners: WrenchTargets, multipliers):
    """World wrenches (n, 6) on the owners by the tensions among the multipliers (rows,)."""
    frames, wrenches = [], [jnp.zeros((0, 6), multipliers.dtype)]
    for row, place in zip(cable_rows(system), cable_places(system), strict=True):
        x = gather_static(at.x, row.frames)
        force, moment = row.law.unit_loads(gather_static(at.R, row.frames), x)
        about_origin = jnp.concatenate([moment + cross(x, force), force], axis=1)
        wrenches.append(multipliers[place] * about_origin)
        frames += row.frames
    return owners.collect(frames, jnp.concatenate(wrenches))
