"""Loads of a contact: depth, forces, sliding, pressure times speed and wear at each of its points."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..assembly._state import State
from ..errors import ModelError
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..model._entry_points import state_function
from ..model._system import System
from ..named_arrays import element_of
from ..quantities import XYZ, Quantity, numbered
from ..reports import Report, Reported
from ..signal_flow._acting_laws import acting_laws


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
    at = with_velocities(system, at_state(system, state), state.velocities)
    laws = [found for found in acting_laws(system, at) if found[0].law.has_points]
    contacts = {one: (group, law, k) for group, law in laws for k, one in enumerate(group.names)}
    if name not in contacts:
        raise ModelError([f"there is no contact {name!r}; there are: {', '.join(contacts) or 'none'}"])
    found, (R, place) = _point_loads(system, at, *contacts[name])
    speed = jnp.sqrt(jnp.sum(found.sliding**2, axis=-1))
    bears = (found.normal_force > 0) & (found.area > 0)
    pressure = jnp.where(bears, found.normal_force / jnp.where(bears, found.area, 1.0), 0.0)
    return ContactLoad(
        found.depth,
        found.rate,
        (at.origin + place)[None] + found.point @ R.T,
        found.normal @ R.T,
        found.normal_force,
        found.friction @ R.T,
        found.sliding @ R.T,
        pressure,
        pressure * speed,
        found.wear * found.normal_force * speed,
        at.t,
    )


def _point_loads(system, at, group, law, k):
    """Loads at the points of the k-th element of a group, and the axes and the place of its first frame."""
    parts = element_flows(system, group, at, at.V, at.u)
    law, seen, displacement, flow = element_of((law, *parts), k)
    law, arguments = group.port.law_and_arguments(law, displacement, flow)
    return law.point_loads(*arguments, at.t), group.port.reference(*seen)
