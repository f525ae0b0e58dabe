"""Response to stationary random inputs: spectra and their integrals over frequency."""

from collections.abc import Iterable, Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..checks import distinct_names, no_such
from ..errors import ModelError, UnknownNameError
from ..linear._system import LinearSystem
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_dtype
from ..tables import format_number
from ..typing import ArrayLike
from ._coherence import Coherence, coherence_of
from ._inputs import spectral_matrix
from ._modal_model import modal_model
from ._modal_transfer import ModalModel, imaginary_rates
from ._outputs import common_unit, named_outputs, unit_column
from ._quadrature import ORDER
from ._spectral_integrals import (
    POWERS,
    band_nodes,
    check_modes,
    check_spectra,
    check_white,
    densities,
    integrate_chunks,
    is_white,
    map_nodes,
    moments,
    quotient,
    safe_sqrt,
    state_covariance,
    white_moments,
)


def _table_rows(response):
    """Summary line and table of a random response."""
    rms, rate = np.asarray(response.rms), np.asarray(response.zero_crossing_rate)
    rows = [
        (name, format_number(r), format_number(3 * r), unit or "-", format_number(f))
        for name, r, unit, f in zip(response.names, rms, response.units, rate, strict=True)
    ]
    summary = f"{len(rows)} responses to {len(response.inputs)} random inputs"
    return summary, [("output", "rms", "3 sigma", "unit", "zero crossings [Hz]"), *rows]


