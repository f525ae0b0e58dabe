"""Sources of effort on a scalar displacement: any function, and a servo."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx

from ..checks import faults_if, negative
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._fields import as_law_function, number
from ._signals import AbstractSignal, Constant, as_signal, value_and_rate


def _effort(value):
    """A function of (x, v, t) from one, or from a number."""
    return as_law_function(value) if callable(value) else Constant(value)


class Actuator(AbstractScalarLaw):
    """Effort on the system along increasing x from `function(x, v, t)`; its power counts as input.

    On a joint x is its coordinate [m or rad] and the effort a force or moment; between two points x is their
    distance [m], v its rate, and a positive effort pushes them apart, as a hydraulic cylinder under pressure.

    Attributes:
        function: callable; the arrays of an `eqx.Module` are leaves, a plain function is static. Or a number, or a
            signal of time, such as `Ramp`.
    """

    function: Convertible[Callable[..., Any]] = eqx.field(converter=_effort)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("function",)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """`function(x, v, t)` [N or N m]."""
        if isinstance(self.function, AbstractSignal):
            return number(self.function(t))
        return number(self.function(x, v, t))


class PD(AbstractScalarLaw):
    """Servo that follows a target: `kp (target - x) + kd (rate of target - v)`; its power counts as input.

    On a joint x is its coordinate [m or rad]; between two points it is their distance [m], v its rate, and the
    target a length.

    Attributes:
        target: function of time or a number [m or rad]; one that a block drives has no rate here.
        kp: proportional gain >= 0 [N/m or N m/rad].
        kd: derivative gain >= 0 [N s/m or N m s/rad].
    """

    target: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    kp: Convertible[Scalar] = eqx.field(converter=number)
    kd: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("target",)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Effort towards the target [N or N m]."""
        wanted, wanted_rate = value_and_rate(self.target, t)
        return self.kp * (wanted - x) + self.kd * (wanted_rate - v)

    def faults(self) -> list[str]:
        """Gains must not be negative."""
        checks = (
            (negative(self.kp), "kp must not be negative"),
            (negative(self.kd), "kd must not be negative"),
        )
        return super().faults() + faults_if(*checks)

    def length_faults(self) -> list[str]:
        """A constant target is a length."""
        below = isinstance(self.target, Constant) and negative(self.target.value)
        return faults_if((below, "target is a distance between points and must not be negative"))
