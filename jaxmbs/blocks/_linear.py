"""Linear blocks: state spaces, rational transfer functions, a lag and a delay."""

import math
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, is_concrete, may_be_nonzero, not_positive
from ..forces._fields import number
from ..forces._internal_state import InternalState, States
from ..runtime import as_array
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._base import AbstractBlock
from ._zero_order_hold import canonical_matrices, lag_share, zero_order_hold

_MOST_SAMPLES = 10_000  # that a sampled delay holds, as states of the motion
_MOST_PADE = 10  # the coefficients of a higher order lose the digits that it would gain


def _matrix(value: Any) -> Array:
    """An array of floats as it is, else one of the default type."""
    return value if isinstance(value, jax.Array) and jnp.issubdtype(value.dtype, jnp.floating) else as_array(value)


class StateSpace(AbstractBlock):
    """`dx/dt = A x + B u`, `y = C x + D u`, at rest at the start; that of a linearisation serves as it is.

    Of a linearisation x are its coordinates (n,), velocities (N,) and internal states (ns,), as differences from the
    state that it is about. `A, B, C, D = space` takes it apart.

    Attributes:
        A: (n, n); B: (n, k) of k inputs; C: (m, n) of m outputs, one of which is a number (); D: (m, k).
    """

    A: Convertible[Float[Array, "n n"]] = eqx.field(converter=_matrix)
    B: Convertible[Float[Array, "n k"]] = eqx.field(converter=_matrix)
    C: Convertible[Float[Array, "m n"]] = eqx.field(converter=_matrix)
    D: Convertible[Float[Array, "m k"]] = eqx.field(converter=_matrix)

    def __iter__(self) -> Iterator[Array]:
        return iter((self.A, self.B, self.C, self.D))

    @property
    def is_feedthrough(self) -> bool:
        """True unless D is known to be zero."""
        return may_be_nonzero(self.D)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"x": InternalState((self.A.shape[0],))} if self.A.shape[0] else {}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """`A x + B u`."""
        return {"x": self.A @ s["x"] + self.B @ jnp.atleast_1d(u)} if s else {}

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """`C x + D u`."""
        y = self.D @ jnp.atleast_1d(u)
        y = y + self.C @ s["x"] if s else y
        return y[0] if y.shape == (1,) else y

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """Output, and the states of an input that is held for a period."""
        if not s:
            return self.output(u, s, t), {}
        F, G = zero_order_hold(self.A, self.B, jnp.asarray(period))
        return self.output(u, s, t), {"x": F @ s["x"] + G @ jnp.atleast_1d(u)}

    def faults(self) -> list[str]:
        """Sizes that do not belong together."""
        shapes = {name: getattr(self, name).shape for name in "ABCD"}
        fits = all(len(shape) == 2 for shape in shapes.values())
        if fits:
            n, k, m = shapes["A"][0], shapes["B"][1], shapes["C"][0]
            fits = shapes == {"A": (n, n), "B": (n, k), "C": (m, n), "D": (m, k)} and m > 0
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        return super().faults() + faults_if(
            (not fits, f"A (n, n), B (n, k), C (m, n), D (m, k) are needed, m > 0, got {listed}")
        )


def _canonical_rate(x, u, denominator):
    """Rate (n,) of the controllable canonical form: `x_k' = x_k+1`, the last by the denominator, lowest power first
    and its highest coefficient not among them."""
    return jnp.append(x[1:], u - jnp.dot(denominator, x))


class TransferFunction(AbstractBlock):
    """A rational function of s, highest power first as in SciPy: `TransferFunction([1, 0], [tau, 1])` is the filtered
    derivative `s / (tau s + 1)`. At rest at the start.

    Attributes:
        numerator: (m,), m <= n + 1, of at most the denominator's degree.
        denominator: (n + 1,), the first one not zero.
    """

    numerator: Convertible[Float[Array, " m"]] = eqx.field(converter=number)
    denominator: Convertible[Float[Array, " n"]] = eqx.field(converter=number)

    @property
    def is_feedthrough(self) -> bool:
        """True if both have the same degree."""
        return self.numerator.shape == self.denominator.shape and may_be_nonzero(self.numerator[0])

    @property
    def internal_states(self) -> dict[str, InternalState]:
        order = self.denominator.shape[0] - 1
        return {"x": InternalState((order,))} if order else {}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """That of the controllable canonical form."""
        return {"x": _canonical_rate(s["x"], u, self._coefficients[1])} if s else {}

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The output."""
        c, a, d = self._coefficients
        return jnp.dot(c - d * a, s["x"]) + d * u if s else d * u

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """Output, and the states of an input that is held for a period."""
        if not s:
            return self.output(u, s, t), {}
        F, G = zero_order_hold(*canonical_matrices(self._coefficients[1]), jnp.asarray(period))
        return self.output(u, s, t), {"x": F @ s["x"] + G[:, 0] * u}

    @property
    def _coefficients(self):
        """Numerator (n,) and denominator (n,) lowest power first, and the quotient of their highest powers."""
        a = self.denominator[::-1] / self.denominator[0]
        b = jnp.zeros_like(a).at[: self.numerator.shape[0]].set(self.numerator[::-1] / self.denominator[0])
        return b[:-1], a[:-1], b[-1]

    def faults(self) -> list[str]:
        """Degrees, and a first coefficient that is zero."""
        shapes = self.numerator.shape, self.denominator.shape
        if any(len(shape) != 1 or not shape[0] for shape in shapes):
            return [f"numerator and denominator are lists of numbers, got shapes {shapes[0]}, {shapes[1]}"]
        return super().faults() + faults_if(
            (shapes[0] > shapes[1], "the numerator's degree must not be above the denominator's: add a filter"),
            (any_concrete(lambda a: a[0] == 0, self.denominator), "the denominator's first number must not be zero"),
        )


class FirstOrder(AbstractBlock):
    """Lag of the first order: `time_constant dy/dt = gain u - y`, zero at the start.

    Attributes:
        time_constant: > 0 [s]; gain: of constant inputs.
    """

    time_constant: Convertible[Scalar] = eqx.field(converter=number)
    gain: Convertible[Scalar] = eqx.field(converter=number, default=1.0)

    @property
    def is_feedthrough(self) -> bool:
        return False

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"value": InternalState()}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """Rate of the value."""
        return {"value": (self.gain * u - s["value"]) / self.time_constant}

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The value."""
        return s["value"]

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """The value, and that after an input that is held for a period."""
        share = lag_share(period / self.time_constant)
        return s["value"], {"value": s["value"] + share * (self.gain * u - s["value"])}

    def faults(self) -> list[str]:
        """Sign of the time constant."""
        return super().faults() + faults_if((not_positive(self.time_constant), "time_constant must be positive"))


