"""Six-degree bushing between two frames; with rotational stiffness alone, a rotational spring."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, may_be_nonzero
from ..math._rotation import rotation_vector, rotation_vector_coefficient
from ..typing import ArrayLike, Convertible, Matrix3, Scalar, ScalarLike, Vector3
from ._base import AbstractPoseLaw
from ._fields import number


def six_by_six(value) -> Float[Array, "6 6"]:
    """Full matrix from (6, 6), a diagonal (6,), or the pair (translational, rotational) of scalars."""
    value = number(value)
    if value.shape == (2,):
        value = jnp.repeat(value, 3)
    if value.shape == (6,):
        value = jnp.diag(value)
    if value.shape != (6, 6):
        raise ValueError(f"expected translational, rotational terms as a pair, (6,) or (6, 6): {value.shape}")
    return value


class Bushing(AbstractPoseLaw):
    """Elastic mount on `z = (displacement, rotation vector)` of B seen from A, in A axes.

    The wrench of the springs is the exact gradient of the potential for large rotations too (below half a
    turn), so a motion without damping keeps its energy. The damper acts on the relative twist. Zero
    configuration: B on A. Stiffness and damping are translational then rotational: (6, 6), a diagonal (6,),
    or a pair of scalars. `Bushing((0.0, k))` is a rotational spring.
    Source: S2 (56)-(67), (72)-(74), with the rotation vector in place of the angles.

    Attributes:
        stiffness: (6, 6) symmetric [N/m, N/rad = N m/m, N m/rad].
        damping: (6, 6) positive semidefinite [N s/m, N s, N m s/rad].
        preload: (6,) force [N] and moment [N m] of the element in the zero configuration; B feels the
            opposite.
    """

    stiffness: Convertible[Float[Array, "6 6"]] = eqx.field(converter=six_by_six, default=(0.0, 0.0))
    damping: Convertible[Float[Array, "6 6"]] = eqx.field(converter=six_by_six, default=(0.0, 0.0))
    preload: Convertible[Float[Array, " 6"]] = eqx.field(converter=number, default=(0.0,) * 6)

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """`-(d potential) - C twist` on B. Source: S2 (56), (72)."""
        vector = rotation_vector(rotation)
        symmetric = (self.stiffness + self.stiffness.T) / 2
        gradient = symmetric @ jnp.concatenate([displacement, vector]) + self.preload
        damped = self.damping @ jnp.concatenate([velocity, angular_velocity])
        return -gradient[:3] - damped[:3], -moment_of_gradient(vector, gradient[3:]) - damped[3:]

    def potential(self, rotation: Matrix3, displacement: Vector3, t: ScalarLike) -> Scalar:
        """`z^T K z / 2 + preload^T z` [J]."""
        z = jnp.concatenate([displacement, rotation_vector(rotation)])
        return z @ self.stiffness @ z / 2 + self.preload @ z

    @property
    def stores(self) -> bool:
        return may_be_nonzero(self.stiffness, self.preload)

    @property
    def largest_damping(self) -> ArrayLike:
        return jnp.max(jnp.abs(self.damping), axis=(-2, -1))

    @property
    def dissipates(self) -> bool:
        return may_be_nonzero(self.damping)

    def faults(self) -> list[str]:
        """Stiffness is symmetric, damping dissipates."""
        found = super().faults()
        return found or faults_if(
            (self.preload.shape != (6,), "preload must have six components"),
            (any_concrete(_asymmetric, self.stiffness), "stiffness matrix must be symmetric"),
            (any_concrete(_indefinite, self.damping), "damping matrix must be positive semidefinite"),
        )


def moment_of_gradient(vector: Vector3, covector: Vector3) -> Vector3:
    """Moment that a gradient along the rotation vector makes on a small rotation in the fixed axes.

    `d vector = J_l^-1 d theta`, so the moment is `J_l^-T covector = c + v x c / 2 + b v x (v x c)`.
    """
    turn = jnp.cross(vector, covector)
    return covector + turn / 2 + rotation_vector_coefficient(vector @ vector) * jnp.cross(vector, turn)


def _asymmetric(matrix: np.ndarray) -> bool:
    return bool(np.abs(matrix - matrix.T).max() > 1e-6 * np.abs(matrix).max())


def _indefinite(matrix: np.ndarray) -> bool:
    eigenvalues = np.linalg.eigvalsh(matrix + matrix.T)
    return bool(eigenvalues[0] < -1e-6 * np.abs(eigenvalues).max())
