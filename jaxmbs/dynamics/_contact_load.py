"""Loads of a contact: depth, forces, sliding, pressure times speed and wear at each of its points."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..contact._contact import AbstractContact, PointForces
from ..errors import ModelError
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._state import State
from ..model._entry_points import state_function
from ..model._system import System
from ..quantities import XYZ, Quantity, numbered
from ..reports import Report, Reported


class ContactLoad(Reported, eqx.Module):
    """Loads at the points of one contact (..., k), in world axes.

    Attributes:
        depth: of the overlap, negative is the gap [m].
        rate: of the depth [m/s].
        point: (..., k, 3) in the middle of the overlap [m].
        normal: (..., k, 3) unit vectors towards the round part.
        normal_force: on the round part along the normal, never negative [N].
        friction: (..., k, 3) on the round part [N].
        sliding: (..., k, 3) velocity of the round part over the surface [m/s].
        pressure: normal force over the pair's `area` [Pa], zero apart.
        pressure_speed: pressure times sliding speed, the load limit of plain bearings [W/m^2].
        wear_rate: worn volume by time, by Archard: `wear` times normal force times sliding speed [m^3/s].
        t: (...) time [s].
    """

    depth: Float[Array, "... k"]
    rate: Float[Array, "... k"]
    point: Float[Array, "... k 3"]
    normal: Float[Array, "... k 3"]
    normal_force: Float[Array, "... k"]
    friction: Float[Array, "... k 3"]
    sliding: Float[Array, "... k 3"]
    pressure: Float[Array, "... k"]
    pressure_speed: Float[Array, "... k"]
    wear_rate: Float[Array, "... k"]
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        count = np.shape(self.depth)[-1]
        point = (numbered("point", count),)
        whole = np.sum(np.asarray(self.normal_force), axis=-1)
        return Report(
            [
                Quantity("sum of normal forces", whole, "N"),
                Quantity("depth", self.depth, "m", point),
                Quantity("rate", self.rate, "m/s", point),
                Quantity("normal force", self.normal_force, "N", point),
                Quantity("friction", self.friction, "N", (*point, XYZ)),
                Quantity("sliding", self.sliding, "m/s", (*point, XYZ)),
                Quantity("pressure", self.pressure, "Pa", point),
                Quantity("pressure times speed", self.pressure_speed, "W/m^2", point),
                Quantity("wear rate", self.wear_rate, "m^3/s", point),
                Quantity("position", self.point, "m", (*point, XYZ), in_table=False),
                Quantity("normal", self.normal, "", (*point, XYZ), in_table=False),
            ],
            t=self.t,
        )


@state_function
def contact_load(system: System, state: State, name: str) -> ContactLoad:
    """Loads of the contact of that name.

    Args:
        state: a State, a Motion, or states with leading axes, which the answer has too.

    Raises: ModelError where no contact has the name.
    """
    contacts = {one: (group, k) for group in contact_groups(system) for k, one in enumerate(group.names)}
    if name not in contacts:
        raise ModelError([f"there is no contact {name!r}; there are: {', '.join(contacts) or 'none'}"])
    group, k = contacts[name]
    at = with_velocities(system, at_state(system, state), state.velocities)
    law, found, a = _forces(system, at, group, k)
    speed = jnp.sqrt(jnp.sum(found.sliding**2, axis=-1))
    area = law.pair.area(jnp.maximum(found.touch.depth, 0.0))
    bears = (found.normal > 0) & (area > 0)
    pressure = jnp.where(bears, found.normal / jnp.where(bears, area, 1.0), 0.0)
    return ContactLoad(
        found.touch.depth,
        found.rate,
        (at.origin + a.x)[None] + found.touch.point @ a.R.T,
        found.touch.normal @ a.R.T,
        found.normal,
        found.friction @ a.R.T,
        found.sliding @ a.R.T,
        pressure,
        pressure * speed,
        law.wear * found.normal * speed,
        at.t,
    )


def contact_groups(system: System) -> list:
    """Groups of force elements that are contacts."""
    return [group for group in system.forces if isinstance(contact_of(group.law), AbstractContact)]


def contact_of(law):
    """The law, or that of a law at internal states."""
    return getattr(law, "law", law)


def _forces(system, at, group, k) -> tuple[AbstractContact, PointForces, Any]:
    """The k-th contact of a group, the forces at its points, and the motion of its frame A."""
    parts = element_flows(system, group, at, at.V, at.u)
    law, (a, _), displacement, flow = jax.tree.map(lambda x: x[k], (group.law, *parts))
    return contact_of(law), law.point_forces(*displacement, flow[:3], flow[3:]), a