class Delay(AbstractBlock):
    """The input a time ago, by the rational approximation of Pade, numerator and denominator of the same degree.

    It is right to about a radian per degree, `omega duration < pade`, and feeds a part of the input through at once.
    At the start the input is taken as constant before.

    Sampled, with `every=`, it is a shift register without any approximation: its output at a sample is what its input
    held a time ago, the sample of `ceil(duration / period)` periods before.  A duration that is no whole number of
    periods thus acts as the next longer one; both must be known numbers, and the register has no derivatives by them.

    Attributes:
        duration: > 0 [s].
        pade: degree, 1 to 10 (static).
    """

    duration: Convertible[Scalar] = eqx.field(converter=number)
    pade: int = eqx.field(static=True, default=3)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"x": InternalState((self.pade,))}

    @property
    def _coefficients(self):
        """Denominator (n + 1,) by powers of `s duration`, lowest first, the highest coefficient one."""
        n, f = self.pade, math.factorial
        found = np.array([f(2 * n - k) * f(n) / (f(2 * n) * f(k) * f(n - k)) for k in range(n + 1)])
        return found / found[-1]

    def start(self, u: Float[Array, "..."], t: ScalarLike) -> States:
        """At rest for the input."""
        return {"x": jnp.zeros(self.pade, jnp.result_type(u)).at[0].set(u / self._coefficients[0])}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """That of the controllable canonical form in the time `t / duration`."""
        a = jnp.asarray(self._coefficients, s["x"].dtype)
        return {"x": _canonical_rate(s["x"], u, a[:-1]) / self.duration}

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The input a time ago."""
        a = jnp.asarray(self._coefficients, s["x"].dtype)
        d = (-1.0) ** self.pade
        b = a * jnp.asarray([(-1.0) ** k for k in range(self.pade + 1)], a.dtype)
        return jnp.dot(b[:-1] - d * a[:-1], s["x"]) + d * u

    def sampled(self, period: float) -> AbstractBlock:
        """The register of samples."""
        return ShiftRegister(_delay_periods(self.duration, period))

    def sampling_faults(self, period: ScalarLike) -> list[str]:
        """The number of samples must be known, and few enough to be states."""
        if not is_concrete(self.duration, period):
            return ["the number of samples that a Delay holds must be known: duration and every= cannot be traced"]
        if not_positive(self.duration):
            return []
        count = _delay_periods(self.duration, period)
        return faults_if(
            (count > _MOST_SAMPLES, f"a Delay of {count} periods holds more than {_MOST_SAMPLES} samples")
        )

    def faults(self) -> list[str]:
        """Sign of the duration, and the degree."""
        is_degree = isinstance(self.pade, int) and 1 <= self.pade <= _MOST_PADE
        return super().faults() + faults_if(
            (not_positive(self.duration), "duration must be positive"),
            (not is_degree, f"pade must be a whole number from 1 to {_MOST_PADE}, got {self.pade!r}"),
        )


class ShiftRegister(AbstractBlock):
    """The input a number of samples ago; before the start it is that of the start.

    Attributes:
        count: of samples (static).
    """

    count: int = eqx.field(static=True)

    @property
    def is_feedthrough(self) -> bool:
        return False

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"x": InternalState((self.count,))}

    def start(self, u: Float[Array, "..."], t: ScalarLike) -> States:
        """The input of the start, throughout."""
        return {"x": jnp.full(self.count, u)}

    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The oldest sample."""
        return s["x"][-1]

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """The oldest sample, and all of them one place on."""
        return s["x"][-1], {"x": jnp.concatenate([jnp.reshape(u, 1), s["x"][:-1]])}


def _delay_periods(duration: ArrayLike, period: ArrayLike) -> int:
    """Number of periods after which a signal that is sampled has been delayed; nearly whole ones are whole."""
    return max(1, math.ceil(np.asarray(duration).item() / np.asarray(period).item() * (1 - 1e-9)))
