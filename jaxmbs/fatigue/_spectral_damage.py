"""Damage rate of a Gaussian stress from the moments of its spectrum.

Each method gives rates of cycles whose amplitudes are distributed by Weibull's law: exponential, Rayleigh's or
general.  The damage of each is a gamma function, of a kinked curve an incomplete one.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jax.scipy.special import gammainc, gammaincc, gammaln

from ..typing import Scalar
from ._sn import SN


class _Part(NamedTuple):
    """Cycles per second, scale over the standard deviation and shape of a Weibull distribution of amplitudes."""

    rate: Scalar
    scale: Scalar
    shape: Scalar


class _Moments:
    """Moments of a stress, all computed together; those of no stress are one."""

    def __init__(self, psd, orders):
        found = psd.moments(orders)
        self.quiet = found[0] <= 0
        self._by_order = {n: jnp.where(self.quiet, 1.0, m) for n, m in zip(orders, found, strict=True)}

    def moment(self, order):
        return self._by_order[order]

    @property
    def crossings(self):
        return jnp.sqrt(self.moment(2) / self.moment(0))

    @property
    def peaks(self):
        return jnp.sqrt(self.moment(4) / self.moment(2))


def spectral_damage(psd: Any, sn: SN, method: str = "dirlik") -> Scalar:
    """Damage per second () of a stationary Gaussian stress of zero mean.

    Args:
        psd: spectrum of the stress in the unit of the curve: `psd_table(..., unit=None)`, or one of a random response
            by `qualification.stress_spectrum`, `von_mises_spectrum` or `critical_plane`, whose moments are exact.
        sn: S-N curve; of a kinked one the first slope is that of "wirsching-light".
        method: "narrowband" (Miles 1954, Bendat 1964); "wirsching-light" (1980), "alpha0.75" (1999),
            "tovo-benasciutti" (2005), "dirlik" (1985), "zhao-baker" (1992) for wide bands.

    The narrow-band value is no upper bound of the other methods: it is above them for most slopes of materials, but
    Dirlik's, a fit to simulations, is some percent higher for slopes near one.

    Where the band gets narrow all methods join the narrow-band value smoothly, except that Wirsching and Light keep
    their root.  "alpha0.75" alone needs no fourth moment, see `PsdTable.peaks`.

    Raises: ValueError for another method, TypeError for spectra of accelerations and what is no spectrum.
    """
    if not hasattr(psd, "moments") or not isinstance(sn, SN):
        raise TypeError("spectral_damage takes a spectrum, as of psd_table, and a fatigue.SN, in this order")
    if getattr(psd, "quantity", "any") == "acceleration":
        raise TypeError("the spectrum is one of acceleration: damage is done by the stress under it")
    if method not in _METHODS:
        raise ValueError(f"method = {method!r} must be one of {', '.join(map(repr, _METHODS))}")
    stress = _Moments(psd, (0, 0.75, 1.5, 2) if method == "alpha0.75" else (0, 1, 2, 4))
    rates = [_damage(part, jnp.sqrt(stress.moment(0)), sn) for part in _METHODS[method](stress, sn)]
    return jnp.where(stress.quiet, 0.0, sum(rates, jnp.zeros(())))


def _damage(part, sigma, sn):
    """Damage per second of cycles with Weibull amplitudes; `c^m Gamma(1 + m / b)` between two incomplete ones."""
    scale = part.scale * sigma
    acts = scale > 0
    scale = jnp.where(acts, scale, 1.0)
    total = 0.0
    for factor, exponent, low, high in sn.segments():
        a = 1 + exponent / part.shape
        share = _share(a, *(None if s is None else (s / scale) ** part.shape for s in (low, high)))
        total = total + factor * jnp.exp(exponent * jnp.log(scale) + gammaln(a)) * share
    return part.rate * jnp.where(acts, total, 0.0)


def _share(a, low, high):
    """Part of a gamma function between two bounds; of the two tails that which does not cancel."""
    if low is None:
        return 1.0 if high is None else gammainc(a, high)
    if high is None:
        return gammaincc(a, low)
    below = gammainc(a, low)
    return jnp.where(below > 0.5, gammaincc(a, low) - gammaincc(a, high), gammainc(a, high) - below)


def _bandwidth(psd, order=2):
    """Ratio `m_k / sqrt(m_0 m_2k)`, 1 for a narrow band."""
    return psd.moment(order) / jnp.sqrt(psd.moment(0) * psd.moment(2 * order))


def _rayleigh(rate, scale=1.0):
    return _Part(rate, jnp.sqrt(2.0) * scale, jnp.asarray(2.0))


def _narrowband(psd, sn):
    return [_rayleigh(psd.crossings)]


def _alpha(psd, sn):
    return [_rayleigh(psd.crossings * _bandwidth(psd, 0.75) ** 2)]


def _wirsching_light(psd, sn):
    m = sn.slope
    wide = 1 - _bandwidth(psd) ** 2
    is_wide = wide > 1e-14
    e = jnp.where(is_wide, jnp.sqrt(jnp.where(is_wide, wide, 1.0)), 0.0)
    a, b = 0.926 - 0.033 * m, 1.587 * m - 2.323
    return [_rayleigh(psd.crossings * (a + (1 - a) * jnp.exp(b * jnp.log1p(-jnp.minimum(e, 1 - 1e-12)))))]


def _distances(psd):
    """`1 - alpha_1`, `1 - alpha_2`, and whether the band is so narrow that they are rounding alone."""
    d1, d2 = 1 - _bandwidth(psd, 1), 1 - _bandwidth(psd, 2)
    narrow = d2 < 1e3 * jnp.finfo(d2.dtype).eps
    # their ratio is 1/4 in the limit of a narrow band
    return jnp.where(narrow, 0.25e-9, d1), jnp.where(narrow, 1e-9, d2), narrow


def _tovo_benasciutti(psd, sn):
    d1, d2, narrow = _distances(psd)
    r, a2 = d1 / d2, jnp.where(narrow, 1.0, 1 - d2)
    b = (1 - r) * (1.112 * r * d2 * jnp.exp(2.11 * (1 - d2)) + 1 - r)  # (alpha_1 - alpha_2) and so on over d2^2
    return [_rayleigh(b * psd.crossings), _rayleigh((1 - b) * psd.peaks, a2)]


def _dirlik(psd, sn):
    d1, d2, narrow = _distances(psd)
    a2 = 1 - d2
    D1 = 2 * a2 * (d2 - d1) / (1 + a2**2)
    low = d2 - D1 + D1**2
    high = a2 * d1 - D1**2
    R, D2 = high / low, low**2 / (low - high)
    keep = lambda x, limit: jnp.where(narrow, limit, x)
    rate = psd.peaks
    return [
        _Part(keep(rate * D1, 0.0), 1.25 * D1, jnp.asarray(1.0)),  # Dirlik's Q is 1.25 D1 exactly
        _rayleigh(keep(rate * D2, 0.0), jnp.abs(R)),
        _rayleigh(keep(rate * (1 - D1 - D2), psd.crossings)),
    ]


def _zhao_baker(psd, sn):
    a2 = jnp.minimum(_bandwidth(psd), 1.0)
    shape = jnp.where(a2 < 0.9, 1.1, 1.1 + 9 * (a2 - 0.9))
    scale = jnp.exp(-jnp.log(8 - 7 * a2) / shape)
    top = 1 - jnp.sqrt(2 / jnp.pi) * jnp.exp(gammaln(1 + 1 / shape)) * scale
    w = (1 - a2) / top
    return [_Part(psd.peaks * w, scale, shape), _rayleigh(psd.peaks * (1 - w))]


_METHODS = {
    "dirlik": _dirlik,
    "tovo-benasciutti": _tovo_benasciutti,
    "narrowband": _narrowband,
    "alpha0.75": _alpha,
    "wirsching-light": _wirsching_light,
    "zhao-baker": _zhao_baker,
}
