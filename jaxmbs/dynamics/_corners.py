"""Corners of efforts, which keep their values there and change their slopes: cables at wheels that they leave."""

import jax
import jax.numpy as jnp
from jax import Array

from ..kinematics._cable_rows import cable_rows
from ..kinematics._configuration import Configuration, at_rest
from ..kinematics._element_flows import element_flows
from ..model._system import System
from ..runtime import gather_static


def has_corners(system: System) -> bool:
    """True if some cable can leave a wheel (static)."""
    return any(group.law.has_corners for group in system.forces) or any(r.law.has_corners for r in cable_rows(system))


def sides_of_corners(system: System, at: Configuration) -> Array:
    """Numbers (n,) that are constant beside the corners, and change on the way over them."""
    still, found = at_rest(system, at), []
    for group in system.forces:
        if group.law.has_corners:
            poses = element_flows(system, group, at, still.V, still.u)[1]
            found.append(jnp.ravel(jax.vmap(lambda law, R, x: law.shares_of_wheels(R, x))(group.law, *poses)))
    for row in cable_rows(system):
        found.append(row.law.shares_of_wheels(*(gather_static(part, row.frames) for part in (at.R, at.x))))
    return jnp.concatenate(found)
