"""Spectra of single outputs and of the equivalent von Mises stress, with exact moments for fatigue."""

from collections.abc import Iterable, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import distinct_names
from ..errors import ModelError
from ..quantities import Quantity
from ..reports import Report, Reported
from ..runtime import as_dtype, jit
from ..typing import ArrayLike
from ._inputs import spectral_matrix
from ._random_response import RandomResponse
from ._spectral_integrals import POWERS, band_nodes, integrate_chunks, is_white, map_nodes, safe_sqrt


class StressSpectrum(Reported, eqx.Module):
    """Power spectral density of a quadratic form of outputs, one-sided over Hz: `sum_ab form_ab Re S_ab(f)`.

    Attributes:
        response: random response that has the outputs.
        form: (k, k) symmetric.
        places: numbers of the outputs (k, static).
    """

    response: RandomResponse
    form: Float[Array, "k k"]
    places: tuple[int, ...] = eqx.field(static=True)

    def report(self) -> Report:
        return Report(
            [Quantity("rms", self.rms, "Pa"), Quantity("mean square", self.moment(0), "Pa^2")],
            f"{len(self.places)} outputs",
        )

    def psd(self, frequencies: ArrayLike) -> Float[Array, " frequencies"]:
        """Levels (frequencies,) at frequencies [Hz]."""
        f = jnp.atleast_1d(as_dtype(frequencies, self.form.dtype))
        return map_nodes(lambda f: _levels(self, f), f).reshape(-1)[: len(f)]

    def moments(self, orders: Sequence[float | int]) -> Float[Array, " orders"]:
        """Spectral moments `integral f^n G df` (orders,), exact as those of the response."""
        if is_white(self.response.inputs):
            raise ModelError(["spectra of stresses need tables: white noise has no upper frequency"], "the question")
        if len(self.places) == 1 and set(orders) <= set(POWERS):
            own = self.response.moments[self.places[0]] * self.form[0, 0]
            return own[np.array([POWERS.index(int(n)) for n in orders])]
        return _moments(self, tuple(float(n) for n in orders))

    def moment(self, order: float | int) -> Float[Array, ""]:
        """Spectral moment `integral f^order G df` ()."""
        return self.moments((order,))[0]

    @property
    def rms(self) -> Float[Array, ""]:
        """Root of the mean square ()."""
        return safe_sqrt(self.moment(0))


def stress_spectrum(response: RandomResponse, name: str) -> StressSpectrum:
    """Spectrum of one output, for `fatigue.spectral_damage`.

    Raises: UnknownNameError.
    """
    return StressSpectrum(response, jnp.ones((1, 1), response.moments.dtype), (response.place(name),))


def von_mises_spectrum(response: RandomResponse, names: Iterable[str]) -> StressSpectrum:
    """Spectrum of the equivalent von Mises stress of the components x y xy (plane), or x y z xy yz zx.

    A Gaussian stress with this spectrum stands for the von Mises stress in fatigue.  **Three times its RMS is no
    3 sigma**: the von Mises stress is the root of a sum of squares and not normally distributed; the level that is
    kept with the probability of 3 sigma is at most 3 times the RMS, that of one component alone.

    Raises: ModelError for another number of components, UnknownNameError.
    Source: Preumont, Piefort (1994); Segalman et al. (1998).
    """
    places = stress_places(response, names)
    normal = 2 if len(places) == 3 else 3
    form = np.diag([1.0] * normal + [3.0] * (len(places) - normal))
    form[:normal, :normal] -= 0.5 * (1 - np.eye(normal))
    return StressSpectrum(response, jnp.asarray(form, response.moments.dtype), places)


def stress_places(response: RandomResponse, names: Iterable[str]) -> tuple[int, ...]:
    """Numbers of the outputs that are the components of one stress.  Raises: ModelError, UnknownNameError."""
    names = distinct_names("names", names)
    if len(names) not in (3, 6):
        raise ModelError([f"a stress has the components x y xy, or x y z xy yz zx, not {len(names)}"], "the question")
    return tuple(response.place(name) for name in names)


def _levels(spectrum, f):
    response = spectrum.response
    H = response.model.transfer(f)[:, np.array(spectrum.places)]
    S = spectral_matrix(response.inputs, response.coherence, f).astype(H.dtype)
    through = jnp.einsum("kl,wli,wij->wkj", spectrum.form.astype(H.dtype), H, S)
    return jnp.sum(through.real * H.real + through.imag * H.imag, axis=(1, 2))


@jit
def _moments(spectrum, orders):
    powers = jnp.asarray(orders)

    def piece(f, w):
        return (w[:, None] * f[:, None] ** powers.astype(f.dtype)[None]).T @ _levels(spectrum, f)

    return integrate_chunks(piece, band_nodes(spectrum.response))
