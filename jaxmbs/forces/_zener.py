"""The standard linear solid: a spring beside a spring and a damper in series."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, negative
from ..drawings import Drawing, Symbol
from ..typing import Convertible, Scalar, ScalarLike
from ._element_bonds import ElementBond, ElementBonds
from ._fields import number
from ._internal_state import States
from ._maxwell import Maxwell


class Zener(Maxwell):
    """Standard linear solid: a spring k0 `(x - x0)` beside `Maxwell`'s element of spring k and damper c.

    Slow motions feel k0, fast ones k0 + k. On a joint x is its coordinate [m or rad] and a positive sum drives it
    back; between two points x is their distance [m], and a positive sum is tension.

    Attributes:
        stiffness: k > 0 of the spring in series with the damper [N/m or N m/rad].
        damping: c > 0 [N s/m or N m s/rad].
        static_stiffness: k0 >= 0 [N/m or N m/rad].
        free_length: x0 [m or rad].
    """

    static_stiffness: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    free_length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`-k0 (x - x0) - k z` [N or N m]."""
        return super().effort(x, v, s, t) - self.static_stiffness * (x - self.free_length)

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`k0/2 (x - x0)^2 + k/2 z^2` [J]."""
        return super().potential(x, s, t) + self.static_stiffness / 2.0 * jnp.square(x - self.free_length)

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """Those of `Maxwell` and the spring beside them."""
        static = self.static_stiffness * (x - self.free_length)
        return super().bonds(x, v, s, t) | {"1:port -> C:static": ElementBond(static, v)}

    def drawing(self) -> Drawing:
        """A spring beside a spring and a damper in series."""
        return Symbol("spring"), Symbol("maxwell")

    def faults(self) -> list[str]:
        """Those of `Maxwell`; the other spring does not push."""
        return super().faults() + faults_if(
            (negative(self.static_stiffness), "static_stiffness must not be negative")
        )
