"""Teeth that press at one point, the pitch point of two wheels whose axes are not parallel."""

import abc
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Float

from ..checks import any_concrete, faults_if, may_be_nonzero, negative, not_positive
from ..typing import Scalar, ScalarLike
from ._base import AbstractPathLaw, PathKinematics
from ._friction_laws import tanh_over
from ._one_sided import one_sided, one_sided_integral, one_sided_slope, passive_sum
from ._validity import Margin, tooth_margins


class PitchPoint(NamedTuple):
    """Teeth at one instant, in world axes.

    Attributes:
        point: (3,) where they touch [m].
        normals: (2, 3) of the drive and the coast flank, unit vectors that push wheel B.
        approach: (2,) of the flanks along their normals [m].
        sliding: (3,) unit vector along the flanks in which they slide, zero where they only roll.
    """

    point: Array
    normals: Array
    approach: Array
    sliding: Array


class AbstractPitchPointMesh(AbstractPathLaw):
    """Two wheels A and B that turn about the z axes of their frames and press at their pitch point.

    The flanks approach by the angles of the wheels and the places of their centres; tilt of the axes against each
    other changes the directions of the forces, and not the approach.
    """

    module: eqx.AbstractVar[Scalar]
    pressure_angle: eqx.AbstractVar[Scalar]
    stiffness: eqx.AbstractVar[Scalar]
    damping: eqx.AbstractVar[Scalar]
    backlash: eqx.AbstractVar[Scalar]
    transition: eqx.AbstractVar[Scalar]

    @property
    def num_frames(self) -> int:
        """Two wheels."""
        return 2

    @property
    def dissipates(self) -> bool:
        """True for damping or friction."""
        return may_be_nonzero(self.damping, self._friction()[0])

    @abc.abstractmethod
    def _pitch_point(self, rotations, positions) -> PitchPoint:
        """The teeth of wheels in these poses, (2, 3, 3) and (2, 3)."""

    def _friction(self):
        """Coefficient of friction of the flanks, and the speed of slip at which it is at three quarters."""
        return 0.0, 1.0

    def wrench(self, frames: PathKinematics, t: ScalarLike) -> tuple[Float[Array, "2 3"], Float[Array, "2 3"]]:
        """Normal forces of both flanks and friction, at the pitch point."""
        teeth = self._pitch_point(frames.rotations, frames.positions)
        arms = teeth.point[None] - frames.positions
        velocity = frames.velocities + jnp.cross(frames.angular_velocities, arms)
        closing = velocity[0] - velocity[1]
        normal = self._normal_forces(teeth.approach, jnp.sum(teeth.normals * closing[None], axis=1))
        push = jnp.sum(normal[:, None] * teeth.normals, axis=0)
        mu, speed = self._friction()
        slip = jnp.sum(teeth.sliding * closing) / speed
        push = push + jnp.sum(normal) * mu * tanh_over(slip * slip) * slip * teeth.sliding
        force = jnp.stack([-push, push])
        return force, jnp.cross(arms, force)

    def validity(self, frames: PathKinematics, t: ScalarLike) -> dict[str, Margin]:
        """Distances [m] to wheels whose teeth no longer reach into each other, and to teeth pressed by a quarter of
        their pitch."""
        approach = self._pitch_point(frames.rotations, frames.positions).approach
        nearer = (jnp.sum(approach) + self.backlash) / (2.0 * jnp.sin(self.pressure_angle))
        return tooth_margins(self, nearer, approach)

    def potential(self, rotations: Float[Array, "2 3 3"], positions: Float[Array, "2 3"], t: ScalarLike) -> Scalar:
        """Energy of the pressed teeth [J]."""
        approach = self._pitch_point(rotations, positions).approach
        return self.stiffness * jnp.sum(one_sided_integral(approach, self.transition))

    def _normal_forces(self, approach, rate):
        """Forces (2,) of the drive and the coast flank [N]."""
        resisting = self.damping * one_sided_slope(approach, self.transition) * rate
        return passive_sum(self.stiffness * one_sided(approach, self.transition), resisting)

    def _mesh_faults(self, numbers) -> list[str]:
        """Faults of the fields that both kinds of gears have; numbers: of teeth or threads."""
        whole = all(isinstance(n, int) and not isinstance(n, bool) and 0 < n <= 10**5 for n in numbers)
        return super().faults() + faults_if(
            (not whole, f"teeth and threads are whole numbers from 1 to 100000, got {tuple(numbers)!r}"),
            (not_positive(self.module), "module must be positive"),
            (any_concrete(lambda a: (a <= 0) | (a >= np.pi / 4), self.pressure_angle), _PRESSURE_ANGLE),
            (not_positive(self.stiffness), "stiffness must be positive"),
            (negative(self.damping), "damping must not be negative"),
            (negative(self.backlash), "backlash must not be negative"),
            (not_positive(self.transition), "transition must be positive"),
            (
                whole and any_concrete(lambda j, m, a: j >= np.pi * m * np.cos(a) / 2, *self._pitch()),
                "backlash must be less than half a tooth pitch",
            ),
        )

    def _pitch(self):
        return self.backlash, self.module, self.pressure_angle


_PRESSURE_ANGLE = "pressure_angle is between 0 and pi/4"


def angle_about(axis, x, origin):
    """Angle of x about an axis, counted from a direction across it, in its positive sense [rad]."""
    return jnp.arctan2(jnp.dot(jnp.cross(axis, origin), x), jnp.dot(origin, x))


def within_a_tooth(cycle):
    """A phase of the mesh, modulo 2 pi, between -pi and pi."""
    return cycle - 2 * np.pi * jnp.round(lax.stop_gradient(cycle) / (2 * np.pi))


def across(vector, axis):
    """Unit vector along the part of a vector across a unit axis; zero where there is none."""
    part = vector - jnp.dot(vector, axis) * axis
    square = jnp.dot(part, part)
    return part * jnp.where(square > 0, lax.rsqrt(jnp.where(square > 0, square, 1.0)), 0.0)
