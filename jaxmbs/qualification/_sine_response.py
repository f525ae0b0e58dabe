"""Sine tests: levels over frequency, responses to dwell, automatic notching, the effect of the sweep rate."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float

from ..checks import UNSAID, any_concrete, is_concrete, no_such, not_positive, number_faults, said_unit
from ..errors import ModelError
from ..fatigue._log_lines import frequency_faults, log_lines
from ..fatigue._psd import STANDARD_GRAVITY
from ..linear._system import LinearSystem
from ..math._extremes import largest
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_array, as_dtype, jit
from ..typing import ArrayLike
from ._inputs import BaseAcceleration, RandomForce
from ._modal_model import modal_model
from ._modal_transfer import ModalModel
from ._outputs import common_unit, named_outputs, unit_column

#: Units of the levels of sine tests: their size in SI units.
SINE_UNITS = {"g": STANDARD_GRAVITY, "m/s^2": 1.0, "N": 1.0}


class SineResponse(Reported, eqx.Module):
    """Steady response to a sine at every frequency, and the input that remains after notching.

    Attributes:
        frequencies: (frequencies,) [Hz].
        levels: (frequencies,) specified amplitudes [m/s^2 or N]; input: the notched ones.
        response: (frequencies, outputs) complex amplitudes under the notched input.
        limiting: (frequencies,) number of the limit that determines the input, -1 where there is no notch.
        limits: names of the limits; names, units: of the outputs; unit: of the input (static).
        fastest_sweep: () [octaves/min] rate up to which a sweep counts as a dwell, at the sharpest resonance in the
            band.
    """

    frequencies: Float[Array, " frequencies"]
    levels: Float[Array, " frequencies"]
    input: Float[Array, " frequencies"]
    response: Complex[Array, "frequencies outputs"]
    limiting: Array
    fastest_sweep: Float[Array, ""]
    limits: tuple[str, ...] = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True, default=())
    unit: str = eqx.field(static=True, default="")

    def report(self) -> Report:
        frequency = Axis("frequency", np.asarray(self.frequencies), "Hz")
        levels = {"specified input": self.levels, "notched input": self.input, "notch depth": self.notch_depth}
        found = [
            Quantity(name, values, "" if name == "notch depth" else self.unit, (frequency,))
            for name, values in levels.items()
        ]
        output = Axis("output", self.names)
        response = Quantity("response", self.response, common_unit(self.units), (frequency, output))
        units = unit_column(self.units, output)
        sweep = Quantity("fastest sweep", self.fastest_sweep, "octaves/min")
        notched = np.count_nonzero(np.asarray(self.limiting) >= 0)
        limiting = Quantity("limit", np.asarray(self.limiting), "", (frequency,), in_table=False)
        summary = f"{len(self.frequencies)} frequencies, {notched} of them notched"
        return Report([response, *found, sweep, limiting, *units], summary)

    @property
    def amplitudes(self) -> Float[Array, "frequencies outputs"]:
        """Sizes (frequencies, outputs) of the responses."""
        size = self.response.real**2 + self.response.imag**2
        return jnp.where(size == 0, 0.0, jnp.sqrt(jnp.where(size == 0, 1.0, size)))  # NaN stays NaN

    @property
    def peaks(self) -> Float[Array, " outputs"]:
        """Largest amplitudes (outputs,) over the frequencies."""
        return largest(self.amplitudes, 0)

    @property
    def notch_depth(self) -> Float[Array, " frequencies"]:
        """Notched over specified input (frequencies,): 1 where there is no notch."""
        return self.input / self.levels


def sine_response(
    system: LinearSystem,
    levels: tuple[ArrayLike, ArrayLike],
    out: Any,
    source: BaseAcceleration | RandomForce | None = None,
    notch: Mapping[str, ArrayLike] | None = None,
    unit: str = UNSAID,
    frequencies: ArrayLike | None = None,
    ratios: ArrayLike | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
    points: int = 64,
) -> SineResponse:
    """Response of a linear system to a sine test, with automatic notching to limits of responses and loads.

    Args:
        levels: frequencies [Hz] and amplitudes of the specification, straight on log-log paper.  A frequency that
            stands twice is a step, at which the larger amplitude holds.
        out: as of `random_response`.
        source: direction or pattern of the input, `BaseAcceleration(None, "z")` by default.
        notch: largest amplitude, in the unit of the output, by name of an output, or of a group of outputs for each
            of them.
        unit: of the levels, to be said (without one "g" is taken, with a warning): "g", "m/s^2" or "N".
        frequencies: (frequencies,) [Hz] to answer at, within those of the levels; default `points` per octave and
            all resonances in the band.
        ratios, loss, num: as of `random_response`.

    The response is that of a dwell.  A sweep at up to `fastest_sweep` has nearly the same one; a faster one stays
    below it at resonances and reaches its peak late.

    Raises: ModelError with every fault.  Source: S1 (40)-(41).
    """
    source = BaseAcceleration(None, "z") if source is None else source
    unit = said_unit("sine_response", unit, "g")
    f, level = _checked_levels(levels, unit, source)
    outputs = named_outputs(out)
    model = modal_model(system, {"sine": source}, outputs, ratios, loss, num)
    limits = _limits(model.names, notch or {})
    grid = _grid(model, f, points) if frequencies is None else _inside(frequencies, f)
    specified = jnp.maximum(*(log_lines(grid, f, level, side) for side in ("left", "right"))) * SINE_UNITS[unit]
    gain = _gains(model, grid)
    allowed, limiting = specified, jnp.full(grid.shape, -1)
    for number, (_, place, limit) in enumerate(limits):
        size = jnp.abs(gain[:, place])
        most = jnp.where(size > 0, limit / jnp.where(size > 0, size, 1.0), jnp.inf)
        limiting = jnp.where(most < allowed, number, limiting)
        allowed = jnp.minimum(allowed, most)
    response = gain * allowed[:, None].astype(gain.dtype)
    fastest = _fastest_sweep(model, f)
    names = tuple(name for name, _, _ in limits)
    said = "N" if unit == "N" else "m/s^2"
    return SineResponse(grid, specified, allowed, response, limiting, fastest, names, model.names, model.units, said)


@jit
def _gains(model, grid):
    return model.transfer(grid)[:, :, 0]


def _inside(frequencies, f):
    """Frequencies to answer at; NaN where they are traced and outside of the specification.

    Raises: ModelError for concrete ones outside, where nothing is specified.
    """
    grid, edge = jnp.atleast_1d(as_dtype(frequencies, f.dtype)), 64 * jnp.finfo(f.dtype).eps
    outside = ~((grid >= f[0] * (1 - edge)) & (grid <= f[-1] * (1 + edge)))
    if is_concrete(outside) and bool(jnp.any(outside)):
        first = float(grid[jnp.argmax(outside)])
        raise ModelError(
            [f"frequencies: {first:g} Hz is outside of the specification, {float(f[0]):g} to {float(f[-1]):g} Hz"],
            "the sine test",
        )
    return jnp.where(outside, jnp.nan, jnp.clip(grid, f[0], f[-1]))


def _checked_levels(levels, unit, source):
    """Frequencies and amplitudes.  Raises: ModelError with every fault."""
    if not isinstance(levels, tuple | list) or len(levels) != 2:
        raise ModelError(["levels must be frequencies [Hz] and as many amplitudes"], "the sine test")
    f, level = map(as_array, levels)
    faults = []
    if f.ndim != 1 or f.shape != level.shape or f.size < 2:
        faults.append(f"levels are frequencies and as many amplitudes, not of shapes {f.shape} and {level.shape}")
    else:
        faults += frequency_faults(f)
        if any_concrete(lambda a: ~((a > 0) & (a < jnp.inf)), level):
            faults.append("amplitudes must be positive and finite")
    if unit not in SINE_UNITS:
        faults.append(f"unknown unit {unit!r}: the units are {', '.join(SINE_UNITS)}")
    elif (unit == "N") != isinstance(source, RandomForce):
        faults.append(f"levels in {unit} do not fit a source that is a {type(source).__name__}")
    if faults:
        raise ModelError(faults, "the sine test")
    return f, level


def _limits(names, notch):
    """Limits as (name of an output, its number, limit)."""
    faults, found = [], []
    if not isinstance(notch, Mapping):
        raise ModelError([f"notch: give limits by name of an output, not {notch!r}"], "the sine test")
    for given, limit in notch.items():
        own = [k for k, name in enumerate(names) if name == given or name.startswith(f"{given} ")]
        found.append((limit, own))
        if not own:
            faults.append(f"notch: {no_such('output', given, names)}")
        faults += number_faults(f"notch: the limit of {given!r}", limit, positive=True)
    if faults:
        raise ModelError(faults, "the sine test")
    return [(names[k], k, jnp.asarray(limit, float)) for limit, own in found for k in own]


def _grid(model: ModalModel, f, points):
    """Frequencies at equal ratios with every resonance, and those half a bandwidth beside it."""
    low, high = lax.stop_gradient((f[0], f[-1]))
    resonances, widths = model.poles()
    octaves = 10 if not_positive(low) or not any_concrete(lambda x: x > 0, low) else float(jnp.log2(high / low))
    even = low * (high / low) ** jnp.linspace(0.0, 1.0, int(points * octaves) + 2, dtype=f.dtype)
    beside = jnp.concatenate([resonances + k * widths for k in (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)])
    return jnp.sort(jnp.concatenate([even, jnp.clip(beside, low, high)]))


def _fastest_sweep(model, f):
    """Least `77.6 f / Q^2` octaves per minute of the resonances in the band.  Source: ISO 7626-2 (1990)."""
    resonances, widths = model.poles()
    inside = (resonances >= f[0]) & (resonances <= f[-1])
    safe = jnp.where(inside, resonances, 1.0)
    return jnp.min(jnp.where(inside, 77.6 * safe * (2 * widths / safe) ** 2, jnp.inf), initial=jnp.inf)
