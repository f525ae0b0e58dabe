"""Transfer functions with named channels, measured or computed."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..checks import distinct_names, place_of, require_numbers
from ..errors import ModelError
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, failures
from ..runtime import jit
from ..typing import ArrayLike

#: Kinds of outputs: displacement, velocity, acceleration; the index is the power of `i w` over displacement.
KINDS = ("receptance", "mobility", "accelerance")
_KIND_UNITS = dict(zip(KINDS, ("m/N", "m/s/N", "m/s^2/N"), strict=True))


class TransferFunctions(Reported, eqx.Module):
    """Transfer functions `B_ij(w)`: complex response at named outputs for a unit force at named inputs.

    A channel that is both driven and measured has the same name in both lists.

    Args:
        omega: (frequencies,) angular frequencies [rad/s].
        values: (frequencies, outputs, inputs), complex.
        outputs, inputs: names of the channels.
        kind: "receptance" (displacement), "mobility" (velocity) or "accelerance" (acceleration per force).

    Raises: ModelError with every fault: shapes, names given twice, an unknown kind.
    Source: S1 (40)-(41).
    """

    omega: Float[Array, " frequencies"]
    values: Complex[Array, "frequencies outputs inputs"]
    outputs: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    kind: str = eqx.field(static=True)

    def __init__(
        self,
        omega: ArrayLike,
        values: ArrayLike,
        outputs: Sequence[str],
        inputs: Sequence[str],
        kind: str = "receptance",
    ) -> None:
        require_numbers(omega=omega, values=values)
        self.values = jnp.asarray(values)
        self.values = self.values.astype(np.result_type(self.values.dtype, np.complex64))
        self.omega = jnp.asarray(omega, self.values.real.dtype)
        self.outputs, self.inputs = distinct_names("outputs", outputs), distinct_names("inputs", inputs)
        self.kind = kind
        faults = [] if kind in KINDS else [f"unknown kind {kind!r}: the kinds are {', '.join(KINDS)}"]
        shape = (self.omega.size, len(self.outputs), len(self.inputs))
        if self.omega.ndim != 1:
            faults.append(f"omega has shape {self.omega.shape}, not (frequencies,)")
        elif self.values.shape != shape:
            faults.append(f"values have shape {self.values.shape}; frequencies, outputs and inputs make {shape}")
        if faults:
            raise ModelError(faults)

    def report(self) -> Report:
        frequency = Axis("frequency", np.asarray(self.omega) / (2.0 * np.pi), "Hz")
        axes = (frequency, Axis("output", self.outputs), Axis("input", self.inputs))
        fault = failures(np.isfinite(np.asarray(self.values)).all(axis=(1, 2)), "frequencies not finite")
        summary = f"{len(self.omega)} frequencies, {len(self.outputs)} outputs, {len(self.inputs)} inputs"
        return Report([Quantity(self.kind, self.values, _KIND_UNITS[self.kind], axes)], summary, fault)

    def rows(self, names: Sequence[str]) -> np.ndarray:
        """Indices of outputs by name.  Raises: UnknownNameError."""
        return _channel_indices(names, self.outputs, "output")

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Indices of inputs by name.  Raises: UnknownNameError."""
        return _channel_indices(names, self.inputs, "input")

    def at(self, outputs: Sequence[str] | None = None, inputs: Sequence[str] | None = None) -> "TransferFunctions":
        """The transfer functions of some channels, in the given order; None stands for all.

        Raises: UnknownNameError; ModelError for a name that is given twice.
        """
        outputs = self.outputs if outputs is None else distinct_names("outputs", outputs)
        inputs = self.inputs if inputs is None else distinct_names("inputs", inputs)
        values = _channels(self.values, self.rows(outputs), self.columns(inputs))
        return TransferFunctions(self.omega, values, outputs, inputs, self.kind)

    def with_values(self, values: ArrayLike) -> "TransferFunctions":
        """Transfer functions of the same channels with other values."""
        return TransferFunctions(self.omega, values, self.outputs, self.inputs, self.kind)

    def to_xarray(self) -> Any:
        """An `xarray.DataArray` of complex values over `frequency` [Hz], `output` and `input`."""
        import xarray

        hertz = np.asarray(self.omega) / (2.0 * np.pi)
        places: dict[str, Any] = {"frequency": ("frequency", hertz, {"units": "Hz"})}
        places |= {"output": list(self.outputs), "input": list(self.inputs)}
        return xarray.DataArray(np.asarray(self.values), places, tuple(places), self.kind)

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` by frequency [Hz], its columns (output, input)."""
        return self.to_xarray().to_series().unstack(["output", "input"])

    def to(self, kind: str) -> "TransferFunctions":
        """Convert to receptance, mobility or accelerance by powers of `i w`.  Source: S1 (40)."""
        if kind not in KINDS:
            raise ModelError([f"unknown kind {kind!r}: the kinds are {', '.join(KINDS)}"])
        power = KINDS.index(kind) - KINDS.index(self.kind)
        rate = (1j * self.omega.astype(self.values.dtype))[:, None, None]
        return TransferFunctions(self.omega, self.values * rate**power, self.outputs, self.inputs, kind)


@jit
def _channels(values, rows, columns):
    return values[:, rows][:, :, columns]


def _channel_indices(names, known, what):
    return np.array([place_of(what, name, known) for name in names], int)
