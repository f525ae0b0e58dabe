"""Spur and helical gears in mesh: forces along the line of action, backlash, mesh stiffness and damping."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..checks import any_concrete, faults_if, flag, is_concrete, may_be_nonzero, negative, not_positive
from ..drawings import Drawing, Gear
from ..math._linalg import safe_norm, skew
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._base import AbstractPathLaw, PathKinematics
from ._fields import number
from ._one_sided import one_sided, one_sided_integral, one_sided_slope, passive_sum
from ._readings import Reading
from ._validity import MOST_TILT, Margin, tooth_margins


class MeshState(NamedTuple):
    """Mesh of two gears at one instant.

    Attributes:
        approach: of the two flanks along the line of action, drive side then coast side; positive where pressed [m].
        force: (2,) normal to the teeth, of the drive and the coast side [N].
        pressure_angle: working transverse pressure angle at this centre distance [rad].
    """

    approach: Array
    force: Array
    pressure_angle: Array


_WIDTH = 0.4  # of drawn wheels over the smaller radius


class GearPair(AbstractPathLaw):
    """Involute gears A and B that turn about the z axes of their frames, in mesh; see `SystemBuilder.gear_pair`.

    The teeth press along the line of action, the common tangent of the base circles: with the normal force N the
    wheels feel `N cos(alpha)` along the pitch circles and `N sin(alpha)` apart, helical ones also along their axes,
    so that bearings carry the right loads.  Drive and coast side approach by

        `r_bA a + r_bB b - play` and `-(r_bA a + r_bB b) - play`,  play = (r_bA + r_bB) (inv w - inv alpha_t) + j / 2

    with the angles a, b of the wheels from the line of centres, the base radii, the working pressure angle w at the
    present centre distance d, `cos w = (r_bA + r_bB) / d`, and the backlash j along the line of action.  All forces
    are the derivative of one potential, so a gear on soft bearings keeps its energy.  The teeth are found modulo
    their pitch: no joint is needed, wheels turn any number of times, and their centres may move (planets on a
    carrier).  The axes are taken as parallel to that of A.  Of a ring gear b counts negative, and the wheels are
    pressed together.

    Attributes:
        teeth: numbers of teeth of A and B (static); module: normal module, tooth pitch over pi [m].
        pressure_angle: normal, at the pitch circles [rad]; helix_angle: at the pitch cylinders, positive where A is
            right-handed [rad].
        internal: True where B is a ring gear around A (static).
        stiffness: k of the teeth along their normal [N/m]; damping: c >= 0 while they touch [N s/m].
        backlash: j >= 0, play along the normal of the teeth [m].
        phase: of the mesh [rad], 2 pi for a tooth: the teeth are in the middle of their play where it is zero and the
            x axes of both frames point from A to B.
        transition: half of the approach over which the teeth come into touch [m].
    """

    teeth: tuple[int, int] = eqx.field(static=True)
    module: Convertible[Scalar] = eqx.field(converter=number)
    pressure_angle: Convertible[Scalar] = eqx.field(converter=number, default=np.pi / 9)
    helix_angle: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    internal: bool = eqx.field(static=True, converter=flag("internal"), default=False)
    stiffness: Convertible[Scalar] = eqx.field(converter=number, default=1e8)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    backlash: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    phase: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    transition: Convertible[Scalar] = eqx.field(converter=number, default=1e-6)

    @property
    def num_frames(self) -> int:
        """Two wheels."""
        return 2

    @property
    def largest_damping(self) -> ArrayLike:
        return self.damping

    @property
    def dissipates(self) -> bool:
        """True for damping."""
        return may_be_nonzero(self.damping)

    @property
    def radii(self) -> Array:
        """Pitch radii (2,) of A and B [m]: `z m / (2 cos(helix angle))`."""
        return self.module / (2 * jnp.cos(self.helix_angle)) * np.asarray(self.teeth, float)

    @property
    def centre_distance(self) -> Array:
        """Nominal distance of the axes [m]."""
        first, second = self.radii
        return second - first if self.internal else first + second

    @property
    def transverse_angle(self) -> Array:
        """Pressure angle across the axes [rad]."""
        return jnp.arctan(jnp.tan(self.pressure_angle) / jnp.cos(self.helix_angle))

    def drawing(self) -> Drawing:
        """Gears of the pitch radii, a tooth of A on its axis x and a gap of B where the phase wants it."""
        first, second = map(float, np.asarray(self.radii))
        width, (a, b), phase = _WIDTH * min(first, second), self.teeth, float(self.phase)
        gap = (1 + b - a) * np.pi - phase if self.internal else (b - 1) * np.pi + phase
        return Gear(first, width, a, 0.0, 0), Gear(second, width, b, gap / b, 1, self.internal)

    def report(self, *args: Any) -> dict[str, Reading]:
        """Approach and normal force of both sides of the teeth, of the arguments of `wrench`."""
        found, sides = self.state(*args), ("drive", "coast")
        return {"approach": Reading(found.approach, "m", sides), "tooth force": Reading(found.force, "N", sides)}

    def wrench(self, frames: PathKinematics, t: ScalarLike) -> tuple[Float[Array, "2 3"], Float[Array, "2 3"]]:
        """Forces and moments of both sides of the teeth."""
        sides, pull_back = jax.vjp(self._approach, frames.rotations, frames.positions)
        by_R, on_x = jax.vmap(pull_back)(jnp.eye(2, dtype=sides.dtype))
        M = jnp.einsum("snij,nkj->snik", by_R, frames.rotations)
        axial = (M[..., 2, 1] - M[..., 1, 2], M[..., 0, 2] - M[..., 2, 0], M[..., 1, 0] - M[..., 0, 1])
        on_turn = jnp.stack(axial, axis=-1)
        rate = jax.vmap(frames.power)(on_x, on_turn)
        force = self._normal_forces(sides, rate)
        return -jnp.einsum("s,snj->nj", force, on_x), -jnp.einsum("s,snj->nj", force, on_turn)

    def potential(self, rotations: Float[Array, "2 3 3"], positions: Float[Array, "2 3"], t: ScalarLike) -> Scalar:
        """Energy of the pressed teeth [J]."""
        approach = self._approach(rotations, positions)
        return self.stiffness * jnp.sum(one_sided_integral(approach, self.transition))

    def validity(self, frames: PathKinematics, t: ScalarLike) -> dict[str, Margin]:
        """Distances [m] to wheels whose teeth no longer reach into each other, or into their base circles, to teeth
        pressed by a quarter of their pitch, and the angle that is left to axes that are not parallel [rad]."""
        R, x = frames.rotations, frames.positions
        axis, other, between = R[0, :, 2], R[1, :, 2], x[1] - x[0]
        distance = safe_norm(between - jnp.dot(axis, between) * axis)
        side = -1.0 if self.internal else 1.0
        base = distance - self.centre_distance * jnp.cos(self.transverse_angle)
        tilt = jnp.arctan2(safe_norm(jnp.cross(axis, other)), jnp.abs(jnp.dot(axis, other)))
        return tooth_margins(self, side * (self.centre_distance - distance), self._approach(R, x)) | {
            "base circles": Margin(base, "m", "has its wheels so near that they have no line of action"),
            "tilt": Margin(MOST_TILT - tilt, "rad", "has axes that are not parallel"),
        }

    def state(self, frames: PathKinematics, t: ScalarLike) -> MeshState:
        """Approach and forces of both sides."""
        places = frames.rotations, frames.positions
        rates = (jax.vmap(skew)(frames.angular_velocities) @ frames.rotations, frames.velocities)
        approach, rate = jax.jvp(self._approach, places, rates)
        return MeshState(approach, self._normal_forces(approach, rate), self._mesh(*places)[1])

    def _normal_forces(self, approach, rate):
        """Forces (2,) of the drive and the coast side [N]."""
        resisting = self.damping * one_sided_slope(approach, self.transition) * rate
        return passive_sum(self.stiffness * one_sided(approach, self.transition), resisting)

    def _approach(self, rotations, positions):
        """Approach (2,) of the drive and the coast side along the normal of the teeth [m]."""
        along, working, transverse, base = self._mesh(rotations, positions)
        sign = -1.0 if self.internal else 1.0
        spread = (jnp.tan(working) - working) - (jnp.tan(transverse) - transverse)
        play = (base[0] + sign * base[1]) * spread
        helix = jnp.arctan(jnp.tan(self.helix_angle) * jnp.cos(transverse))  # at the base cylinder
        return jnp.cos(helix) * jnp.stack([along - play, -along - play]) - self.backlash / 2

    def _mesh(self, rotations, positions):
        """(arc along the base circles, working and nominal transverse pressure angle, base radii)."""
        first, second = positions
        axis = rotations[0, :, 2]
        between = second - first
        climb = jnp.dot(axis, between)
        between = between - climb * axis
        distance = safe_norm(between)
        centre = between / jnp.where(distance > 0, distance, 1.0)
        across = jnp.cross(axis, centre)
        angle = jnp.stack([_angle(rotations[k, :, 0], centre, across) for k in range(2)])
        transverse = self.transverse_angle
        teeth = np.asarray(self.teeth, float)
        sign = -1.0 if self.internal else 1.0
        slip = climb * jnp.tan(self.helix_angle) / self.radii[0] * teeth[0]  # a shift along the axis turns the mesh
        cycle = teeth[0] * angle[0] + sign * teeth[1] * angle[1] + slip + self.phase
        cycle = cycle - 2 * np.pi * jnp.round(jax.lax.stop_gradient(cycle) / (2 * np.pi))
        base = self.radii * jnp.cos(transverse)
        cosine = jnp.abs(base[0] + sign * base[1]) / jnp.where(distance > 0, distance, 1.0)
        working = jnp.arccos(jnp.where(cosine < 1.0, cosine, 1.0 - 1e-9))
        return base[0] / teeth[0] * cycle, working, transverse, base

    def faults(self) -> list[str]:
        """Whole numbers of teeth; a ring gear has more than its pinion; positive module and stiffness."""
        z, alpha = self.teeth, self.pressure_angle
        whole = len(z) == 2 and all(isinstance(n, int) and not isinstance(n, bool) and n > 0 for n in z)
        found = super().faults() + faults_if(
            (not whole, f"teeth are two whole numbers, got {z!r}"),
            (whole and max(z) > 10**5, f"teeth are at most 100000, got {z!r}"),
            (whole and self.internal and not z[1] > z[0], "a ring gear B has more teeth than A"),
            (not_positive(self.module), "module must be positive"),
            (any_concrete(lambda a: (a <= 0) | (a >= np.pi / 4), alpha), "pressure_angle is between 0 and pi/4"),
            (
                any_concrete(lambda a: np.abs(a) >= np.pi / 3, self.helix_angle),
                "helix_angle is between -pi/3 and pi/3",
            ),
            (not_positive(self.stiffness), "stiffness must be positive"),
            (negative(self.damping), "damping must not be negative"),
            (negative(self.backlash), "backlash must not be negative"),
            (not_positive(self.transition), "transition must be positive"),
        )
        if whole and is_concrete(self) and not found:
            pitch = np.pi * float(self.module) * np.cos(float(self.pressure_angle))
            found += faults_if(
                (bool(float(self.backlash) >= pitch / 2), "backlash must be less than half a tooth pitch")
            )
        return found


def _angle(x, centre, across):
    """Angle of an axis from the line of centres."""
    return jnp.arctan2(jnp.dot(across, x), jnp.dot(centre, x))