class RandomResponse(Reported, eqx.Module):
    """Response to random inputs; all numbers in SI units, spectra one-sided per Hz.

    Attributes:
        moments: (outputs, 4) spectral moments `integral f^n S df` for n = 0, 1, 2, 4; of white noise infinite where
            the integral diverges, and NaN for n = 1.
        inputs: the inputs, by name.
        coherence: of the inputs.
        model: transfer functions from inputs to outputs.
        order: points of the quadrature by piece (static).
        is_uncorrelated: True if no coherence of two inputs is given (static).
    """

    moments: Float[Array, "outputs 4"]
    inputs: dict[str, Any]
    coherence: Coherence
    model: Any
    order: int = eqx.field(static=True)
    is_uncorrelated: bool = eqx.field(static=True)

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        output = (Axis("output", self.names),)
        columns = (("rms", common_unit(self.units), self.rms), ("zero crossings", "Hz", self.zero_crossing_rate))
        found = [Quantity(name, x, unit, output) for name, unit, x in columns]
        return Report([*found, *unit_column(self.model.units, *output)], summary, table=rows)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.model.names

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs, empty where they are not known."""
        return self.model.units or ("",) * len(self.names)

    def place(self, name: str) -> int:
        """Number of an output.  Raises: UnknownNameError."""
        if name not in self.names:
            raise UnknownNameError(no_such("output", name, self.names))
        return self.names.index(name)

    @property
    def mean_square(self) -> Float[Array, " outputs"]:
        """Mean squares (outputs,)."""
        return self.moments[:, 0]

    @property
    def rms(self) -> Float[Array, " outputs"]:
        """Roots of the mean squares (outputs,)."""
        return safe_sqrt(self.moments[:, 0])

    @property
    def three_sigma(self) -> Float[Array, " outputs"]:
        """Three times the RMS (outputs,): of a normal distribution 0.27 % of the time is above."""
        return 3.0 * self.rms

    @property
    def zero_crossing_rate(self) -> Float[Array, " outputs"]:
        """Upward zero crossings per second (outputs,): `sqrt(m2 / m0)`."""
        return safe_sqrt(quotient(self.moments[:, 2], self.moments[:, 0]))

    @property
    def peak_rate(self) -> Float[Array, " outputs"]:
        """Peaks per second (outputs,): `sqrt(m4 / m2)`.

        The fourth moment of an absolute acceleration grows with the upper end of the table, as the structure does not
        filter it: there the rate is a property of the table.
        """
        return safe_sqrt(quotient(self.moments[:, 3], self.moments[:, 2]))

    def expected_maximum(self, duration: ArrayLike) -> Float[Array, " outputs"]:
        """Expected largest magnitude (outputs,) within a duration [s].

        `rms (c + 0.5772 / c)` with `c^2 = 2 ln(2 v T)`, v the zero crossing rate.  Source: Davenport (1964).
        """
        count = jnp.maximum(2.0 * self.zero_crossing_rate * jnp.asarray(duration), 1.5)
        c = jnp.sqrt(2.0 * jnp.log(count))
        return self.rms * (c + np.euler_gamma / c)

    def psd(self, frequencies: ArrayLike) -> Float[Array, "frequencies outputs"]:
        """Power spectral densities (frequencies, outputs) at frequencies [Hz]."""
        f = jnp.atleast_1d(as_dtype(frequencies, self.moments.dtype))
        found = map_nodes(lambda f: densities(self, f), f)
        return found.reshape(-1, found.shape[-1])[: len(f)]

    def cross_spectrum(self, first: str, second: str, frequencies: ArrayLike) -> Complex[Array, " frequencies"]:
        """Cross-spectral density (frequencies,) of two outputs at frequencies [Hz]: `S_ab = H_a S H_b*`."""
        f = jnp.atleast_1d(as_dtype(frequencies, self.moments.dtype))
        H = self.model.transfer(f)[:, np.array([self.place(first), self.place(second)])]
        S = spectral_matrix(self.inputs, self.coherence, f)
        return jnp.einsum("wi,wij,wj->w", H[:, 0], S.astype(H.dtype), jnp.conj(H[:, 1]))

    def covariance(self, names: Iterable[str] | None = None) -> Float[Array, "k k"]:
        """Covariance (k, k) of outputs, all by default; the real part of the integral of the cross-spectra."""
        names = self.names if names is None else distinct_names("names", names)
        rows = np.array([self.place(name) for name in names], int)
        if is_white(self.inputs):
            A, B, C, D = self.model.state_space()
            return C[rows] @ state_covariance(self, A, B) @ C[rows].T

        def piece(f, w):
            H = self.model.transfer(f)[:, rows]
            S = spectral_matrix(self.inputs, self.coherence, f).astype(H.dtype)
            return jnp.einsum("w,wki,wij,wlj->kl", w.astype(H.dtype), H, S, jnp.conj(H)).real

        return integrate_chunks(piece, band_nodes(self))

    def cumulative_rms(self, frequencies: ArrayLike) -> Float[Array, "frequencies outputs"]:
        """RMS (frequencies, outputs) of what lies below each frequency [Hz]; exact at each of them."""
        self._refuse_white("cumulative_rms")
        f = jnp.atleast_1d(as_dtype(frequencies, self.moments.dtype))
        nodes = band_nodes(self, f)
        found = map_nodes(lambda f: densities(self, f), nodes.frequencies)
        found = found.reshape(-1, found.shape[-1])[: nodes.weights.size].reshape(*nodes.weights.shape, -1)
        parts = jnp.einsum("pw,pwk->pk", nodes.weights, found)
        below = nodes.ends[None] <= f[:, None] * (1 + 16 * jnp.finfo(f.dtype).eps)
        return safe_sqrt(below.astype(f.dtype) @ parts)

    def mode_shares(self) -> Float[Array, "outputs modes"]:
        """Shares (outputs, modes) of the modes in the mean squares: `Re integral Y_k Y*`, relative to the whole.

        Correlated modes may have negative shares; what is missing to 1 follows the base and forces statically.

        Raises: ModelError where there are no modes: damping couples them, or the system is no LinearSystem.
        """
        self._refuse_white("mode_shares")
        model = self.model
        if not isinstance(model, ModalModel) or model.is_coupled:
            raise ModelError(["shares of modes need a linear system whose damping does not couple the modes"])

        def piece(f, w):
            q, H = model.amplitudes(f), model.transfer(f)
            S = spectral_matrix(self.inputs, self.coherence, f).astype(H.dtype)
            other = jnp.einsum("w,wij,wkj->wik", w.astype(H.dtype), S, jnp.conj(H))
            rows = model.modal_rows(imaginary_rates(f, model.loss.dtype))
            return jnp.einsum("wkm,wmi,wik->km", rows, q, other).real[:, : model.num]

        return quotient(integrate_chunks(piece, band_nodes(self)), self.mean_square[:, None])

    def _refuse_white(self, what):
        if is_white(self.inputs):
            raise ModelError([f"{what} needs tables: white noise has no upper frequency"], "the question")

    def von_mises_rms(self, names: Iterable[str]) -> Float[Array, ""]:
        """RMS () of the von Mises stress of the components x y xy (plane), or x y z xy yz zx.

        Three times this value is no 3 sigma: the von Mises stress is not normally distributed, but a root of a sum of
        squares; the level that is kept with the probability of 3 sigma is 3 times the RMS for one component alone,
        and less for several, 1.9 times for five alike.  Source: Segalman et al. (1998).
        """
        names = distinct_names("names", names)
        if len(names) not in (3, 6):
            raise ModelError([f"the von Mises stress has 3 or 6 components, not {len(names)}"], "the question")
        normal = 2 if len(names) == 3 else 3
        A = np.diag([1.0] * normal + [3.0] * (len(names) - normal))
        A[:normal, :normal] -= 0.5 * (1 - np.eye(normal))
        return safe_sqrt(jnp.sum(self.covariance(names) * A))

    def to_xarray(self, frequencies: ArrayLike | None = None) -> Any:
        """An `xarray.Dataset`: `psd` over `frequency` [Hz] and `output`, and `rms` by output.

        Args: frequencies: [Hz]; without them the dataset has the named numbers of the print.
        """
        if frequencies is None:
            return super().to_xarray()
        import xarray

        data = {
            "psd": (("frequency", "output"), np.asarray(self.psd(frequencies))),
            "rms": ("output", np.asarray(self.rms)),
        }
        return xarray.Dataset(data, {"frequency": np.asarray(frequencies), "output": list(self.names)})


def random_response(
    system: LinearSystem,
    inputs: Mapping[str, Any],
    out: Any,
    coherence: Mapping | None = None,
    ratios: ArrayLike | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
    order: int = ORDER,
) -> RandomResponse:
    """Response of a linear system to stationary random inputs.

    Args:
        inputs: by name, `BaseAcceleration(psd_table(...), "z")` or `RandomForce(psd_table(...), {"tip z": 1.0})`.
        out: by name, `Coordinates`, `BondForces`, `BaseForces` or `Recovery`; or names of coordinates, for their
            absolute accelerations.
        coherence: by pair of names of inputs, the complex coherence `S_ab / sqrt(S_a S_b)`: its squared size is the
            ordinary coherence, its angle the phase; the other inputs are uncorrelated.  A number; a table
            `(frequencies, values)`, straight between its points [Hz]; or a function of frequencies (n,), as
            `lambda f: jnp.exp(-f / 10.0)`.
        ratios: damping ratios of the modes, one or (modes,), in place of the system's damping.
        loss: loss factor of the whole stiffness.
        num: number of modes that move, default all; the others follow statically (mode acceleration).
        order: Gauss points of each piece of the band.

    Integrals over the band are Gauss sums on pieces of the band that are clustered at the poles, right to rounding
    for damping ratios from 1e-5 to 0.7; twice the `order` shows their error.
    Derivatives by all parameters are those of the integrals, also where frequencies repeat.

    Raises: ModelError with every fault; for undamped modes in the band, if concrete.
    Source: S1 (40)-(41).
    """
    outputs = named_outputs(out)
    model = modal_model(system, inputs, outputs, ratios, loss, num)
    return respond(model, inputs, coherence, order)


def respond(model: Any, inputs: Mapping, coherence: Mapping | None, order: int = ORDER) -> RandomResponse:
    """Response of a model with poles to inputs."""
    check_spectra(inputs)
    white = is_white(inputs)
    band = () if white else tuple(given.spectrum.frequencies for given in inputs.values())
    gamma = coherence_of(tuple(inputs), coherence, band)
    if white and gamma.curves:
        raise ModelError(["white noise has a coherence that is a number: give tables of spectra"], "the question")
    response = RandomResponse(
        jnp.zeros((len(model.names), len(POWERS))), dict(inputs), gamma, model, order, not coherence
    )
    if white:
        check_white(model)
        return eqx.tree_at(lambda r: r.moments, response, white_moments(response))
    check_modes(model, inputs)
    return eqx.tree_at(lambda r: r.moments, response, moments(response))
