"""S-N curve: cycles to failure over stress amplitude."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import faults_if, flag, is_concrete, not_positive
from ..errors import ModelError, warn
from ..forces._fields import number, optional_number
from ..runtime import as_dtype
from ..tables import fields_repr, format_number
from ..typing import ArrayLike, Convertible, Scalar
from ._arrays import float_array

#: Decimal logarithms of usual intercepts: curves of stresses over a strength have 1 or a million.
_LOGARITHMS = (5.0, 60.0)


class SN(eqx.Module):
    """S-N curve `N = intercept S^-slope`, S the stress **amplitude**, half the range, unless `ranges` is true.

    Attributes:
        intercept: cycles at unit stress, > 0; not their logarithm.
        slope: > 0, the exponent; below the knee `second_slope`.
        knee: stress at which the second slope begins, > 0; the curve is continuous there.
        second_slope: > 0, of stresses below the knee.
        limit: stress below which a cycle does no damage; above the knee it leaves the first slope alone.
        ranges: true if intercept, knee and limit refer to stress ranges.

    Raises: ModelError for numbers that are not positive and a knee without a second slope, or the reverse.
    """

    intercept: Convertible[Scalar] = eqx.field(converter=number)
    slope: Convertible[Scalar] = eqx.field(converter=number)
    knee: Any = eqx.field(converter=optional_number, default=None)
    second_slope: Any = eqx.field(converter=optional_number, default=None)
    limit: Any = eqx.field(converter=optional_number, default=None)
    ranges: bool = eqx.field(static=True, converter=flag("ranges"), default=False, kw_only=True)

    __repr__ = fields_repr

    def __check_init__(self):
        names = ("intercept", "slope", "knee", "second_slope", "limit")
        signs = [(not_positive(v), f"{n} must be positive") for n in names if (v := getattr(self, n)) is not None]
        signs += [(np.ndim(getattr(self, n)) > 0, f"{n} must be one number") for n in names]
        both = (self.knee is None) != (self.second_slope is None)
        faults = faults_if(*signs, (both, "knee and second_slope belong together: give both or none"))
        if faults:
            raise ModelError(faults, "the S-N curve")
        if is_concrete(self.intercept) and _LOGARITHMS[0] < float(self.intercept) < _LOGARITHMS[1]:
            cycles = format_number(self.intercept)
            warn(f"SN: {cycles} cycles at unit stress: is it the logarithm (intercept=10**{cycles})?")

    def in_amplitudes(self) -> "SN":
        """The same curve over amplitudes."""
        if not self.ranges:
            return self
        half = [None if v is None else 0.5 * v for v in (self.knee, self.limit)]
        return SN(self.intercept * 0.5**self.slope, self.slope, half[0], self.second_slope, half[1])

    def segments(self) -> list[tuple[Any, Any, Any, Any]]:
        """Parts of the curve over amplitudes: c and m of the damage `c S^m`, from and to (None: no bound)."""
        sn = self.in_amplitudes()
        if sn.knee is None:
            return [(1 / sn.intercept, sn.slope, sn.limit, None)]
        # of a limit above the knee the second slope has nothing
        at_knee = sn.knee**sn.slope / sn.intercept
        start = sn.knee if sn.limit is None else jnp.maximum(sn.knee, sn.limit)
        low = (
            at_knee * sn.knee**-sn.second_slope,
            sn.second_slope,
            sn.limit,
            start,
        )  # nothing if the limit is higher
        return [low, (1 / sn.intercept, sn.slope, start, None)]

    def damage(self, amplitudes: ArrayLike) -> Array:
        """Damage `1 / N` of one cycle of each amplitude (...)."""
        s = jnp.abs(float_array(amplitudes))
        acts = s > 0
        safe = jnp.where(acts, s, 1.0)  # the power of zero has no derivative
        total = jnp.zeros_like(safe)
        for scale, exponent, low, high in self.segments():
            inside = acts if low is None else acts & (s >= as_dtype(low, s.dtype))
            inside = inside if high is None else inside & (s < as_dtype(high, s.dtype))
            power = as_dtype(scale, s.dtype) * safe ** as_dtype(exponent, s.dtype)
            total = total + jnp.where(inside, power, 0.0)
        return total

    def cycles(self, amplitudes: ArrayLike) -> Array:
        """Cycles to failure N (...) at each amplitude; infinite below the limit."""
        return 1 / self.damage(amplitudes)
