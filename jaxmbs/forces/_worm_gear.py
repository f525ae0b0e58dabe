"""Worm and wheel in mesh."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..checks import faults_if, flag, not_positive
from ..drawings import Cylinder, Drawing, Gear, Path
from ..friction import AbstractFriction, SmoothCoulomb
from ..friction._places import as_optional_friction, place_faults
from ..typing import Convertible, Scalar
from ._fields import number, optional_number
from ._old_friction import warn_of_old_name
from ._pitch_point_mesh import AbstractPitchPointMesh, PitchPoint, angle_about, within_a_tooth

_POINTS = 97  # of the drawn thread


class WormGear(AbstractPitchPointMesh):
    """Worm A and wheel B, whose axes cross at a right angle, in mesh: `b.force(name, WormGear(...), between=(A, B))`.

    The z axes of the frames are the axes, their origins the middle of the worm and of the wheel.  With the normal
    force N, the lead angle g, `tan g = threads module / (2 radius)`, and friction `mu N` along the thread the wheel
    feels the textbook's forces

        along the worm `N (cos(alpha) cos(g) - mu sin(g))`,  about it `N (cos(alpha) sin(g) + mu cos(g))`,
        away from it `N sin(alpha)`

    where the worm drives, so that bearings carry the right loads, the efficiency of the worm is
    `(cos(alpha) - mu tan(g)) / (cos(alpha) + mu cot(g))`, and with `mu > cos(alpha) tan(g)` the wheel cannot drive
    it.  The flanks approach by the angles of both, and by the relative place of their centres, along and across the
    worm.  The coefficient mu is that of the friction's model at the slip of the flanks: at rest the worm creeps.

    Attributes:
        threads, teeth: of the worm and the wheel (static).
        module: axial module, pitch of the worm over pi [m]; the wheel's radius is teeth times module over two.
        radius: of the worm's pitch cylinder [m].
        left_handed: True for a worm that is no right-handed screw (static).
        pressure_angle: alpha, normal to the thread [rad].
        friction: of the flanks, a model of `jaxmbs.friction` without bristles, or the coefficient of its
            `SmoothCoulomb`; None for smooth ones.
        slip_speed: deprecated; the `transition_speed` of `friction.SmoothCoulomb`, which `friction` takes.
        stiffness: k of the teeth along their normal [N/m]; damping: c >= 0 while they touch [N s/m].
        backlash: j >= 0, play along the normal of the teeth [m].
        phase: of the mesh [rad], 2 pi for a tooth: the teeth are in the middle of their play where it is zero, the x
            axes of both frames point from the worm to the wheel, and the middle of the worm faces the wheel.
        transition: half of the approach over which the teeth come into touch [m].
    """

    threads: int = eqx.field(static=True)  # type: ignore[misc]
    teeth: int = eqx.field(static=True)  # type: ignore[misc]
    module: Convertible[Scalar] = eqx.field(converter=number)
    radius: Convertible[Scalar] = eqx.field(converter=number)  # type: ignore[misc]
    left_handed: bool = eqx.field(static=True, converter=flag("left_handed"), default=False)
    pressure_angle: Convertible[Scalar] = eqx.field(converter=number, default=np.pi / 9)
    friction: Convertible[AbstractFriction | None] = eqx.field(converter=as_optional_friction, default=None)
    slip_speed: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    stiffness: Convertible[Scalar] = eqx.field(converter=number, default=1e8)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    backlash: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    phase: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    transition: Convertible[Scalar] = eqx.field(converter=number, default=1e-6)

    @property
    def lead_angle(self) -> Scalar:
        """Of the thread at the pitch cylinder [rad]; negative if left-handed."""
        return (-1.0 if self.left_handed else 1.0) * jnp.arctan(self.threads * self.module / 2 / self.radius)

    @property
    def wheel_radius(self) -> Scalar:
        """Pitch radius of the wheel [m]."""
        return self.teeth * self.module / 2

    @property
    def centre_distance(self) -> Scalar:
        """Nominal distance of the axes [m]."""
        return self.radius + self.wheel_radius

    def __post_init__(self):
        if self.slip_speed is not None:
            warn_of_old_name("slip_speed of a WormGear", "friction=SmoothCoulomb(dynamic, transition_speed=)")
            self.friction = SmoothCoulomb(self.friction, transition_speed=self.slip_speed)
            self.slip_speed = None

    def drawing(self) -> Drawing:
        """The worm with a thread, as long as the wheel's radius, and the wheel with its teeth."""
        radius, length = float(self.radius), float(self.wheel_radius)
        z = np.linspace(-length / 2, length / 2, _POINTS)
        turn = z / radius / np.tan(float(self.lead_angle))
        thread = radius * np.column_stack([np.cos(turn), np.sin(turn), z / radius])
        return Cylinder(radius, length, 0), Path(thread, 0), Gear(length, 1.4 * radius, self.teeth, frame=1)

    def _friction(self):
        return self.friction

    def _pitch_point(self, rotations, positions):
        worm, wheel = rotations[0, :, 2], rotations[1, :, 2]
        between = positions[1] - positions[0]
        normal = jnp.cross(worm, wheel)
        normal = normal / jnp.sqrt(jnp.dot(normal, normal))
        centre = jnp.where(jnp.dot(normal, between) < 0, -normal, normal)
        about = jnp.cross(worm, centre)  # the way of the worm's rim where it faces the wheel
        sense = jnp.where(jnp.dot(wheel, about) < 0, -1.0, 1.0)  # a positive turn moves the rim along the worm
        hand = -1.0 if self.left_handed else 1.0
        lead, alpha = self.lead_angle, self.pressure_angle
        first = angle_about(worm, rotations[0, :, 0], centre)
        second = angle_about(wheel, rotations[1, :, 0], centre)
        climb = jnp.dot(worm, between)
        cycle = hand * self.threads * first + sense * self.teeth * second + 2 * climb / self.module + self.phase
        # the wheel beside its place turns the thread: a right-handed worm drives the rim backwards
        turned = jnp.cos(lead) * self.module / 2 * within_a_tooth(cycle) - jnp.sin(lead) * jnp.dot(about, between)
        side = np.array([1.0, -1.0])
        nearer = self.centre_distance - jnp.dot(centre, between)
        approach = side * jnp.cos(alpha) * turned + jnp.sin(alpha) * nearer - self.backlash / 2
        point = positions[0] + climb * worm + self.radius * centre
        return PitchPoint(approach, point, jnp.cos(lead) * about + jnp.sin(lead) * worm)

    def faults(self) -> list[str]:
        """Whole numbers of threads and teeth; positive module, radius and stiffness."""
        found = self._mesh_faults((self.threads, self.teeth))
        if self.friction is not None:
            found += place_faults(self.friction, "a worm gear", bristles=False, drag=False)
        return found + faults_if((not_positive(self.radius), "radius must be positive"))
