"""Friction of lubricated bearings."""

import equinox as eqx

from ..runtime import as_array
from ..typing import Convertible, Scalar, ScalarLike
from ._coulomb import SmoothCoulomb
from ._curves import tanh_over


class BearingFriction(SmoothCoulomb):
    """Friction of a bearing: a part that follows the load as `SmoothCoulomb`, a viscous part, and its seals.

    At a slip s under a load N the friction is `mu(s) N + seal tanh(s / transition_speed) + viscous s`.  Of a rolling
    bearing give its mean radius as the radius of the place; `dynamic` is then the coefficient of rolling friction,
    0.001 to 0.003.  With `static` and `viscous` it is the Stribeck curve of a plain bearing.

    Attributes:
        dynamic, static, transition_speed, stribeck_speed: as of `SmoothCoulomb`.
        viscous: friction over slip that follows no load, of the grease >= 0 [N s/m].
        seal: friction that follows no load, of the seals >= 0 [N].
    """

    viscous: Convertible[Scalar] = eqx.field(converter=as_array, default=0.0)
    seal: Convertible[Scalar] = eqx.field(converter=as_array, default=0.0)

    def drag(self, square: ScalarLike) -> Scalar:
        """Viscous part and seals over the speed [N s/m], from the square of the speed."""
        scaled = square / self.transition_speed**2
        return self.viscous + self.seal / self.transition_speed * tanh_over(scaled)

    @property
    def breakaway_drag(self) -> Scalar:
        """The seals [N]."""
        return self.seal
