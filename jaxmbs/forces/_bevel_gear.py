"""Straight bevel gears in mesh."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import any_concrete, faults_if
from ..drawings import Drawing, Path
from ..typing import Convertible, Scalar
from ._fields import number, optional_number
from ._pitch_point_mesh import AbstractPitchPointMesh, PitchPoint, across, angle_about, within_a_tooth

_AROUND = 49  # points of a drawn rim


class BevelGear(AbstractPitchPointMesh):
    """Straight bevel gears A and B whose axes cross, in mesh: `b.force(name, BevelGear(...), between=(A, B))`.

    The origins of both frames are at the apex, where the axes cross, and each z axis points from there along the axis
    of its wheel.  The angle s between the axes for which the wheels are cut gives the cone angles c_A and c_B, whose
    sines are as the numbers of teeth.  With the normal force N at the mean radius the wheels feel the forces of the
    textbook

        tangential `F = N cos(alpha)`,  radial `F tan(alpha) cos(c)` inwards,  axial `F tan(alpha) sin(c)` outwards

    so that bearings carry the right loads.  The flanks approach by `+-cos(alpha) (r_A a + r_B b) + sin(alpha) R (s -
    s') - j / 2` with the angles a, b of the wheels, the cone distance R and the present angle s' between the axes,
    and by the relative place of the two origins.  All forces are the derivative of one potential, so that gears on
    shafts that tilt keep their energy.

    Attributes:
        teeth: numbers of teeth of A and B (static); module: mean module, twice the mean radius over the teeth [m].
        pressure_angle: alpha [rad].
        stiffness: k of the teeth along their normal [N/m]; damping: c >= 0 while they touch [N s/m].
        backlash: j >= 0, play along the normal of the teeth [m].
        phase: of the mesh [rad], 2 pi for a tooth: the teeth are in the middle of their play where it is zero and the
            x axes of both frames point across their axes to the other wheel.
        transition: half of the approach over which the teeth come into touch [m].
        shaft_angle: s [rad], by default that of the frames in the pose where all coordinates are zero.
    """

    teeth: tuple[int, int] = eqx.field(static=True)  # type: ignore[misc]
    module: Convertible[Scalar] = eqx.field(converter=number)
    pressure_angle: Convertible[Scalar] = eqx.field(converter=number, default=np.pi / 9)
    stiffness: Convertible[Scalar] = eqx.field(converter=number, default=1e8)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    backlash: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    phase: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    transition: Convertible[Scalar] = eqx.field(converter=number, default=1e-6)
    shaft_angle: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)

    @property
    def radii(self) -> Array:
        """Mean radii (2,) of A and B [m]."""
        return self.module / 2 * np.asarray(self.teeth, float)

    def in_place(self, rotations: Array, positions: Array) -> "BevelGear":
        """The gears cut for the angle between the axes of frames (2, 3, 3), where they are not for another."""
        if self.shaft_angle is not None:
            return self
        first, second = rotations[0, :, 2], rotations[1, :, 2]
        angle = jnp.arctan2(jnp.dot(across(second, first), second), jnp.dot(first, second))
        return eqx.tree_at(lambda law: law.shaft_angle, self, angle, is_leaf=lambda x: x is None)

    def _cone(self, angle):
        """Angle [rad] of the cone of A: sin(c_A) / z_A = sin(c_B) / z_B, the two add to that of the axes."""
        return jnp.arctan2(jnp.sin(angle), self.teeth[1] / self.teeth[0] + jnp.cos(angle))

    def drawing(self) -> Drawing:
        """The rims at the mean radii, with lines from them to the apex."""
        angle = np.pi / 2 if self.shaft_angle is None else float(self.shaft_angle)
        cones = float(self._cone(angle)), angle - float(self._cone(angle))
        around = np.linspace(0.0, 2 * np.pi, _AROUND)
        circle = np.column_stack([np.cos(around), np.sin(around), np.ones(_AROUND)])
        line = np.concatenate([circle, np.zeros((1, 3)), circle[_AROUND // 2][None]])
        sizes = ((r, r, r / np.tan(cone)) for r, cone in zip(np.asarray(self.radii), cones, strict=True))
        return tuple(Path(line * size, frame) for frame, size in enumerate(sizes))

    def _pitch_point(self, rotations, positions):
        first, second = rotations[0, :, 2], rotations[1, :, 2]
        to_second, to_first = across(second, first), across(first, second)
        now = jnp.arctan2(jnp.dot(to_second, second), jnp.dot(first, second))
        cut = now if self.shaft_angle is None else self.shaft_angle
        cone = self._cone(cut)
        apart = jnp.cos(cone) * to_second - jnp.sin(cone) * first
        tangent = jnp.cross(first, to_second)
        angle = angle_about(first, rotations[0, :, 0], to_second)
        other = angle_about(second, rotations[1, :, 0], to_first)
        cycle = within_a_tooth(self.teeth[0] * angle + self.teeth[1] * other + self.phase)
        shift = positions[0] - positions[1]
        turned = self.module / 2 * cycle + jnp.dot(tangent, shift)
        nearer = jnp.dot(apart, shift) + self.radii[0] / jnp.sin(cone) * (cut - now)
        side, alpha = np.array([1.0, -1.0]), self.pressure_angle
        return PitchPoint(side * jnp.cos(alpha) * turned + jnp.sin(alpha) * nearer - self.backlash / 2)

    def faults(self) -> list[str]:
        """Two whole numbers of teeth; positive module and stiffness."""
        two = isinstance(self.teeth, tuple) and len(self.teeth) == 2
        if not two:
            return [f"teeth are two whole numbers, got {self.teeth!r}"]
        angle = np.pi / 2 if self.shaft_angle is None else self.shaft_angle
        wrong = any_concrete(lambda s: ~((s > 0) & (s < np.pi)), angle)
        return self._mesh_faults(self.teeth) + faults_if((wrong, "shaft_angle is between 0 and pi"))
