"""Load events: extremes of each, their envelope with the case and the time or frequency that determine it."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import distinct_names, not_increasing, number_faults, repeated, require_reals
from ..errors import ModelError
from ..math._extremes import largest, least
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_dtype
from ..tables import format_number
from ..typing import ArrayLike
from ._outputs import common_unit
from ._random_response import RandomResponse
from ._response_spectrum import ResponseSpectrum
from ._sine_response import SineResponse


class LoadCase(Reported, eqx.Module):
    """One load event: its name, its largest and least loads and the places of both, and an uncertainty factor.

    Args:
        name: of the event.
        loads: `RandomResponse` (three sigma, both signs), `SineResponse` (amplitudes, both signs), `ResponseSpectrum`
            (peaks, both signs), a history (times, components), as of `reactions` along a motion, or limit values
            (components,), as of `coupling.limit_loads`, both signs.
        names: of the components of a history or of limit values.
        times: (times,) [s] of a history.
        factor: uncertainty factor on all loads.
        sigmas: multiple of the RMS of a random response.

    Histories from `simulate` with `ModalSuperposition` and loads by `reactions` are those of mode acceleration.

    Raises: ModelError with every fault.
    """

    highest: Float[Array, " components"]
    lowest: Float[Array, " components"]
    at_highest: Float[Array, " components"]
    at_lowest: Float[Array, " components"]
    factor: Float[Array, ""]
    name: str = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    unit: str = eqx.field(static=True)
    load_units: tuple[str, ...] = eqx.field(static=True)

    def __init__(
        self,
        name: str,
        loads: Any,
        names: Iterable[str] | None = None,
        times: ArrayLike | None = None,
        factor: ArrayLike = 1.0,
        sigmas: ArrayLike = 3.0,
    ) -> None:
        faults = [] if isinstance(name, str) else [f"the name must be text, not {name!r}"]
        faults += number_faults(f"{name}: factor", factor, positive=True)
        faults += number_faults(f"{name}: sigmas", sigmas, positive=True)
        if faults:
            raise ModelError(faults, "the load case")
        self.name, self.factor = name, jnp.asarray(factor, float)
        extremes = _extremes(name, loads, names, times, sigmas)
        self.names, self.unit, self.load_units = extremes.names, extremes.unit, extremes.load_units
        self.highest, self.lowest = extremes.highest, extremes.lowest
        self.at_highest, self.at_lowest = extremes.at_highest, extremes.at_lowest

    def report(self) -> Report:
        component = (Axis("component", self.names),)
        loads = {"highest": self.highest, "lowest": self.lowest}
        places = {"place of highest": self.at_highest, "place of lowest": self.at_lowest} if self.unit else {}
        return Report(
            [
                *(Quantity(*pair, common_unit(self.load_units), component) for pair in loads.items()),
                *(Quantity(*pair, self.unit, component) for pair in places.items()),
                Quantity("factor", self.factor),
            ],
            self.name,
        )


class _Extremes(NamedTuple):
    names: tuple[str, ...]
    unit: str
    highest: Array
    lowest: Array
    at_highest: Array
    at_lowest: Array
    load_units: tuple[str, ...] = ()


def _extremes(name, loads, names, times, sigmas):
    if isinstance(loads, RandomResponse):
        size = sigmas * loads.rms
        return _Extremes(
            loads.names, "Hz", size, -size, loads.zero_crossing_rate, loads.zero_crossing_rate, loads.units
        )
    if isinstance(loads, SineResponse):
        where = loads.frequencies[jnp.argmax(loads.amplitudes, axis=0)]
        return _Extremes(loads.names, "Hz", loads.peaks, -loads.peaks, where, where, loads.units)
    if isinstance(loads, ResponseSpectrum):
        where = loads.frequencies[jnp.argmax(jnp.abs(loads.modal), axis=0)]
        return _Extremes(loads.names, "Hz", loads.peaks, -loads.peaks, where, where, loads.units)
    require_reals((loads, times))
    loads = jnp.asarray(loads)
    names = distinct_names(f"{name}: names", () if names is None else names)
    unnamed = [other for other in names if not isinstance(other, str)]
    if unnamed or jnp.iscomplexobj(loads) or jnp.iscomplexobj(times):
        raise ModelError(
            [f"{name}: loads and times must be real numbers, and names of components text"], "the load case"
        )
    if loads.ndim == 1 and times is None and len(names) == len(loads):
        nowhere = jnp.full_like(loads, jnp.nan)
        return _Extremes(names, "", jnp.abs(loads), -jnp.abs(loads), nowhere, nowhere)
    faults = []
    if loads.ndim != 2 or len(names) != loads.shape[-1]:
        faults.append(f"{name}: loads of shape {loads.shape} are not (times, components) of {len(names)} names")
    elif times is None or np.shape(times) != loads.shape[:1]:
        faults.append(f"{name}: times of shape {np.shape(times)} are not those of loads of shape {loads.shape}")
    elif not len(loads):
        faults.append(f"{name}: a history without a time has no extremes")
    elif not_increasing(times):
        faults.append(f"{name}: times must rise")
    if faults:
        raise ModelError(faults, "the load case")
    times = jnp.asarray(times, loads.dtype)
    where = times[jnp.argmax(loads, axis=0)], times[jnp.argmin(loads, axis=0)]
    return _Extremes(names, "s", largest(loads, 0), least(loads, 0), *where)


def _table_rows(envelope):
    """Summary line and table of an envelope, as coupled-loads analysts print it."""
    rows = []
    columns = (envelope.highest, envelope.at_highest, envelope.lowest, envelope.at_lowest)
    high, at_high, low, at_low = (np.asarray(part) for part in columns)
    first, second = np.asarray(envelope.case_highest), np.asarray(envelope.case_lowest)
    for k, name in enumerate(envelope.names):
        cases = [(envelope.cases[c], envelope.units[c]) for c in (first[k], second[k])]
        (a, unit_a), (b, unit_b) = cases
        rows.append(
            (
                name,
                format_number(high[k]),
                _place(at_high[k], unit_a),
                a,
                format_number(low[k]),
                _place(at_low[k], unit_b),
                b,
                envelope.load_units[k] if envelope.load_units else "-",
            )
        )
    title = ("component", "maximum", "at", "case", "minimum", "at", "case", "unit")
    return f"{len(rows)} components over {len(envelope.cases)} load cases", [title, *rows]


def _place(where, unit):
    return f"{format_number(where)} {unit}" if unit else "-"


class Envelope(Reported, eqx.Module):
    """Extremes of all components over load cases, uncertainty factors included.

    Attributes:
        highest, lowest: (components,); at_highest, at_lowest: time [s] or frequency [Hz] of each.
        case_highest, case_lowest: (components,) numbers of the cases.
        names, cases, units: of components, cases, and the places of each case; load_units: of the components, empty
            where they are not known (static).
    """

    highest: Float[Array, " components"]
    lowest: Float[Array, " components"]
    at_highest: Float[Array, " components"]
    at_lowest: Float[Array, " components"]
    case_highest: Array
    case_lowest: Array
    names: tuple[str, ...] = eqx.field(static=True)
    cases: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    load_units: tuple[str, ...] = eqx.field(static=True, default=())

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        component = (Axis("component", self.names),)
        columns = {"highest": self.highest, "lowest": self.lowest, "limit": self.limits}
        places = {"place of highest": self.at_highest, "place of lowest": self.at_lowest}
        cases = {"case of highest": self.case_highest, "case of lowest": self.case_lowest}
        quantities = [
            *(Quantity(*pair, common_unit(self.load_units), component) for pair in columns.items()),
            *(Quantity(*pair, "", component) for pair in (places | cases).items()),
        ]
        return Report(quantities, summary, table=rows)

    @property
    def limits(self) -> Float[Array, " components"]:
        """Limit loads (components,): the larger magnitude of both extremes."""
        return jnp.maximum(jnp.abs(self.highest), jnp.abs(self.lowest))

    def margins(self, allowed: ArrayLike) -> Float[Array, " components"]:
        """Margins of safety `allowed / limit - 1` (components,).

        Args: allowed: one for all components, or (components,).

        Raises: ModelError for another number of them.
        """
        allowed = as_dtype(allowed, self.highest.dtype)
        if allowed.shape not in ((), (len(self.names),)):
            raise ModelError(
                [f"allowed has shape {allowed.shape}: give one load, or {len(self.names)}, one for each component"],
                "the margins",
            )
        return allowed / self.limits - 1.0


def load_envelope(cases: Iterable[LoadCase]) -> Envelope:
    """Envelope of load cases that have the same components.

    Its derivative is that of the cases that determine it.

    Raises: ModelError for no case, different components, and names given twice.
    """
    cases = list(cases) if isinstance(cases, Iterable) else [cases]
    faults = [] if cases else ["no load case is given"]
    wrong = [case for case in cases if not isinstance(case, LoadCase)]
    faults += [f"{case!r} is no LoadCase" for case in wrong]
    if not faults:
        names = [case.name for case in cases]
        faults += [f"two load cases are named {name!r}" for name in repeated(names)]
        faults += [f"{case.name!r} has other components" for case in cases if case.names != cases[0].names]
    if faults:
        raise ModelError(faults, "the load cases")
    high = jnp.stack([case.factor * case.highest for case in cases])
    low = jnp.stack([case.factor * case.lowest for case in cases])
    first, second = jnp.argmax(high, axis=0), jnp.argmin(low, axis=0)
    pick = lambda values, which: jnp.take_along_axis(values, which[None], axis=0)[0]
    return Envelope(
        pick(high, first),
        pick(low, second),
        pick(jnp.stack([case.at_highest for case in cases]), first),
        pick(jnp.stack([case.at_lowest for case in cases]), second),
        first,
        second,
        cases[0].names,
        tuple(case.name for case in cases),
        tuple(case.unit for case in cases),
        next((case.load_units for case in cases if any(case.load_units)), ()),
    )
