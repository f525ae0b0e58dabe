"""Damage of spectra: FLife, quadrature over a kinked curve, a simulated signal, the narrow-band limit."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from jaxmbs import fatigue
from jaxmbs.fatigue import SN, PsdTable, psd_table, spectral_damage

F = np.linspace(0.5, 60, 1201)
G = 50 * np.exp(-(((F - 20) / 4) ** 2)) + 30 * np.exp(-(((F - 45) / 3) ** 2))


def stress(levels):
    return psd_table(F, levels, unit=None)


NAMES = {
    "dirlik": "Dirlik",
    "tovo-benasciutti": "TovoBenasciutti",
    "narrowband": "Narrowband",
    "alpha0.75": "Alpha075",
    "wirsching-light": "WirschingLight",
    "zhao-baker": "ZhaoBaker",
}


@pytest.mark.long
@pytest.mark.parametrize("method", NAMES)
def test_flife_agrees(method):
    flife = pytest.importorskip("FLife")
    life = getattr(flife, NAMES[method])(flife.SpectralData(input={"PSD": G, "f": F})).get_life(C=1e12, k=5.0)
    np.testing.assert_allclose(
        1 / spectral_damage(stress(G), SN(1e12, 5.0), method), life, rtol=1e-4
    )  # FLife's spectra are straight between points


@pytest.mark.long
@pytest.mark.parametrize("method", NAMES)
def test_gradient(method):
    sn, bump = SN(1e12, 4.0, knee=40.0, second_slope=6.0, limit=3.0), np.exp(-(((F - 30) / 5) ** 2))
    rate = jax.jit(lambda e: spectral_damage(stress(G + e * bump), sn, method) * 1e6)
    np.testing.assert_allclose(jax.grad(rate)(1.0), (rate(1.001) - rate(0.999)) / 2e-3, rtol=1e-6)


@pytest.mark.long
def test_a_kinked_curve_by_quadrature():
    sn, psd = SN(1e12, 4.0, knee=40.0, second_slope=6.0, limit=10.0), stress(G)
    v = float(psd.moment(0))
    pdf = lambda s: s / v * np.exp(-(s**2) / 2 / v)
    low = quad(lambda s: float(1e-12 * 40**-2) * s**6 * pdf(s), 10, 40)[0]
    wanted = low + quad(lambda s: 1e-12 * s**4 * pdf(s), 40, 600)[0]
    np.testing.assert_allclose(spectral_damage(psd, sn, "narrowband"), float(psd.crossings) * wanted, rtol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("method", NAMES)
def test_narrow_bands_end_in_the_narrow_band_value(method):
    def ratio(w):
        psd = psd_table(20 + w * jnp.array([-1.0, 0.0, 1.0]), jnp.array([1e-3, 1.0, 1e-3]) / w, unit=None)
        return spectral_damage(psd, SN(1e6, 5.0), method) / spectral_damage(psd, SN(1e6, 5.0), "narrowband")

    rough = 1e-2 if method == "wirsching-light" else 1e-7
    for width in (1e-2, 1e-5, 1e-8):
        value, slope = jax.value_and_grad(ratio)(width)
        np.testing.assert_allclose(value, 1.0, atol=rough)
        assert np.isfinite(slope)


@pytest.mark.long
def test_a_simulated_signal():
    step, num = 1 / 500.0, 2**16
    f = np.fft.rfftfreq(num, step)[1:]
    rng = np.random.default_rng(3)
    level = np.interp(f, F, G, right=0.0)
    spectrum = np.sqrt(level / (2 * num * step)) * (rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size))
    signal = np.fft.irfft(np.r_[0, spectrum], num) * num
    signal *= np.sqrt(float(stress(G).moment(0))) / signal.std()
    rate = fatigue.damage(signal, SN(1e12, 4.0)) / (num * step)
    np.testing.assert_allclose(spectral_damage(stress(G), SN(1e12, 4.0)), rate, rtol=0.1)


@pytest.mark.long
def test_no_stress_and_wrong_names():
    quiet = PsdTable(jnp.asarray(F), jnp.zeros(F.shape), "any")
    assert spectral_damage(quiet, SN(1e6, 3.0)) == 0
    assert np.all(np.isfinite(jax.grad(lambda g: spectral_damage(stress(g), SN(1e6, 3.0)))(np.zeros_like(F))))
    with pytest.raises(ValueError, match="dirlik"):
        spectral_damage(quiet, SN(1e6, 3.0), "rayleigh")


def test_narrow_band_by_the_gamma_function():
    psd = psd_table([10.0, 10.1], [30.0, 30.0], unit=None)
    wanted = float(psd.crossings) / 1e6 * np.sqrt(2 * 3.0) ** 4 * 2
    np.testing.assert_allclose(spectral_damage(psd, SN(1e6, 4.0), "narrowband"), wanted, rtol=1e-9)
