"""Model updating: unknowns of a structure from measured modes and transfer functions."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Inexact, PyTree

from ..checks import distinct_names, number_faults, require_numbers, require_reals
from ..errors import ModelError
from ..identification import Identification, identify
from ..linear._system import LinearSystem
from ..linear._transfer import KINDS, TransferFunctions
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, Reported
from ..tables import format_number
from ..typing import ArrayLike
from ..vibration import frequency_response, mac
from ..vibration import modes as modes_of
from ..vibration._gains import harmonic_rate
from ..vibration._mode_shapes import best_pairs

#: Assurance criterion below which a pair of a measured and a computed mode is doubtful.
LEAST_MAC = 0.6


class MeasuredModes(Reported, eqx.Module):
    """Modes from a test.

    Attributes:
        frequencies: (m,) [Hz].
        shapes: (channels, m), real or complex, of any scale; or None.
        channels: their names, as coordinates of the model, "tip z".
        damping: ratios (m,), or None.
    """

    frequencies: Float[np.ndarray, " m"]
    shapes: Inexact[np.ndarray, "channels m"] | None = None
    channels: tuple[str, ...] = eqx.field(static=True, default=())
    damping: Float[np.ndarray, " m"] | None = None

    def __init__(
        self,
        frequencies: ArrayLike,
        shapes: ArrayLike | None = None,
        channels: tuple[str, ...] = (),
        damping: ArrayLike | None = None,
    ) -> None:
        require_reals(frequencies)
        require_reals(damping)
        if shapes is not None:
            require_numbers(shapes=shapes)
        self.frequencies = np.asarray(frequencies, float)
        self.shapes = None if shapes is None else np.asarray(shapes)
        self.channels = distinct_names("channels", channels)
        self.damping = None if damping is None else np.asarray(damping, float)
        faults, count = [], self.frequencies.shape
        if len(count) != 1 or not np.all(np.isfinite(self.frequencies) & (self.frequencies > 0)):
            faults.append("frequencies (m,) must be positive: leave rigid modes out")
        if self.shapes is not None and self.shapes.shape != (len(self.channels), *count):
            faults.append(f"shapes have shape {self.shapes.shape}; {len(self.channels)} channels and {count} modes")
        faults += [f"channel {name!r} is no name" for name in self.channels if not isinstance(name, str)]
        if self.damping is not None and self.damping.shape != count:
            faults.append(f"damping has shape {self.damping.shape}, not {count}")
        if faults:
            raise ModelError(faults, "measured modes")

    def report(self) -> Report:
        mode = numbered("mode", len(self.frequencies))
        parts = [Quantity("frequency", self.frequencies, "Hz", (mode,))]
        if self.damping is not None:
            parts.append(Quantity("damping ratio", self.damping, "", (mode,)))
        if self.shapes is not None:
            parts.append(Quantity("shape", self.shapes, "", (Axis("channel", self.channels), mode), in_table=False))
        return Report(parts, f"{len(self.frequencies)} modes, {len(self.channels)} channels")


def _table_rows(update):
    head = ("mode", "measured [Hz]", "before [Hz]", "after [Hz]", "MAC before", "MAC after")
    if update.modes is None:
        return update.summary(), [head]
    columns = (update.modes.frequencies, *update.frequencies, *update.mac)
    rows = [(str(k), *map(format_number, row)) for k, row in enumerate(zip(*map(np.asarray, columns), strict=True))]
    return update.summary(), [head, *rows]


class ModelUpdate(Reported, eqx.Module):
    """A model that was fitted to a test.

    Attributes:
        identification: unknowns, their uncertainty, and directions that the test cannot see.
        system: the model at the unknowns found.
        modes: measured ones, or None.
        pairs: (m,) number of the computed mode that belongs to each measured one.
        frequencies: (2, m) [Hz] of these, before and after.
        mac: (2, m) assurance criteria of the pairs, before and after; NaN without shapes.
    """

    identification: Identification
    system: LinearSystem
    modes: MeasuredModes | None
    pairs: np.ndarray
    frequencies: np.ndarray
    mac: np.ndarray

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        stages = Axis("stage", ("before", "after"))
        mode = numbered("mode", self.frequencies.shape[-1])
        columns = (("frequency", self.frequencies, "Hz"), ("MAC", self.mac, ""))
        quantities = [Quantity(*column, (stages, mode)) for column in columns]
        return Report(quantities, summary, "" if self.ok else "the model is not determined", table=rows)

    @property
    def ok(self) -> bool:
        """True if the search converged, the test determines every unknown, and no pair is doubtful."""
        return self.identification.ok and not self.doubtful

    @property
    def doubtful(self) -> tuple[int, ...]:
        """Measured modes whose computed ones look different, with an assurance criterion below 0.6."""
        return tuple(np.flatnonzero(self.mac[1] < LEAST_MAC).tolist())

    def summary(self) -> str:
        """The verdict in sentences."""
        told = self.identification.summary()
        if self.doubtful:
            told += f". Modes {', '.join(map(str, self.doubtful))} have no computed mode of a similar shape"
        return told


def update(
    model: Callable[[PyTree], LinearSystem],
    unknowns: PyTree,
    bounds: PyTree | None = None,
    *,
    modes: MeasuredModes | None = None,
    frf: TransferFunctions | None = None,
    frequency_deviation: float = 0.005,
    damping_deviation: float = 0.2,
    shape_deviation: float = 0.05,
    frf_deviation: float = 0.1,
    residual: str = "logarithm",
    loss: float | Callable[[PyTree], Any] = 0.0,
    **options: Any,
) -> ModelUpdate:
    """Update a structure to a test: unknowns by least squares from modes, transfer functions, or both.

    Computed modes belong to the measured ones by their assurance criterion, the best pairs first, again at every
    step: modes that cross keep their partners.  Without shapes the frequencies decide.

    Args:
        model: function of the unknowns to a `LinearSystem`; it is traced.
        unknowns, bounds: as of `identify`.
        modes: measured frequencies, shapes, damping ratios.
        frf: measured transfer functions, of `read_uff` say; the names of their channels are coordinates of the model.
        frequency_deviation, damping_deviation: of the noise, relative to each frequency and damping ratio.
        shape_deviation: of the noise of shapes, relative to the size of each.
        frf_deviation: of the noise of transfer functions, relative to the magnitude of each value.
        residual: "logarithm" of the ratio of transfer functions, whose sum of squares has one wide minimum; or their
            "difference", as noise is, near a solution.
        loss: loss factor of the whole stiffness for transfer functions, or a function of the unknowns.
        options: `prior`, `robust`, `starts`, `gradient`, `steps`, `largest` as of `identify`.

    Raises: ModelError for a test without data, and as `identify`; UnknownNameError for channels the model lacks.
    Source: Friswell and Mottershead, Finite element model updating in structural dynamics (1995).
    """
    faults = [] if modes is not None or frf is not None else ["give measured modes, transfer functions, or both"]
    if residual not in ("logarithm", "difference"):
        faults.append(f"residual must be 'logarithm' or 'difference', not {residual!r}")
    sizes = (frequency_deviation, damping_deviation, shape_deviation, frf_deviation)
    for name, size in zip(("frequency", "damping", "shape", "frf"), sizes, strict=True):
        faults += number_faults(f"{name}_deviation", size, positive=True)
    if faults:
        raise ModelError(faults, "update")
    data: dict[str, Any] = {}
    noise: dict[str, Any] = {}
    if modes is not None:
        data["frequency"], noise["frequency"] = np.ones(len(modes.frequencies)), frequency_deviation
        if modes.damping is not None:
            data["damping"], noise["damping"] = np.ones(len(modes.frequencies)), damping_deviation
        if modes.shapes is not None:
            is_complex = modes.damping is not None or np.iscomplexobj(modes.shapes)
            data["shape"] = _normalised(modes.shapes).astype(complex if is_complex else float)
            noise["shape"] = shape_deviation
    if frf is not None:
        measured = np.asarray(frf.values)  # what is not finite, or zero, is a gap
        data["frf"] = np.where(np.isfinite(measured) & (measured != 0), 0j, np.nan)
        noise["frf"] = frf_deviation

    def predict(u):
        system, predicted = model(u), {}
        if modes is not None:
            predicted |= _predicted_modes(system, modes)[0]
        if frf is not None:
            predicted["frf"] = _predicted_transfer(system, frf, residual, loss(u) if callable(loss) else loss)
        return predicted

    fit = identify(predict, data, unknowns, bounds, deviations=noise, **options)
    before, after = (_pairing(model, u, modes) for u in (unknowns, fit.unknowns))
    system = model(fit.unknowns)
    both = (np.stack([x, y]) for x, y in zip(before[1:], after[1:], strict=True))
    return ModelUpdate(fit, system, modes, after[0], *both)


def _predicted_modes(system, modes):
    """Frequencies and damping over the measured ones, shapes of the measured scale; pairs, frequencies, MAC."""
    computed = modes_of(system, damped=modes.damping is not None)
    proper = ~computed.is_rigid if computed.roots is None else ~computed.is_rigid & (computed.roots.imag > 0)
    if modes.shapes is None:
        ratios = computed.frequencies[None, :] / modes.frequencies[:, None]
        likeness = jnp.exp(-jnp.abs(jnp.log(jnp.where(ratios > 0, ratios, 1e-9))))
    else:
        kind = np.result_type(computed.shapes.dtype, modes.shapes.dtype)
        target, shapes = jnp.asarray(_normalised(modes.shapes)), computed.at(*modes.channels)
        target, shapes = target.astype(kind), shapes.astype(kind)
        likeness = mac(target, shapes)
    pairs = best_pairs(lax.stop_gradient(jnp.where(proper, likeness, -0.5)))
    parts = {"frequency": computed.frequencies[pairs] / modes.frequencies}
    if modes.damping is not None:
        parts["damping"] = computed.damping_ratios[pairs] / modes.damping
    if modes.shapes is None:
        return parts, (pairs, computed.frequencies[pairs], jnp.full(len(pairs), jnp.nan))
    chosen = shapes[:, pairs]
    scale = jnp.sum(jnp.conj(chosen) * target, 0) / jnp.sum(jnp.abs(chosen) ** 2, 0).astype(kind)
    parts["shape"] = chosen * scale[None, :]
    return parts, (pairs, computed.frequencies[pairs], likeness[jnp.arange(len(pairs)), pairs])


def _predicted_transfer(system, frf, residual, loss):
    """Difference of computed and measured transfer functions, over the magnitude, or logarithm of their ratio."""
    response = frequency_response(system, frf.omega, into=frf.inputs, out=frf.outputs, loss=loss).values
    measured = jnp.asarray(frf.values)
    ratio = response * harmonic_rate(frf.omega, response) ** KINDS.index(frf.kind) / measured
    return jnp.log(ratio) if residual == "logarithm" else ratio - 1


def _pairing(model, unknowns, modes) -> tuple[np.ndarray, ...]:
    if modes is None:
        return np.zeros(0, int), np.zeros(0), np.zeros(0)
    return tuple(map(np.asarray, jax.jit(lambda u: _predicted_modes(model(u), modes)[1])(unknowns)))


def _normalised(shapes: Array | np.ndarray) -> np.ndarray:
    return np.asarray(shapes) / np.linalg.norm(shapes, axis=0)
