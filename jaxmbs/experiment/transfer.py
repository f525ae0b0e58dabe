"""Transfer functions with named channels, measured or computed."""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..checks import known, place_of
from ..errors import ModelError
from ..linear.dynamic_stiffness import dense_response
from ..linear.receptance import receptance
from ..linear.system import LinearSystem

#: What the outputs are, by their power of `i w` over displacement.
KINDS = ("receptance", "mobility", "accelerance")


class TransferFunctions(eqx.Module):
    """`B_ij(w)`: complex response at named outputs for a unit force at named inputs.

    A channel that is driven and measured at one place has the same name in both lists.

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

    def __init__(self, omega, values, outputs: Sequence[str], inputs: Sequence[str], kind: str = "receptance"):
        self.values = jnp.asarray(values)
        self.values = self.values.astype(np.result_type(self.values.dtype, np.complex64))
        self.omega = jnp.asarray(omega, self.values.real.dtype)
        self.outputs, self.inputs, self.kind = tuple(outputs), tuple(inputs), kind
        faults = [] if kind in KINDS else [f"kind {kind!r} is none of {', '.join(KINDS)}"]
        shape = (self.omega.size, len(self.outputs), len(self.inputs))
        if self.omega.ndim != 1:
            faults.append(f"omega has shape {self.omega.shape}, not (frequencies,)")
        elif self.values.shape != shape:
            faults.append(f"values have shape {self.values.shape}; frequencies, outputs and inputs make {shape}")
        for side, names in (("outputs", self.outputs), ("inputs", self.inputs)):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                faults.append(f"{side} named twice: {', '.join(twice[:5])}")
        if faults:
            raise ModelError(faults)

    @classmethod
    def of(
        cls,
        system: LinearSystem,
        omega,
        outputs: Sequence,
        inputs: Sequence,
        method: str = "direct",
        loss=0.0,
        **options,
    ) -> "TransferFunctions":
        """Receptances of a linear system as its matrices and damping give them.

        Args:
            omega: (frequencies,) angular frequencies [rad/s].
            outputs, inputs: as `LinearSystem.rows` takes them: "tip z", ("tip", "z"), or a node for all of its
                coordinates, those that were reduced included; channels are named "tip z".
            method: "direct" (a solve per frequency, any damping) or "modal" (`receptance`, much cheaper at many
                frequencies; mass everywhere and damping that does not couple the modes).
            loss: loss factor of the whole stiffness.
            options: `chunk`, and `num`, `residual` of the modal method.

        Raises: UnknownNameError for coordinates that are not there.  Source: S1 (40)-(41).
        """
        system = system.dense()
        (out, outputs), (into, inputs) = system.outputs(*outputs), system.outputs(*inputs)
        if method not in ("direct", "modal"):
            raise ModelError([f"method {method!r} is neither direct nor modal"])
        matrices = {"K": system.stiffness, "M": system.mass, "C": system.damping, "loss": loss, "omega": omega}
        if method == "modal":
            values = receptance(**matrices, out=out, into=into.T, **options)
        else:
            values = dense_response(**matrices, out=out, load=into.T, **options)
        return cls(omega, values, outputs, inputs)

    def rows(self, names: Sequence[str]) -> np.ndarray:
        """Places of outputs. Raises: ModelError with the names that are not there."""
        return _places(names, self.outputs, "output")

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Places of inputs. Raises: as `rows`."""
        return _places(names, self.inputs, "input")

    def at(self, outputs: Sequence[str] | None = None, inputs: Sequence[str] | None = None) -> "TransferFunctions":
        """Some channels, in the order asked; None is all."""
        outputs = self.outputs if outputs is None else tuple(outputs)
        inputs = self.inputs if inputs is None else tuple(inputs)
        values = self.values[:, self.rows(outputs)][:, :, self.columns(inputs)]
        return TransferFunctions(self.omega, values, outputs, inputs, self.kind)

    def replace(self, values) -> "TransferFunctions":
        """The same channels with other values."""
        return TransferFunctions(self.omega, values, self.outputs, self.inputs, self.kind)

    def to(self, kind: str) -> "TransferFunctions":
        """The same as receptance, mobility or accelerance: powers of `i w`.  Source: S1 (40)."""
        if kind not in KINDS:
            raise ModelError([f"kind {kind!r} is none of {', '.join(KINDS)}"])
        power = KINDS.index(kind) - KINDS.index(self.kind)
        rate = (1j * self.omega.astype(self.values.dtype))[:, None, None]
        return TransferFunctions(self.omega, self.values * rate**power, self.outputs, self.inputs, kind)


def uncoupled(parts: Mapping[str, TransferFunctions]) -> TransferFunctions:
    """Components side by side, not yet joined; channels are named "component channel".

    Raises: ModelError where numbers of frequencies or kinds differ.  Source: S1 (3), (40).
    """
    check_alike(parts)
    first = next(iter(parts.values()))
    heights, widths = ([len(getattr(p, side)) for p in parts.values()] for side in ("outputs", "inputs"))
    values = jnp.zeros((len(first.omega), sum(heights), sum(widths)), first.values.dtype)
    row = column = 0
    for part, height, width in zip(parts.values(), heights, widths, strict=True):
        values = values.at[:, row : row + height, column : column + width].set(part.values)
        row, column = row + height, column + width
    names = [[f"{n} {c}" for n, p in parts.items() for c in getattr(p, side)] for side in ("outputs", "inputs")]
    return TransferFunctions(first.omega, values, *names, first.kind)


def check_alike(parts: Mapping[str, TransferFunctions]) -> None:
    """Components on the same frequencies and of the same kind. Raises: ModelError."""
    if not parts:
        raise ModelError(["no component is given"])
    faults = []
    (name, first), *others = parts.items()
    for other, part in others:
        if part.kind != first.kind:
            faults.append(f"{other!r} is a {part.kind}, {name!r} a {first.kind}")
        if part.values.dtype != first.values.dtype:
            faults.append(f"{other!r} is {part.values.dtype}, {name!r} {first.values.dtype}")
        if len(part.omega) != len(first.omega):
            faults.append(f"{other!r} has {len(part.omega)} frequencies, {name!r} {len(first.omega)}")
        elif _differ(part.omega, first.omega):
            faults.append(f"{other!r} and {name!r} are at different frequencies")
    if faults:
        raise ModelError(faults)


def _differ(a, b):
    """Whether concrete frequencies differ; traced ones cannot be looked at."""
    if not known(a, b):
        return False
    return bool(np.any(np.abs(np.asarray(a) - np.asarray(b)) > 1e-6 * np.max(np.abs(a), initial=0.0)))


def _places(names, known, what):
    return np.array([place_of(what, name, known) for name in names], int)
