"""Tables of power spectral density: exact areas, units, faults."""

import jax
import numpy as np
import pytest
from scipy.integrate import quad

import jaxmbs as mbs
from jaxmbs.errors import ModelError
from jaxmbs.fatigue import psd_table
from jaxmbs.qualification import WhiteNoise
from tests.qualification import read_case

GSFC = [20.0, 50.0, 800.0, 2000.0], [0.026, 0.16, 0.16, 0.026]


def test_overall_level_of_the_published_spectrum():
    values = read_case("RV2_gsfc_spectrum_oscillators")
    table = psd_table(*GSFC, "g^2/Hz")
    np.testing.assert_allclose(table.rms / 9.80665, values["qualification spectrum: overall g rms (published 14.1)"])
    np.testing.assert_allclose(table.scale(-10 * np.log10(2)).rms / 9.80665, 9.995388317033177, rtol=1e-12)


@pytest.mark.long
def test_area_of_any_slope_against_quadrature():
    for slope in (-1.0, -1.0 + 1e-6, -3.0, 0.0, 2.3):
        table = psd_table([10.0, 40.0], [2.0, 2.0 * 4.0**slope], "N^2/Hz")
        area = quad(lambda f, n=slope: 2.0 * (f / 10.0) ** n, 10.0, 40.0, epsrel=1e-13)[0]
        np.testing.assert_allclose(table.mean_square, area, rtol=1e-12)
        np.testing.assert_allclose(table.at([5.0, 20.0, 50.0]), [0.0, 2.0 * 2.0**slope, 0.0], rtol=1e-12)


def test_units_and_sides():
    one = psd_table([10.0, 40.0], [2.0, 3.0], "N^2/Hz")
    two = psd_table([10.0, 40.0], [1.0, 1.5], "N^2/Hz", sides=2)
    turned = psd_table(
        [20 * np.pi, 80 * np.pi], [2.0 / (2 * np.pi), 3.0 / (2 * np.pi)], "N^2/Hz", frequency_unit="rad/s"
    )
    for other in (two, turned):
        np.testing.assert_allclose(other.mean_square, one.mean_square, rtol=1e-14)
    assert one.quantity == "force" and psd_table(*GSFC, "g^2/Hz").quantity == "acceleration"


@pytest.mark.long
def test_derivative_by_levels_and_frequencies():
    def area(f, S):
        return psd_table(f, S, "N^2/Hz").mean_square

    f, S = np.array([10.0, 20.0, 45.0]), np.array([1.0, 0.5, 0.9])
    found = jax.grad(area, (0, 1))(f, S)
    for which in (0, 1):
        for k in range(3):
            step = 1e-5 * np.eye(3)[k]
            more, less = [(f + s, S) if which == 0 else (f, S + s) for s in (step, -step)]
            np.testing.assert_allclose(found[which][k], (area(*more) - area(*less)) / 2e-5, rtol=1e-8)


def test_all_faults_in_one_report():
    with pytest.raises(ModelError) as error:
        psd_table([20.0, 10.0], [1.0, -1.0], "g/Hz", frequency_unit="rpm", sides=3)
    assert len(error.value.faults) == 5
    with pytest.raises(ModelError, match="positive"):
        WhiteNoise(0.0)


F, G = np.array([0.5, 2.0, 3.0, 3.001, 9.0]), np.array([1.0, 4.0, 4.5, 0.3, 0.01])


@pytest.mark.parametrize("order", [0, 0.75, 1, 2, 4])
def test_moments(order):
    table = psd_table(F, G, unit=None)
    pieces = zip(F[:-1], F[1:], strict=True)
    law = lambda f: f**order * np.exp(np.interp(np.log(f), np.log(F), np.log(G)))
    np.testing.assert_allclose(
        table.moment(order), sum(quad(law, a, b, epsabs=1e-13)[0] for a, b in pieces), rtol=1e-9
    )


@pytest.mark.long
def test_narrow_band_and_silence():
    narrow = psd_table(20 + 1e-7 * np.arange(3), [1e-3, 1.0, 1e-3], unit=None)
    np.testing.assert_allclose(narrow.moment(4) / narrow.moment(0), 20.0**4, rtol=1e-7)
    np.testing.assert_allclose([narrow.crossings, narrow.peaks], 20.0, rtol=1e-7)
    np.testing.assert_allclose(jax.grad(lambda g: psd_table(F, g, unit=None).rms)(np.zeros(5)), 0)


STEP = [10.0, 15.0, 15.0, 30.0], [0.18, 0.18, 0.1, 0.2]


def test_a_level_that_steps():
    """Each side on its own is the area of a table without a step; the level at it is that of the side asked for."""
    table = psd_table(*STEP, "N^2/Hz")
    parts = psd_table(*(x[:2] for x in STEP), "N^2/Hz"), psd_table(*(x[2:] for x in STEP), "N^2/Hz")
    for order in (0, 1, 2, 4):
        np.testing.assert_allclose(table.moment(order), sum(part.moment(order) for part in parts), rtol=1e-14)
    np.testing.assert_allclose(table.rms**2, 0.18 * 5 + 0.1 * 15 * (2**2 - 1) / 2, rtol=1e-14)  # slope one
    np.testing.assert_allclose(table.at([14.9, 15.0, 15.0 + 1e-9, 30.0]), [0.18, 0.1, 0.1, 0.2], rtol=1e-9)
    np.testing.assert_allclose(table.at(15.0, side="left"), 0.18)
    rms = mbs.jit(jax.value_and_grad(lambda g: psd_table(STEP[0], g, "N^2/Hz").rms))
    slope = rms(jax.numpy.array(STEP[1]))[1]
    for k in range(4):
        up, down = (rms(jax.numpy.array(STEP[1]) + s * 1e-6 * np.eye(4)[k])[0] for s in (1, -1))
        np.testing.assert_allclose(slope[k], (up - down) / 2e-6, rtol=1e-6)


@pytest.mark.parametrize(
    "frequencies, said",
    [
        ([0.0, 10.0, 20.0], "must be positive: leave out points at 0 Hz"),
        ([30.0, 10.0, 20.0], "10 stands after 30"),
        ([10.0, 10.0, 20.0], "a step at an end"),
        ([10.0, 20.0, 20.0], "a step at an end"),
        ([10.0, np.nan, 20.0], "must be finite"),
    ],
)
def test_faults_of_frequencies_say_which(frequencies, said):
    with pytest.raises(ModelError, match=said):
        psd_table(frequencies, [1.0, 2.0, 3.0], "g^2/Hz")
    with pytest.raises(ModelError, match="more than twice"):
        psd_table([1.0, 2.0, 2.0, 2.0, 3.0], np.ones(5), "g^2/Hz")
    with pytest.raises(ModelError, match="levels must be positive"):
        psd_table([1.0, 2.0], [1.0, np.nan], "g^2/Hz")


def test_a_table_without_a_unit_is_told():
    with pytest.warns(DeprecationWarning, match="no unit was given, 'g\\^2/Hz' is taken"):
        told = psd_table(*GSFC)
    np.testing.assert_array_equal(told.levels, psd_table(*GSFC, "g^2/Hz").levels)
