"""Curves of a suspension over wheel travel and rack, as the rig draws them."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..quantities import XYZ, Quantity
from ..reports import Report, Reported
from ..typing import ScalarLike


class RigCurves(Reported, eqx.Module):
    """Curves over travel and rack, arrays (...) of the poses asked; angles in radians, lengths in metres.

    Attributes:
        travel, rack: of the poses [m].
        camber: positive where the top leans outwards.
        toe: angle of the axle's projection on the road from the y axis, `atan(a_x / a_y)` of the axle a outwards:
            positive is toe-in of a left wheel.
        caster, kingpin: of the steering axis, positive leaning backwards and inwards; NaN without such an axis.
        scrub: from the steering axis to the contact along the axle, on the ground, positive outwards; NaN without.
        trail: by which the steering axis meets the ground ahead of the contact; NaN without.
        centre, contact: (..., 3) of the wheel and its lowest point.
        roll_centre: height over the ground, `y dy/dz` of the contact with the image of the other side.
        brake_support: dx/dz of the contact with the wheel locked to the upright: vertical over braking force.
        drive_support: dx/dz of the wheel centre.
        motion_ratio: shortening of the strut over the rise of the wheel.
        strut: length of the strut [m].
        camber_slope, toe_slope: over the travel [rad/m].
    """

    travel: Float[Array, "..."]
    rack: Float[Array, "..."]
    camber: Float[Array, "..."]
    toe: Float[Array, "..."]
    caster: Float[Array, "..."]
    kingpin: Float[Array, "..."]
    scrub: Float[Array, "..."]
    trail: Float[Array, "..."]
    centre: Float[Array, "... 3"]
    contact: Float[Array, "... 3"]
    roll_centre: Float[Array, "..."]
    brake_support: Float[Array, "..."]
    drive_support: Float[Array, "..."]
    motion_ratio: Float[Array, "..."]
    strut: Float[Array, "..."]
    camber_slope: Float[Array, "..."]
    toe_slope: Float[Array, "..."]

    @classmethod
    def of(cls, suspension: Any, travel: Any, rack: Any, places: dict, rates: dict, locked: Any) -> "RigCurves":
        """Curves at one pose.

        Args: places: points and axes at the pose; rates: their derivatives over the travel; locked: velocity (3,)
        over the travel of the point of the upright at the contact.
        """
        axle, turn, contact = places["axle"], rates["axle"], places["contact"]
        flat = axle[0] ** 2 + axle[1] ** 2
        camber_slope = -(turn[2] * flat - axle[2] * (axle[0] * turn[0] + axle[1] * turn[1])) / jnp.sqrt(flat)
        steering = _steering(places) if suspension.kingpin is not None else [jnp.full_like(travel, jnp.nan)] * 4
        return cls(
            travel,
            rack,
            jnp.arctan2(-axle[2], jnp.sqrt(flat)),
            jnp.arctan(axle[0] / axle[1]),
            steering[0],
            steering[1],
            steering[2],
            steering[3],
            places["centre"],
            contact,
            contact[1] * rates["contact"][1] / rates["contact"][2],
            locked[0] / locked[2],
            rates["centre"][0] / rates["centre"][2],
            -rates["strut"],
            places["strut"],
            camber_slope,
            (turn[0] * axle[1] - axle[0] * turn[1]) / flat,
        )

    def wheel_rate(self, stiffness: ScalarLike, force: ScalarLike = 0.0, slope: ScalarLike = 0.0) -> Array:
        """Rate of the wheel [N/m] of a spring of some stiffness [N/m] in the strut, `k i^2 + F di/dz`.

        Args: force: compression of the spring [N]; slope: di/dz of the motion ratio i [1/m].
        """
        return jnp.asarray(stiffness) * self.motion_ratio**2 + jnp.asarray(force) * jnp.asarray(slope)

    def anti_dive(self, brake_share: ScalarLike, wheelbase: ScalarLike, height: ScalarLike) -> Array:
        """Share of the pitch of braking that a front suspension holds by itself: `dx/dz share L / h`.

        Args: brake_share: of the front axle; wheelbase, height of the centre of mass [m].  Of a rear axle with its
        own share the negative of this is its anti-lift.
        """
        return self.brake_support * jnp.asarray(brake_share) * jnp.asarray(wheelbase) / jnp.asarray(height)

    def anti_squat(self, drive_share: ScalarLike, wheelbase: ScalarLike, height: ScalarLike) -> Array:
        """Share of the pitch of driving that a rear suspension holds by itself, driven through shafts.

        Args: drive_share: of the rear axle; wheelbase, height of the centre of mass [m].
        """
        return self.drive_support * jnp.asarray(drive_share) * jnp.asarray(wheelbase) / jnp.asarray(height)

    def report(self) -> Report:
        degrees, mm = 180.0 / np.pi, 1e3
        angles = {n: getattr(self, n) * degrees for n in ("camber", "toe", "caster", "kingpin")}
        lengths = {n: getattr(self, n) * mm for n in ("travel", "rack", "scrub", "trail", "roll_centre", "strut")}
        plain = {n: getattr(self, n) for n in ("motion_ratio", "brake_support", "drive_support")}
        rows = [Quantity(n.replace("_", " "), x, "deg") for n, x in angles.items()]
        rows += [Quantity(n.replace("_", " "), x, "mm") for n, x in lengths.items()]
        rows += [Quantity(n.replace("_", " "), x, "") for n, x in plain.items()]
        rows += [Quantity(f"wheel {n}", getattr(self, n) * mm, "mm", (XYZ,)) for n in ("centre", "contact")]
        return Report(rows, f"{np.size(self.travel)} poses of a suspension")


def _steering(places):
    """Caster, kingpin inclination, scrub radius and trail."""
    lower, contact, axle = places["lower"], places["contact"], places["axle"]
    pin = places["upper"] - lower
    foot = lower + pin * (contact[2] - lower[2]) / pin[2]
    outwards = jnp.stack([axle[0], axle[1]]) / jnp.sqrt(axle[0] ** 2 + axle[1] ** 2)
    ahead = jnp.stack([outwards[1], -outwards[0]])
    offset = (contact - foot)[:2]
    angles = [jnp.arctan(-pin[k] / pin[2]) for k in (0, 1)]
    return [*angles, jnp.dot(offset, outwards), -jnp.dot(offset, ahead)]
