"""Linear spring and damper in parallel."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, may_be_nonzero, negative
from ..math._linalg import direction, safe_norm
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike, Vector3
from ._base import AbstractScalarLaw
from ._fields import number


class SpringDamper(AbstractScalarLaw):
    """Spring `k (x - x0) + preload` beside a damper `c v`.

    On a joint x is its coordinate and a positive sum drives it back [m or rad]; between two points x is their
    distance [m] and v its rate, and a positive sum is tension. Zero effort at `x = free_length` and rest, when
    `preload` is zero. Negative stiffness is allowed.
    Springs, then dampers. Source: S2 (56)-(67), (72)-(74).

    Attributes:
        stiffness: k [N/m or N m/rad].
        damping: c >= 0 [N s/m or N m s/rad].
        free_length: x0 [m or rad].
        preload: tension at the free length [N or N m].
    """

    stiffness: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    free_length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    preload: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """`-(k (x - x0) + preload + c v)`. Source: S2 (56)-(57), (72)."""
        return -(self.stiffness * (x - self.free_length) + self.preload + self.damping * v)

    def potential(self, x: ScalarLike, t: ScalarLike) -> Scalar:
        """`k/2 (x - x0)^2 + preload (x - x0)` [J]."""
        stretch = x - self.free_length
        return self.stiffness * stretch**2 / 2 + self.preload * stretch

    def line_force(self, d: Vector3, v: Vector3, t: ScalarLike) -> Vector3:
        """`-k (d - x0 n) - preload n - c n n.v` on B, smooth through zero length when x0 and preload are zero.

        Source: S2 (57)-(58), (72).
        """
        n = direction(d)
        along = self.stiffness * self.free_length - self.preload - self.damping * jnp.dot(n, v)
        return -self.stiffness * d + along * n

    def line_potential(self, d: Vector3, t: ScalarLike) -> Scalar:
        """`k/2 |d|^2 - (k x0 - preload) |d|` and the constant that makes it zero at the free length [J]."""
        x0, k = self.free_length, self.stiffness
        return k / 2 * (jnp.dot(d, d) + x0**2) - (k * x0 - self.preload) * safe_norm(d) - self.preload * x0

    @property
    def stores(self) -> bool:
        return may_be_nonzero(self.stiffness, self.preload)

    @property
    def largest_damping(self) -> ArrayLike:
        return self.damping

    @property
    def dissipates(self) -> bool:
        return may_be_nonzero(self.damping)

    def faults(self) -> list[str]:
        """Damping must not be negative."""
        return super().faults() + faults_if((negative(self.damping), "damping must not be negative"))
