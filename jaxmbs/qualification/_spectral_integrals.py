"""Spectra of a response and their integrals over the band, node by node."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_concrete
from ..errors import ModelError, warn
from ..math._lyapunov import lyapunov
from ..runtime import jit, with_library_calls
from ._inputs import WhiteNoise, level_at, spectral_matrix
from ._modal_transfer import ModalModel
from ._quadrature import Quadrature, pole_quadrature
from ._state_model import MeasuredModel

#: Powers of the frequency of the spectral moments.
POWERS = (0, 1, 2, 4)
#: Nodes computed together.
CHUNK = 128
#: Halfwidth over frequency below which a mode counts as undamped.
UNDAMPED = 1e-9
#: Part of the first mode's frequency below which tables end that are doubted: of kHz, or of other modes.
_FAR_BELOW = 0.1


def check_spectra(inputs):
    """Raises: ModelError for inputs without a spectrum, and for white noise beside tables."""
    faults = [f"input {name!r} has no spectrum" for name, given in inputs.items() if given.spectrum is None]
    white = {isinstance(given.spectrum, WhiteNoise) for given in inputs.values()}
    if len(white) > 1:
        faults.append("white noise and tables do not go together: ask them one by one and add the mean squares")
    if faults:
        raise ModelError(faults, "the question")


def check_white(model):
    """Raises: ModelError for a model whose response to white noise has no bound."""
    cut = isinstance(model, ModalModel) and model.num < len(model.stiffness)
    if isinstance(model, MeasuredModel) or cut or _is_unbounded(model):
        raise ModelError(
            [
                "white noise needs a model with all modes (no `num`), viscous damping (no `loss`), rows with mass "
                "and outputs relative to the base: absolute displacements and velocities of a white acceleration grow"
            ],
            "the question",
        )


def _is_unbounded(model):
    parts = model.unbounded_parts()
    return is_concrete(parts) and bool(_any_nonzero(parts))


def _any_nonzero(parts):
    return jnp.any(jnp.stack([jnp.any(part != 0) for part in parts])) if parts else jnp.zeros((), bool)


def is_white(inputs):
    """True if the inputs are white noise."""
    return any(isinstance(given.spectrum, WhiteNoise) for given in inputs.values())


def check_modes(model, inputs):
    """Raises: ModelError for an undamped mode in the band, if concrete.  Warns of a band far below all modes."""
    if isinstance(model, MeasuredModel):
        return
    p, d = model.poles()
    tables = [given.spectrum for given in inputs.values()]
    if not is_concrete(p, d, *[table.frequencies for table in tables]):
        return
    p, d = np.asarray(p), np.asarray(d)
    low, high = min(float(t.frequencies[0]) for t in tables), max(float(t.frequencies[-1]) for t in tables)
    lost = (p >= low) & (p <= high) & (d <= UNDAMPED * p)
    if np.any(lost):
        raise ModelError(
            [
                f"the mode at {p[lost][0]:.6g} Hz lies in the band and is not damped: its response grows without "
                "bound.  Give `ratios`, `loss`, or the system a damping"
            ],
            "the question",
        )
    first = np.min(p[p > 0], initial=np.inf)
    if np.isfinite(first) and high < _FAR_BELOW * first:
        warn(
            f"random_response: the tables end at {high:.4g} Hz, far below the first mode at {first:.4g} Hz: all is "
            "carried statically; are their frequencies in Hz?"
        )


def band_nodes(response, more=None) -> Quadrature:
    """Nodes of the band of all tables, cut at all their points."""
    breaks = jnp.concatenate([given.spectrum.frequencies for given in response.inputs.values()])
    model, low, high = response.model, jnp.min(breaks), jnp.max(breaks)
    kinks = [jnp.clip(f.astype(breaks.dtype), low, high) for f in response.coherence.breaks]
    breaks = jnp.concatenate([breaks, *kinks])
    if isinstance(model, MeasuredModel):
        more = model.frequencies if more is None else jnp.concatenate([model.frequencies, more])
        p = d = jnp.ones(1, breaks.dtype)
        d = 1e6 * high * d  # no pole between the points of the grid: the pieces are even
    else:
        p, d = model.poles()
    if more is not None:
        breaks = jnp.concatenate([breaks, jnp.clip(more, low, high)])
    return pole_quadrature(breaks, p.astype(breaks.dtype), d.astype(breaks.dtype), response.order)


def densities(response, f):
    """Spectra (frequencies, outputs) at nodes [Hz]."""
    H = response.model.transfer(f)
    if response.is_uncorrelated:
        levels = jnp.stack([level_at(given.spectrum, f) for given in response.inputs.values()], axis=-1)
        return jnp.sum((H.real**2 + H.imag**2) * levels.astype(H.real.dtype)[:, None, :], axis=-1)
    S = spectral_matrix(response.inputs, response.coherence, f).astype(H.dtype)
    through = jnp.einsum("wki,wij->wkj", H, S)
    return jnp.sum(through.real * H.real + through.imag * H.imag, axis=-1)


def map_nodes(function, *columns):
    """Values of a function of chunks of nodes (CHUNK,), one after the other: memory does not grow with the band."""
    count = columns[0].size
    size = min(CHUNK, count)
    rows = -(-count // size)
    padded = [
        jnp.pad(x.reshape(-1), (0, rows * size - count), mode="edge" if k == 0 else "constant")
        for k, x in enumerate(columns)
    ]
    if size > 1:
        function = _after_library_calls(function)
    kept = jax.checkpoint(lambda row: function(*row))
    return lax.map(kept, tuple(x.reshape(rows, size) for x in padded))


def _after_library_calls(function):
    return lambda first, *others: function(with_library_calls(first), *others)


def integrate_chunks(function, nodes):
    """Sum of a function of nodes and weights over all chunks of nodes."""
    return jnp.sum(map_nodes(function, nodes.frequencies, nodes.weights), axis=0)


@jit
def moments(response):
    """Spectral moments (outputs, POWERS) of all outputs."""
    powers = jnp.asarray(POWERS)

    def piece(f, w):
        return (w[:, None] * f[:, None] ** powers.astype(f.dtype)[None]).T @ densities(response, f)

    return integrate_chunks(piece, band_nodes(response)).T


def state_covariance(response, A, B):
    """Covariance (n, n) of the states under white noise; a two-sided level is half of the one-sided one."""
    W = spectral_matrix(response.inputs, response.coherence, jnp.zeros(1))[0].real / 2
    return lyapunov(A, B @ W.astype(B.dtype) @ B.T)


@jit
def white_moments(response):
    """Spectral moments (outputs, POWERS) under white noise, by the covariance of the states."""
    A, B, C, D = response.model.state_space()
    P, found = state_covariance(response, A, B), []
    P = jnp.where(_any_nonzero(response.model.unbounded_parts()), jnp.nan, P)
    finite = jnp.ones(len(C), bool)
    for power in range(3):
        reach = jnp.sum(jnp.abs(C), axis=1) * jnp.max(jnp.abs(B)) + jnp.sum(jnp.abs(D), axis=1)
        finite = finite & (jnp.max(jnp.abs(D), axis=1) <= 1e3 * jnp.finfo(D.dtype).eps * reach)
        square = jnp.einsum("ki,ij,kj->k", C, P, C) / (2 * jnp.pi) ** (2 * power)
        found.append(jnp.where(finite, square, jnp.inf))
        C, D = C @ A, C @ B
    return jnp.stack([found[0], jnp.full_like(found[0], jnp.nan), *found[1:]], axis=1)


def safe_sqrt(x):
    """Root of x, zero with a derivative of zero where x is not positive; NaN stays."""
    positive = x > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), jnp.where(jnp.isnan(x), x, 0.0))


def quotient(a, b):
    """a / b, zero where b is zero."""
    return jnp.where(b == 0, 0.0, a / jnp.where(b == 0, 1.0, b))
