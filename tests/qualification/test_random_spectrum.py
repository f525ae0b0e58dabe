"""Vibration response spectra: case RV2, the GSFC spectrum."""

import jax
import numpy as np
import pytest

from jaxmbs.errors import ModelError
from jaxmbs.qualification import miles, random_spectrum

TABLE, LEVELS = np.array([20.0, 50, 800, 2000]), np.array([0.026, 0.16, 0.16, 0.026])
NATURAL = np.array([30.0, 100.0, 300.0, 1500.0])


@pytest.mark.long
def test_oscillators_on_the_gsfc_spectrum():
    wanted = [5.148461996319064, 15.738068676476146, 27.485464738563543, 35.63396196028673]
    np.testing.assert_allclose(random_spectrum(TABLE, LEVELS, NATURAL), wanted, rtol=1e-9)
    total = jax.jit(lambda q: random_spectrum(TABLE, LEVELS, NATURAL, q).sum())
    np.testing.assert_allclose(jax.grad(total)(10.0), (total(10.001) - total(9.999)) / 2e-3, rtol=1e-6)


def test_miles():
    at = np.exp(np.interp(np.log(NATURAL), np.log(TABLE), np.log(LEVELS)))
    wanted = [5.232493701875592, 15.853309190424042, 27.458736985913067, 32.92107131956352]
    np.testing.assert_allclose(miles(NATURAL, at), wanted, rtol=1e-12)


def test_every_fault_is_named():
    with pytest.raises(ModelError, match="2 faults"):
        random_spectrum(TABLE[::-1], -LEVELS, NATURAL)
