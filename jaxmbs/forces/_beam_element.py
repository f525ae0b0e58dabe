"""Element of a geometrically exact beam between two cross sections, by the screw from one to the other."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, negative
from ..drawings import Drawing, Symbol
from ..math._linalg import safe_norm
from ..math._screw import screw_of_pose, screw_rate, wrench_of_screw_gradient
from ..typing import ArrayLike, Convertible, Matrix3, Scalar, ScalarLike, Vector3
from ._base import AbstractPoseLaw
from ._fields import number, optional_number
from ._validity import Margin

#: Rotation [rad] between the sections of an element, below the half turn up to which the screw is known.
MOST_TURN = 3.0


class BeamElement(AbstractPoseLaw):
    """Piece of a beam between cross sections A and B, whose line is a helix between them (helical interpolation).

    Stretch, shear, twist and bending (6,) are the screw that takes A to B, less that without load; the energy is
    `(s - s0)^T K (s - s0) / 2` for any rotation below half a turn, and the wrench its exact gradient.  Constant
    bending and twist are exact with one element.  `SystemBuilder.beam` declares a whole beam, and
    `BeamSection.element_stiffness` gives K.
    Source: Borri and Bottasso, Int. J. Numer. Methods Eng. 37 (1994) 2267-2289; Sonneville, Cardona and Bruls,
    Comput. Methods Appl. Mech. Eng. 268 (2014) 451-474.

    Attributes:
        stiffness: (6, 6) symmetric, positive definite, of stretch and shears, then twist and bendings [N/m, N, N m].
        screw: (6,) of B from A without load: translation [m], rotation vector [rad], in A axes; of a straight piece
            (length, 0, 0, 0, 0, 0).
        damping: time by which it multiplies the rate of the screw in the stiffness [s], or None.
    """

    is_steep: ClassVar[bool] = True

    stiffness: Convertible[Float[Array, "6 6"]] = eqx.field(converter=number)
    screw: Convertible[Float[Array, " 6"]] = eqx.field(converter=number)
    damping: Convertible[Float[Array, ""] | None] = eqx.field(converter=optional_number, default=None)

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """`-(d potential) - damping K rate` on B."""
        screw = screw_of_pose(rotation, displacement)
        stretch = screw - self.screw
        if self.damping is not None:
            stretch = stretch + self.damping * screw_rate(screw, displacement, velocity, angular_velocity)
        gradient = (self.stiffness + self.stiffness.T) @ stretch / 2
        force, moment = wrench_of_screw_gradient(screw, displacement, gradient)
        return -force, -moment

    def potential(self, rotation: Matrix3, displacement: Vector3, t: ScalarLike) -> Scalar:
        """`(s - s0)^T K (s - s0) / 2` [J]."""
        stretch = screw_of_pose(rotation, displacement) - self.screw
        return stretch @ self.stiffness @ stretch / 2

    def validity(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> dict[str, Margin]:
        """Rotation between the sections that is left to half a turn [rad]."""
        skewed = rotation - rotation.T  # of size sqrt(8) sin(angle); the trace is 1 + 2 cos(angle)
        angle = jnp.arctan2(safe_norm(skewed.reshape(-1)) / np.sqrt(2.0), jnp.trace(rotation) - 1.0)
        end = "bends by nearly half a turn between its ends, give the beam more elements"
        return {"turn": Margin(MOST_TURN - angle, "rad", end)}

    def stress(self, rotation: Matrix3, displacement: Vector3) -> Float[Array, " 6"]:
        """Forces and moments (6,) of the stretch, `K (s - s0)`."""
        return (self.stiffness + self.stiffness.T) @ (screw_of_pose(rotation, displacement) - self.screw) / 2

    def under(self, stress: Float[Array, "... 6"]) -> "BeamElement":
        """The element under a stress that a search gives, with the slope of its own; NaN for its own stress."""
        return _BeamElementUnderStress(self.stiffness, self.screw, self.damping, stress)

    def drawing(self) -> Drawing:
        """A piece of a beam."""
        return (Symbol("beam"),)

    @property
    def largest_damping(self) -> ArrayLike:
        return 0.0 if self.damping is None else self.damping * jnp.max(jnp.abs(self.stiffness), axis=(-2, -1))

    @property
    def dissipates(self) -> bool:
        return self.damping is not None

    def faults(self) -> list[str]:
        """Stiffness is symmetric and positive definite, the screw has a length, damping dissipates."""
        found = super().faults()
        if self.stiffness.shape != (6, 6) or self.screw.shape != (6,):
            return [*found, "stiffness must be (6, 6) and screw (6,)"]
        return found or faults_if(
            (any_concrete(_not_definite, self.stiffness), "stiffness must be symmetric and positive definite"),
            (any_concrete(lambda s: not np.any(s[:3]), self.screw), "screw must have a length without load"),
            (
                any_concrete(lambda s: np.linalg.norm(s[3:]) > MOST_TURN, self.screw),
                "screw must turn less than half a turn",
            ),
            (self.damping is not None and negative(self.damping), "damping must not be negative [s]"),
        )


class _BeamElementUnderStress(BeamElement):
    """`BeamElement.under`; `given`: (6,) the stress."""

    given: Float[Array, "... 6"] = eqx.field(kw_only=True)

    def __init__(self, stiffness, screw, damping, given):
        self.stiffness, self.screw, self.damping, self.given = stiffness, screw, damping, given

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        own = self.stress(rotation, displacement)
        stress = jnp.where(jnp.isnan(self.given), own, self.given + (own - lax.stop_gradient(own)))
        screw = screw_of_pose(rotation, displacement)
        if self.damping is not None:
            rate = screw_rate(screw, displacement, velocity, angular_velocity)
            stress = stress + (self.stiffness + self.stiffness.T) @ rate * self.damping / 2
        force, moment = wrench_of_screw_gradient(screw, displacement, stress)
        return -force, -moment


def _not_definite(matrix):
    asymmetric = np.abs(matrix - matrix.T).max() > 1e-6 * np.abs(matrix).max()
    return bool(asymmetric or np.linalg.eigvalsh(matrix + matrix.T)[0] <= 0.0)
