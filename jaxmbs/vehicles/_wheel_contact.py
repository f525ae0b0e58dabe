"""Contact of a wheel with a road: axes, deflection, sliding velocities."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jax import Array

from ..math._linalg import direction
from ..typing import Matrix3, Vector3
from ._road import AbstractRoad

_FLAT = 1e-6  # least squared cosine of the inclination: a wheel that lies on its side stays finite


class WheelContact(NamedTuple):
    """A wheel about the axis y of its frame on a road; all in the axes of the road, from the road's origin.

    Attributes:
        point: (3,) of contact: the lowest of the wheel's plane, on the road.
        forward, left, normal: (3,) unit vectors, ISO axes of the contact.
        camber: sine of the inclination angle.
        radius: loaded, in the wheel's plane [m].
        radius_rate: [m/s].
        speed, side_speed: of the contact along and across, without the wheel's spin [m/s].
        spin: of the wheel about its axis, positive rolling forward [rad/s].
    """

    point: Vector3
    forward: Vector3
    left: Vector3
    normal: Vector3
    camber: Array
    radius: Array
    radius_rate: Array
    speed: Array
    side_speed: Array
    spin: Array


def wheel_contact(
    road: AbstractRoad, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3
) -> WheelContact:
    """The contact of a wheel with a pose and velocity relative to the road; arguments as of a pose law.

    On roads that are not plane the plane of the road is taken below the wheel's centre first, then at the contact.
    """
    axle = rotation[:, 1]
    ahead = direction(jnp.stack([axle[1], -axle[0]]))
    place = displacement
    for _ in range(1 if road.is_plane else 2):
        below, normal = road.plane(place[:2], ahead)
        camber = jnp.dot(axle, normal)
        upright = jnp.sqrt(jnp.maximum(1.0 - camber * camber, _FLAT))
        down = (camber * axle - normal) / upright
        radius = jnp.dot(displacement - below, normal) / upright
        place = displacement + radius * down
    forward = jnp.cross(axle, normal) / upright
    left = jnp.cross(normal, forward)
    spin = jnp.dot(angular_velocity, axle)
    turning = angular_velocity - spin * axle
    sliding = velocity + jnp.cross(turning, radius * down)
    camber_rate = jnp.dot(jnp.cross(turning, axle), normal)
    radius_rate = (jnp.dot(velocity, normal) + radius * camber * camber_rate / upright) / upright
    speeds = jnp.dot(sliding, forward), jnp.dot(sliding, left)
    return WheelContact(place, forward, left, normal, camber, radius, radius_rate, *speeds, spin)


def rolling_direction(speed: Any, slow: Any) -> Any:
    """1 forward, -1 backward, smooth between where the speed is less than a slow one."""
    x = jnp.clip(speed / slow, -1.0, 1.0)
    return jnp.sin(0.5 * jnp.pi * x)
