"""Corners of efforts, which keep their values there and change their slopes: cables at wheels that they leave."""

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from ..constraints._rows import at_frames
from ..kinematics._configuration import Configuration, at_rest
from ..kinematics._element_flows import element_flows
from ..model._system import System


def has_corners(system: System) -> bool:
    """True if some cable can leave a wheel (static)."""
    laws, rows = ([group.law.has_corners for group in groups] for groups in (system.forces, system.rows))
    return any(laws) or any(rows)


def sides_of_corners(system: System, at: Configuration) -> Array:
    """Numbers (n,) that are constant beside the corners, and change on the way over them."""
    still, found = at_rest(system, at), list[tuple[Any, Any]]()
    for group in system.forces:
        if group.law.has_corners:
            found.append((group.law, element_flows(system, group, at, still.V, still.u)[1]))
    found += [(group.law, at_frames(group, at.R, at.x)) for group in system.rows if group.law.has_corners]
    sides = jax.vmap(lambda law, R, x, *_: law.sides_of_corners(R, x))  # others than poses: angles of winches
    return jnp.concatenate([jnp.ravel(sides(law, *poses)) for law, poses in found])
