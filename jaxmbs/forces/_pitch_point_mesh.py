"""Teeth that press at one point, the pitch point of two wheels whose axes are not parallel."""

import abc
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Float

from ..checks import any_concrete, faults_if, may_be_nonzero, negative, not_positive
from ..typing import ArrayLike, Scalar, ScalarLike
from ._base import AbstractPathLaw, PathKinematics
from ._one_sided import one_sided, one_sided_integral, one_sided_slope, passive_sum
from ._validity import Margin, tooth_margins


class PitchPoint(NamedTuple):
    """Teeth at one instant, in world axes.

    Attributes:
        approach: (2,) of the drive and the coast flank along their normals [m].
        point: (3,) where they touch [m]; sliding: (3,) unit vector along the flanks in which they slide there; both
            None where they only roll.
    """

    approach: Array
    point: Array | None = None
    sliding: Array | None = None


class AbstractPitchPointMesh(AbstractPathLaw):
    """Two wheels A and B that turn about the z axes of their frames and press at their pitch point.

    All forces but friction act along the derivatives of the approach of the flanks by the poses of both wheels, which
    for wheels in place are the forces of the textbook at the pitch point.  So teeth whose shafts tilt store all the
    work that is done on them.
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
    def largest_damping(self) -> ArrayLike:
        return self.damping

    @property
    def dissipates(self) -> bool:
        """True for damping or friction."""
        return self._friction() is not None or may_be_nonzero(self.damping)

    @abc.abstractmethod
    def _pitch_point(self, rotations, positions) -> PitchPoint:
        """The teeth of wheels in these poses, (2, 3, 3) and (2, 3)."""

    def _friction(self):
        """Model of the friction of the flanks, None for smooth ones."""
        return None

    def wrench(self, frames: PathKinematics, t: ScalarLike) -> tuple[Float[Array, "2 3"], Float[Array, "2 3"]]:
        """Forces and moments of both flanks, and friction at the pitch point."""
        teeth, on_x, on_turn = self._approach_and_slopes(frames)
        rate = jax.vmap(frames.power)(on_x, on_turn)
        normal = self._normal_forces(teeth.approach, rate)
        force, moment = -jnp.einsum("s,snj->nj", normal, on_x), -jnp.einsum("s,snj->nj", normal, on_turn)
        model = self._friction()
        if teeth.point is None or teeth.sliding is None or model is None:
            return force, moment
        arms = teeth.point[None] - frames.positions
        velocity = frames.velocities + jnp.cross(frames.angular_velocities, arms)
        slip = jnp.dot(teeth.sliding, velocity[0] - velocity[1])
        push = jnp.sum(normal) * model.resistance(slip * slip) * slip * teeth.sliding
        rubbing = jnp.stack([-push, push])
        return force + rubbing, moment + jnp.cross(arms, rubbing)

    def _approach_and_slopes(self, frames):
        """The teeth, and derivatives (2, wheels, 3) of the approach by the positions and the turns of the wheels."""

        def approach(rotations, positions):
            teeth = self._pitch_point(rotations, positions)
            return teeth.approach, teeth

        _, pull_back, teeth = jax.vjp(approach, frames.rotations, frames.positions, has_aux=True)
        by_R, on_x = jax.vmap(pull_back)(jnp.eye(2, dtype=teeth.approach.dtype))
        M = jnp.einsum("snij,nkj->snik", by_R, frames.rotations)
        axial = (M[..., 2, 1] - M[..., 1, 2], M[..., 0, 2] - M[..., 2, 0], M[..., 1, 0] - M[..., 0, 1])
        return teeth, on_x, jnp.stack(axial, axis=-1)

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
