"""Spectra of single outputs and of von Mises stresses: covariance, quadrature, damage with derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.errors import ModelError, UnknownNameError
from jaxmbs.fatigue import SN, psd_table, spectral_damage
from jaxmbs.qualification import (
    BaseAcceleration,
    Recovery,
    random_response,
    stress_spectrum,
    von_mises_spectrum,
)

from .test_random_response import GSFC, SPRINGS, chain

ROWS = jnp.array([[1.0, 0, 0], [-0.3, 0.2, 0], [0.1, 0, 0.4]])
NAMES = ["s xx", "s yy", "s xy"]


def response(springs=SPRINGS):
    inputs = {"base": BaseAcceleration(GSFC, "z")}
    return random_response(chain(springs), inputs, {"s": Recovery(ROWS * 1e5, ["xx", "yy", "xy"])}, ratios=0.02)


@pytest.mark.long
def test_moments_and_levels():
    found = response()
    one, all_three = stress_spectrum(found, "s yy"), von_mises_spectrum(found, NAMES)
    np.testing.assert_allclose(one.moments((0, 1, 2, 4)), found.moments[1], rtol=1e-14)
    np.testing.assert_allclose(all_three.rms, found.von_mises_rms(NAMES), rtol=1e-12)
    f = np.geomspace(20.0, 2000.0, 40_001)
    for spectrum in (one, all_three):
        for order in (0.75, 2):
            area = np.trapezoid(np.asarray(spectrum.psd(f)) * f**order, f)
            np.testing.assert_allclose(spectrum.moment(order), area, rtol=1e-5)
    np.testing.assert_allclose(one.psd(f[::4000]), found.psd(f[::4000])[:, 1], rtol=1e-12)
    np.testing.assert_allclose(
        spectral_damage(one, SN(1e9, 4.0)),
        spectral_damage(psd_table(f, one.psd(f), unit=None), SN(1e9, 4.0)),
        rtol=1e-4,
    )


@pytest.mark.long
@pytest.mark.parametrize("method", ["dirlik", "alpha0.75"])
def test_gradient_of_the_damage_by_every_stiffness(method):
    @jax.jit
    def damage(k):
        return spectral_damage(von_mises_spectrum(response(k), NAMES), SN(1e3, 4.0), method)

    found = jax.grad(damage)(SPRINGS)
    for k in range(3):
        h = 30.0 * np.eye(3)[k]
        d = (
            8 * (damage(SPRINGS + h) - damage(SPRINGS - h)) - (damage(SPRINGS + 2 * h) - damage(SPRINGS - 2 * h))
        ) / 360
        np.testing.assert_allclose(found[k], d, rtol=1e-7)
    many = jax.vmap(damage)(jnp.stack([SPRINGS, 1.2 * SPRINGS]))
    np.testing.assert_allclose(many[1], damage(1.2 * SPRINGS), rtol=1e-10)


@pytest.mark.long
def test_faults():
    found = response()
    with pytest.raises(ModelError, match="x y z xy yz zx"):
        von_mises_spectrum(found, NAMES[:2])
    with pytest.raises(UnknownNameError, match="s xx"):
        stress_spectrum(found, "s x")
    with pytest.raises(TypeError, match="acceleration"):
        spectral_damage(GSFC, SN(1e9, 4.0))
