"""Springs with memory: a Prony series, of a scalar displacement and of a bushing."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import faults_if, negative, not_positive
from ..drawings import Drawing, Symbol
from ..math._rotation import rotation_vector
from ..typing import Convertible, Matrix3, Scalar, ScalarLike, Vector3
from ._base import AbstractPoseLaw, AbstractScalarLaw
from ._bushing import moment_of_gradient
from ._element_bonds import ElementBond, ElementBonds
from ._fields import number
from ._internal_state import InternalState, States


class Prony(AbstractScalarLaw):
    """Rubber as a Prony series (generalised Maxwell model): a spring k0 beside n springs k_i that relax in times T_i.

    `effort = -k0 (x - x0) - sum k_i z_i` with `dz_i/dt = v - z_i / T_i`; of a vibration its complex stiffness is
    `k0 + sum k_i i w T_i / (1 + i w T_i)`. The stretches z_i are its internal state "stretch" (n,).

    Attributes:
        stiffness: k0 >= 0, felt by slow motions [N/m or N m/rad].
        branches: k_i >= 0 (n,) [N/m or N m/rad].
        times: T_i > 0 (n,) [s].
        free_length: x0 [m or rad].
    """

    stiffness: Convertible[Scalar] = eqx.field(converter=number)
    branches: Convertible[Float[Array, " n"]] = eqx.field(converter=number)
    times: Convertible[Float[Array, " n"]] = eqx.field(converter=number)
    free_length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"stretch": InternalState(self.times.shape, "m or rad")}

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """`v - z_i / T_i` [m/s or rad/s]."""
        return {"stretch": v - s["stretch"] / self.times}

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`-k0 (x - x0) - sum k_i z_i` [N or N m]."""
        return -self.stiffness * (x - self.free_length) - jnp.sum(self.branches * s["stretch"])

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`k0/2 (x - x0)^2 + sum k_i/2 z_i^2` [J]."""
        relaxing = jnp.sum(self.branches * jnp.square(s["stretch"]))
        return 0.5 * (self.stiffness * jnp.square(x - self.free_length) + relaxing)

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """The spring, and springs and dampers of the branches (n,)."""
        forces, creep = self.branches * s["stretch"], s["stretch"] / self.times
        return {
            "1:port -> C:static": ElementBond(self.stiffness * (x - self.free_length), v),
            "1:port -> 0:branches": ElementBond(forces, v * jnp.ones_like(forces)),
            "0:branches -> C:springs": ElementBond(forces, v - creep),
            "0:branches -> R:dampers": ElementBond(forces, creep),
        }

    def drawing(self) -> Drawing:
        """A spring beside one of the branches."""
        return Symbol("spring"), Symbol("maxwell")

    def faults(self) -> list[str]:
        """Springs do not push, relaxation takes time."""
        return super().faults() + _faults(self)


class PronyBushing(AbstractPoseLaw):
    """Rubber mount with memory: `Prony` in each of the six coordinates of a `Bushing`, its axes and its zero.

    Attributes:
        stiffness: (6,) felt by slow motions [N/m and N m/rad].
        branches: (n, 6) of the relaxing springs [N/m and N m/rad].
        times: (n,) in which they relax [s].
    """

    stiffness: Convertible[Float[Array, " 6"]] = eqx.field(converter=number)
    branches: Convertible[Float[Array, "n 6"]] = eqx.field(converter=number)
    times: Convertible[Float[Array, " n"]] = eqx.field(converter=number)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"stretch": InternalState((*self.times.shape, 6), "m and rad")}

    def rate(
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> States:
        """Rates of the coordinates less `z_i / T_i`."""
        vector = rotation_vector(rotation)
        moving = jnp.concatenate([velocity, _turning(vector, angular_velocity)])
        return {"stretch": moving[None, :] - s["stretch"] / self.times[:, None]}

    def wrench(  # type: ignore[override]
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> tuple[Vector3, Vector3]:
        """Force and moment of all springs on B."""
        vector = rotation_vector(rotation)
        static = self.stiffness * jnp.concatenate([displacement, vector])
        gradient = static + jnp.sum(self.branches * s["stretch"], axis=0)
        return -gradient[:3], -moment_of_gradient(vector, gradient[3:])

    def potential(self, rotation: Matrix3, displacement: Vector3, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """Energy of all springs [J]."""
        z = jnp.concatenate([displacement, rotation_vector(rotation)])
        return 0.5 * (jnp.sum(self.stiffness * z**2) + jnp.sum(self.branches * jnp.square(s["stretch"])))

    def bonds(
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> ElementBonds:
        """Springs and dampers on the six coordinates, whose rates follow from the twist, turning first."""
        force, moment = self.wrench(rotation, displacement, angular_velocity, velocity, s, t)
        vector = rotation_vector(rotation)
        moving = jnp.concatenate([velocity, _turning(vector, angular_velocity)])
        static = self.stiffness * jnp.concatenate([displacement, vector])
        forces, creep = self.branches * s["stretch"], s["stretch"] / self.times[:, None]
        flat, all_moving = forces.reshape(-1), jnp.broadcast_to(moving, forces.shape).reshape(-1)
        twist = jnp.concatenate([angular_velocity, velocity])
        return {
            "1:port -> MTF:coordinates": ElementBond(-jnp.concatenate([moment, force]), twist),
            "MTF:coordinates -> 1:rates": ElementBond(static + jnp.sum(forces, axis=0), moving),
            "1:rates -> C:static": ElementBond(static, moving),
            "1:rates -> 0:branches": ElementBond(flat, all_moving),
            "0:branches -> C:springs": ElementBond(flat, all_moving - creep.reshape(-1)),
            "0:branches -> R:dampers": ElementBond(flat, creep.reshape(-1)),
        }

    def faults(self) -> list[str]:
        """Springs do not push, relaxation takes time; shapes."""
        shapes = self.stiffness.shape, self.branches.shape
        if shapes != ((6,), (*self.times.shape, 6)):
            return [f"stiffness (6,) and branches (n, 6) for n times, got {shapes[0]} and {shapes[1]}"]
        return super().faults() + _faults(self)


def _turning(vector, angular_velocity):
    """Rate (3,) of a rotation vector: moments are the transpose of its map from angular velocities."""
    return jax.vmap(lambda e: moment_of_gradient(vector, e))(jnp.eye(3, dtype=vector.dtype)) @ angular_velocity


def _faults(law):
    return faults_if(
        (negative(law.stiffness), "stiffness must not be negative"),
        (negative(law.branches), "branches must not be negative"),
        (not_positive(law.times), "times must be positive"),
        (law.branches.shape[:1] != law.times.shape, "branches and times must be as many"),
    )
