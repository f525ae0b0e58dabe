"""Response-spectrum method: peaks of the modes from a spectrum of oscillators, and their combination."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import UNSAID, any_concrete, is_concrete, no_such, not_positive, require_numbers, said_unit
from ..coupling._limit_loads import cqc_correlation
from ..errors import ModelError
from ..fatigue._log_lines import frequency_faults, log_lines
from ..fatigue._psd import STANDARD_GRAVITY
from ..linear._system import LinearSystem
from ..math._eigen import eigh, same
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, Reported
from ..runtime import jit
from ..tables import format_number
from ..typing import ArrayLike
from ._inputs import BaseAcceleration
from ._modal_model import modal_model
from ._modal_transfer import ModalModel
from ._outputs import KINDS as KINDS_OF_MOTION
from ._outputs import Coordinates, common_unit, named_outputs, unit_column
from ._shock_spectrum import KINDS, ShockSpectrum

COMBINATIONS = ("srss", "cqc", "nrl", "abs")
UNITS = {"m/s^2": 1.0, "g": STANDARD_GRAVITY}


def _table_rows(response):
    """Summary line and table of a response by the method of response spectra."""
    peaks, missing = np.asarray(response.peaks), np.asarray(response.missing)
    columns = zip(response.names, peaks, missing, response.units or ("",) * len(peaks), strict=True)
    rows = [(name, format_number(p), format_number(m), unit or "-") for name, p, m, unit in columns]
    share = 1 - float(response.missing_mass) / float(jnp.sum(response.effective_masses) + response.missing_mass)
    summary = (
        f"{len(response.frequencies)} modes with {100 * share:.4g} % of the mass, combined by {response.combine}"
    )
    return summary, [("output", "peak", "missing mass", "unit"), *rows]


class ResponseSpectrum(Reported, eqx.Module):
    """Peaks of outputs by the response-spectrum method.

    Attributes:
        peaks: (outputs,) combined, not negative.
        modal: (modes, outputs) peak of each mode, with the sign of its contribution.
        missing: (outputs,) static part of the mass that the modes lack, at the acceleration of rigid oscillators.
        frequencies: (modes,) [Hz]; ratios: (modes,) damping ratios.
        accelerations: (modes,) [m/s^2] of the spectrum at the modes.
        effective_masses: (modes,) [kg] in the direction of the input; missing_mass: () [kg] of the modes left out.
        names, units: of the outputs; combine: rule of combination (static).
    """

    peaks: Float[Array, " outputs"]
    modal: Float[Array, "modes outputs"]
    missing: Float[Array, " outputs"]
    frequencies: Float[Array, " modes"]
    ratios: Float[Array, " modes"]
    accelerations: Float[Array, " modes"]
    effective_masses: Float[Array, " modes"]
    missing_mass: Float[Array, ""]
    names: tuple[str, ...] = eqx.field(static=True)
    combine: str = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True, default=())

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        output, mode = Axis("output", self.names), numbered("mode", len(self.frequencies))
        unit = common_unit(self.units)
        return Report(
            [
                Quantity("peak", self.peaks, unit, (output,)),
                Quantity("missing mass", self.missing, unit, (output,)),
                *unit_column(self.units, output),
                Quantity("frequency", self.frequencies, "Hz", (mode,)),
                Quantity("damping ratio", self.ratios, "", (mode,)),
                Quantity("acceleration", self.accelerations, "m/s^2", (mode,)),
                Quantity("effective mass", self.effective_masses, "kg", (mode,)),
                Quantity("modal peak", self.modal, unit, (mode, output)),
            ],
            summary,
            table=rows,
        )


def response_spectrum(
    system: LinearSystem,
    spectrum: ShockSpectrum | tuple[ArrayLike, ArrayLike],
    out: Any,
    combine: str = "srss",
    source: BaseAcceleration | None = None,
    unit: str = UNSAID,
    ratios: ArrayLike | None = None,
    num: int | None = None,
) -> ResponseSpectrum:
    """Peaks of a structure whose base has an acceleration that is known by its response spectrum alone.

    Args:
        spectrum: `shock_spectrum(...)`, of which the maximax is taken, or frequencies [Hz] and absolute
            accelerations, straight on log-log paper, at the damping of the modes.  Above the last frequency
            oscillators are rigid and the last acceleration remains.
        out: as of `random_response`; displacements are relative to the base, accelerations absolute.
        combine: "srss", root of the sum of squares; "cqc", complete quadratic combination, for close frequencies;
            "nrl", the largest and the root of the other squares; "abs", the sum of sizes.
        source: direction of the input, `BaseAcceleration(None, "z")` by default.
        unit: of the spectrum, to be said of a table (without one "m/s^2" is taken, with a warning): "m/s^2" or "g".
        ratios: damping ratios of the modes, one or (modes,), in place of the system's damping.
        num: number of modes, default all.  The mass of the others acts statically at the last acceleration of the
            spectrum, as one more mode.

    Velocities are answered by pseudo velocities, and forces of dampers are left out, as is usual.
    At equal frequencies only "cqc" has a derivative: the other sums depend on the choice of modes in the group.

    Raises: ModelError with every fault; if concrete, for modes below the spectrum and absolute displacements.
    Source: Wilson, Der Kiureghian, Bayo (1981); Regulatory Guide 1.92 (2012).
    """
    source = BaseAcceleration(None, "z") if source is None else source
    if not isinstance(spectrum, ShockSpectrum):
        unit = said_unit("response_spectrum", unit, "m/s^2")
    table = _checked(spectrum, combine, source, unit or "m/s^2")
    outputs = named_outputs(out)
    _check_outputs(outputs)
    model = modal_model(system, {"base": source}, outputs, ratios)
    count = len(model.stiffness) if num is None else num
    if isinstance(count, bool) or not 0 < count <= len(model.stiffness):
        raise ModelError([f"num = {num}: there are {len(model.stiffness)} modes"], "the question")
    parts = _parts(model, table, count)
    _check_reach(parts["frequencies"], table[0])
    if combine == "cqc" and not_positive(parts["ratios"]):
        raise ModelError(['"cqc" needs damped modes: give `ratios`, or the system a damping'], "the question")
    peaks = _combined(parts, combine)
    return ResponseSpectrum(peaks, **parts, names=model.names, combine=combine, units=model.units)


def _positive(x):
    return jnp.where(x > 0, x, 1.0)


def _checked(spectrum, combine, source, unit):
    """Frequencies and accelerations [m/s^2] of a spectrum."""
    faults = []
    if combine not in COMBINATIONS:
        faults.append(f"combine = {combine!r} must be one of {', '.join(map(repr, COMBINATIONS))}")
    if unit not in UNITS:
        faults.append(no_such("unit", unit, tuple(UNITS)))
    if not isinstance(source, BaseAcceleration):
        faults.append("the source must be a BaseAcceleration: forces have no response spectrum here")
    if isinstance(spectrum, ShockSpectrum):
        w = 2 * jnp.pi * spectrum.frequencies
        factor = {KINDS[0]: 1.0, KINDS[1]: w**2, KINDS[2]: w}[spectrum.kind]
        spectrum = (spectrum.frequencies, spectrum.maximax * factor)
    if not isinstance(spectrum, tuple | list) or len(spectrum) != 2:
        raise ModelError([*faults, "the spectrum must be frequencies and accelerations, or a ShockSpectrum"])
    require_numbers(spectrum=tuple(spectrum))
    f, a = (jnp.asarray(part, float) for part in spectrum)
    if f.ndim != 1 or f.shape != a.shape or f.size < 2:
        faults.append(f"frequencies {f.shape} and accelerations {a.shape} must be two or more numbers each")
    else:
        faults += frequency_faults(f)
        faults += ["accelerations must be positive"] * not_positive(a)
    if any_concrete(lambda x: ~np.isfinite(x), jnp.concatenate([f.ravel(), a.ravel()])):
        faults.append("all numbers of the spectrum must be finite")
    if faults:
        raise ModelError(faults, "the question")
    return f, a * UNITS[unit]


def _check_outputs(outputs):
    faults = [
        f"output {name!r} follows the {given.kind} of the base, which a spectrum does not have: ask relative to it"
        for name, given in outputs.items()
        if isinstance(given, Coordinates) and not given.relative and given.kind != KINDS_OF_MOTION[2]
    ]
    if faults:
        raise ModelError(faults, "the question")


def _check_reach(frequencies, table):
    if is_concrete(frequencies, table) and float(frequencies[0]) < float(table[0]) * (1 - 1e-9):
        raise ModelError(
            [
                f"the lowest mode, at {float(frequencies[0]):.6g} Hz, lies below the spectrum, which begins at "
                f"{float(table[0]):.6g} Hz"
            ],
            "the question",
        )


@jit
def _parts(model: ModalModel, table, count):
    values, Y = eigh(model.stiffness, model.mass)
    w = jnp.sqrt(_positive(values))
    load = Y.T @ model.loads[0][:, 0]
    rows = jnp.stack([model.rows[k].real @ Y for k in range(3)])
    in_phase = rows[0] - values[None] * rows[2]
    at_rest = (rows[0] == 0) & (rows[2] == 0)
    rows_of_peak = jnp.where(jnp.all(at_rest, axis=1, keepdims=True), w[None] * rows[1], in_phase)
    frequencies = jnp.where(values > 0, w, 0.0) / (2 * jnp.pi)
    level, slope = jax.jvp(lambda v: _level(v, table), (values,), (jnp.ones_like(values),))
    amplitude = (level * load + slope * (_parting(model, values, Y) @ load)) * jnp.where(values > 0, 1.0, jnp.nan)
    modal = (rows_of_peak * amplitude[None]).T
    static = model.direct[0, :, 0].real + model.static[0, :, 0].real + rows[0] @ (load / values)
    kept = slice(0, count)
    missing = (static - in_phase[:, kept] @ (load / values)[kept]) * table[1][-1]
    damping = jnp.zeros_like(w) if model.damping is None else jnp.sum(Y * (model.damping @ Y), axis=0) / (2 * w)
    return {
        "modal": modal[kept],
        "missing": _rounded(missing, in_phase, load / values, table[1][-1]),
        "frequencies": frequencies[kept],
        "ratios": damping[kept],
        "accelerations": (level * values)[kept],
        "effective_masses": load[kept] ** 2,
        "missing_mass": jnp.sum(load[count:] ** 2),
    }


def _level(values, table):
    """Displacement `S_a / w^2` of oscillators with squared frequencies (modes,) [rad^2/s^2]."""
    f, a = table
    at = jnp.sqrt(_positive(values)) / (2 * jnp.pi)
    level = jnp.where(at < f[0] * (1 - 1e-9), jnp.nan, log_lines(at, f, a))
    return level / _positive(values)


def _parting(model, values, Y):
    """Matrix (modes, modes) of value zero: the derivative of what parts groups of equal frequencies."""
    X = lax.stop_gradient(Y)
    fixed = lax.stop_gradient(values)
    E = X.T @ model.stiffness @ X - fixed[:, None] * (X.T @ model.mass @ X)
    within = same(fixed) & ~jnp.eye(len(fixed), dtype=bool)
    return jnp.where(within, E - lax.stop_gradient(E), 0.0)


def _rounded(missing, rows, amplitudes, level):
    """Missing parts, those at rounding as zero with their derivative."""
    size = jnp.abs(rows) @ jnp.abs(amplitudes) * level
    tiny = jnp.abs(missing) <= 1e3 * jnp.finfo(missing.dtype).eps * size
    return jnp.where(tiny, missing - lax.stop_gradient(missing), missing)


def _combined(parts, combine):
    """Peaks (outputs,)."""
    R, extra = parts["modal"], parts["missing"]
    if combine == "abs":
        return jnp.sum(jnp.abs(R), axis=0) + jnp.abs(extra)
    if combine == "cqc":
        rho = cqc_correlation(parts["frequencies"], parts["ratios"])
        return _root(jnp.sum(R * (rho @ R), axis=0) + extra**2)
    R = jnp.concatenate([R, extra[None]])
    if combine == "srss":
        return _root(jnp.sum(R**2, axis=0))
    size = jnp.abs(R)
    largest = jnp.arange(len(R))[:, None] == jnp.argmax(size, axis=0)[None]
    return jnp.sum(jnp.where(largest, size, 0.0), axis=0) + _root(jnp.sum(jnp.where(largest, 0.0, R**2), axis=0))


def _root(x):
    acts = x > 0
    return jnp.where(acts, jnp.sqrt(jnp.where(acts, x, 1.0)), 0.0)
