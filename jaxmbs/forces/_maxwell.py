"""Maxwell's element: a spring and a damper in series."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, not_positive
from ..drawings import Drawing, Symbol
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._element_bonds import ElementBond, ElementBonds
from ._fields import number
from ._internal_state import InternalState, States


class Maxwell(AbstractScalarLaw):
    """Spring k and damper c in series: the force of a steady stretch decays with the time c / k.

    Its internal state "stretch" is that of the spring z [m or rad], `dz/dt = v - (k / c) z`, and its effort `-k z`
    drives x back where z is positive; it starts relaxed.  Beside a `SpringDamper` it is the standard linear solid
    (Zener).

    Attributes:
        stiffness: k > 0 [N/m or N m/rad].
        damping: c > 0 [N s/m or N m s/rad].
    """

    stiffness: Convertible[Scalar] = eqx.field(converter=number)
    damping: Convertible[Scalar] = eqx.field(converter=number)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"stretch": InternalState(unit="m or rad")}

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """`v - (k / c) z` [m/s or rad/s]."""
        return {"stretch": v - self.stiffness / self.damping * s["stretch"]}

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`-k z` [N or N m]."""
        return -self.stiffness * s["stretch"]

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`k/2 z^2` [J]."""
        return self.stiffness / 2.0 * jnp.square(s["stretch"])

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """Spring and damper at the force that they share."""
        force, creep = self.stiffness * s["stretch"], self.stiffness / self.damping * s["stretch"]
        return {
            "1:port -> 0:force": ElementBond(force, v),
            "0:force -> C:spring": ElementBond(force, v - creep),
            "0:force -> R:damper": ElementBond(force, creep),
        }

    def drawing(self) -> Drawing:
        """Spring and damper in series."""
        return (Symbol("maxwell"),)

    def faults(self) -> list[str]:
        """Stiffness and damping must be positive."""
        checks = (
            (not_positive(self.stiffness), "stiffness must be positive"),
            (not_positive(self.damping), "damping must be positive"),
        )
        return super().faults() + faults_if(*checks)
