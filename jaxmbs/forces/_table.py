"""Spring and damper from measured curves."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, is_concrete, not_increasing
from ..math._interpolation import hermite, hermite_integral, pchip_slopes
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._fields import number, optional_number


class Table(AbstractScalarLaw):
    """Spring curve, and optionally a damper curve, through tabulated points.

    Monotone cubic interpolation (PCHIP) between the points, straight lines beyond them: C1, and without
    overshoot. The curves are those of the element under test, positive for a spring that resists increasing
    x: `Table([-1, 1], [-k, k])` equals `SpringDamper(k)`. Zero energy at the first point of the table. On a joint
    x is its coordinate; between two points it is their distance, not what it has grown by: shift a curve over
    the stretch by the free length. v is the rate of x.
    Source: S2 (56)-(67), (72)-(74), with curves in place of the constants.

    Attributes:
        x_points: (n,) displacements, increasing [m or rad].
        efforts: (n,) tension or restoring moment at these [N or N m].
        flow_points: (m,) rates, increasing [m/s or rad/s].
        damping_efforts: (m,) resisting effort at these [N or N m]; zero at rest, never along the flow.
    """

    x_points: Convertible[Float[Array, " n"]] = eqx.field(converter=number)
    efforts: Convertible[Float[Array, " n"]] = eqx.field(converter=number)
    flow_points: Convertible[Float[Array, " m"] | None] = eqx.field(converter=optional_number, default=None)
    damping_efforts: Convertible[Float[Array, " m"] | None] = eqx.field(converter=optional_number, default=None)

    def __check_init__(self):
        _check_curve(self.x_points, self.efforts)
        if (self.flow_points is None) != (self.damping_efforts is None):
            raise ValueError("a damper curve needs both flow_points and damping_efforts")
        if self.flow_points is not None:
            _check_curve(self.flow_points, self.damping_efforts)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Minus the curves at x and v. Source: S2 (56), (72)."""
        return -_curve(hermite, self.x_points, self.efforts, x) - self._damper(v)

    def potential(self, x: ScalarLike, t: ScalarLike) -> Scalar:
        """Integral of the spring curve from the first point [J]."""
        return _curve(hermite_integral, self.x_points, self.efforts, x)

    @property
    def dissipates(self) -> bool:
        return self.flow_points is not None

    def faults(self) -> list[str]:
        """Abscissae increase; the damper dissipates at every rate."""
        found = super().faults() + faults_if((not_increasing(self.x_points), "x_points must increase"))
        if self.flow_points is None or self.damping_efforts is None or not is_concrete(self):
            return found
        if not_increasing(self.flow_points):
            return [*found, "flow_points must increase"]
        slopes = pchip_slopes(self.flow_points, self.damping_efforts)
        return found + faults_if(
            (
                any_concrete(_supplies_power, self.flow_points, self.damping_efforts),
                "damping_efforts must oppose the flow",
            ),
            (
                any_concrete(_is_nonzero_at_rest, self._damper(number(0.0)), self.damping_efforts),
                "damping must be zero at rest",
            ),
            (any_concrete(_falls_at_ends, slopes), "damping must not fall at the ends"),
        )

    def length_faults(self) -> list[str]:
        """Some of the curve lies at distances that points can have."""
        never = any_concrete(lambda x: x[-1] <= 0, self.x_points)
        return faults_if((never, "x_points are distances between points: at least one must be positive"))

    def _damper(self, v):
        return 0.0 if self.flow_points is None else _curve(hermite, self.flow_points, self.damping_efforts, v)


def _curve(evaluate, points, values, x):
    return evaluate(points, values, pchip_slopes(points, values), x)


def _check_curve(points, values) -> None:
    if points.ndim != 1 or points.shape != values.shape or points.shape[0] < 2:
        raise ValueError(f"a curve needs two or more points, as many efforts: {points.shape}, {values.shape}")


def _supplies_power(flows, efforts):
    return flows * efforts < 0


def _is_nonzero_at_rest(at_rest, efforts):
    return np.abs(at_rest) > 1e-6 * np.abs(efforts).max()


def _falls_at_ends(slopes):
    return slopes[[0, -1]] < 0
