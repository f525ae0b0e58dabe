"""Numbers that laws over frames take from the pose of the model, such as the angle between the shafts of gears."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from ..forces import AbstractPathLaw
from ..kinematics._configuration import configuration
from ..kinematics._poses import neutral_coordinates, node_parameters
from ..model._system import System


def with_laws_in_place(system: System) -> System:
    """The system whose laws over frames have what they take from the pose where all coordinates are zero."""
    takes = [_takes_place(type(group.law)) for group in system.forces]
    if not any(takes):
        return system
    psi = jnp.asarray(neutral_coordinates(system.topology), float)
    at = configuration(system, node_parameters(system), psi, jnp.zeros(()), inertias=False)
    groups = zip(system.forces, takes, strict=True)
    return dataclasses.replace(system, forces=tuple(_in_place(group, at) if own else group for group, own in groups))


def _takes_place(kind):
    own = getattr(kind, "in_place", AbstractPathLaw.in_place)
    return own is not AbstractPathLaw.in_place


def _in_place(group, at):
    """The group with its laws at the frames of a configuration."""
    places = np.array(group.frames)
    law = jax.vmap(lambda law, R, x: law.in_place(R, x))(group.law, at.R[places], at.x[places])
    return dataclasses.replace(group, law=law)
