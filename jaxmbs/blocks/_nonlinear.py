"""Blocks that are not linear: limits, a curve, a function of the user."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, not_increasing, not_positive
from ..forces._fields import as_law_function, number, optional_number
from ..forces._internal_state import InternalState, States
from ..math._interpolation import hermite, pchip_slopes
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractBlock
from ._controllers import clip
from ._zero_order_hold import lag_share


class Function(AbstractBlock):
    """`function(u, t)` of the user, without states: a sum of signals, a gain schedule, a mixer of several outputs.

    Attributes:
        function: callable; the arrays of an `eqx.Module` are leaves, a plain function is static.
    """

    function: Convertible[Callable[..., Any]] = eqx.field(converter=as_law_function)

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """`function(u, t)`."""
        return number(self.function(u, t))


class Saturation(AbstractBlock):
    """The input between two limits; its slope is zero beyond them.

    Attributes:
        lower, upper: limits, lower < upper.
    """

    lower: Convertible[Scalar] = eqx.field(converter=number)
    upper: Convertible[Scalar] = eqx.field(converter=number)
    unbounded: ClassVar[tuple[str, ...]] = ("lower", "upper")

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The limited input."""
        return clip(jnp.asarray(u), self.lower, self.upper)

    def faults(self) -> list[str]:
        """Order of the limits."""
        wrong = any_concrete(lambda a, b: a >= b, self.lower, self.upper)
        return super().faults() + faults_if((wrong, "lower must be below upper"))


class LookUp(AbstractBlock):
    """A curve through points: monotone cubics (PCHIP) between them, straight lines beyond them.

    Attributes:
        x: (n,) inputs, increasing; y: (n,) outputs there.
    """

    x: Convertible[Float[Array, " n"]] = eqx.field(converter=number)
    y: Convertible[Float[Array, " n"]] = eqx.field(converter=number)

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The curve at the input."""
        return hermite(self.x, self.y, pchip_slopes(self.x, self.y), u)

    def faults(self) -> list[str]:
        """Two or more points, with increasing inputs."""
        if self.x.ndim != 1 or self.x.shape != self.y.shape or self.x.shape[0] < 2:
            return [f"a curve needs two or more points, as many outputs: {self.x.shape}, {self.y.shape}"]
        return super().faults() + faults_if((not_increasing(self.x), "x must increase"))


class RateLimit(AbstractBlock):
    """A signal whose rate is limited: `dy/dt = (u - y) / time_constant`, between `-falling` and `rising`.

    It starts at the input.

    Attributes:
        rising: greatest rate > 0 [1/s].
        falling: likewise downwards > 0 [1/s]; default `rising`.
        time_constant: > 0 [s] with which it follows a slow input.
    """

    rising: Convertible[Scalar] = eqx.field(converter=number)
    falling: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    time_constant: Convertible[Scalar] = eqx.field(converter=number, default=0.01)

    @property
    def is_feedthrough(self) -> bool:
        return False

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"value": InternalState()}

    def start(self, u: Float[Array, "..."], t: ScalarLike) -> States:
        """The input."""
        return {"value": u}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """The limited rate."""
        return {"value": clip((u - s["value"]) / self.time_constant, *self._limits)}

    @property
    def _limits(self):
        return -(self.rising if self.falling is None else self.falling), self.rising

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """The value, and that after a period of an input that is held."""
        gap, (lower, upper) = u - s["value"], self._limits
        rate = jnp.where(gap > 0, upper, lower)
        limited = jnp.clip(gap / rate - self.time_constant, 0.0, period)  # time at the limit
        way = rate * limited
        return s["value"], {
            "value": s["value"] + way + lag_share((period - limited) / self.time_constant) * (gap - way)
        }

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The value."""
        return s["value"]

    def faults(self) -> list[str]:
        """Signs of the rates and the time constant."""
        return super().faults() + faults_if(
            (not_positive(self.rising), "rising must be positive"),
            (self.falling is not None and not_positive(self.falling), "falling must be positive, a rate downwards"),
            (not_positive(self.time_constant), "time_constant must be positive"),
        )
