"""A Jeffcott rotor: whirl, peak and amplification factor in closed form, with derivatives; margins of API 617."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import rotors

LENGTH, RADIUS, YOUNG, MASS, UNBALANCE, DAMPING = 1.0, 0.01, 2e11, 10.0, 1e-3, 200.0
STIFFNESS = 48.0 * YOUNG * np.pi / 4.0 * RADIUS**4 / LENGTH**3


def jeffcott(damping=DAMPING, mass=MASS):
    """A disk amid a shaft without mass, whose ends are as good as fixed in place; a damper at the disk."""
    shaft = rotors.Shaft([0.0, LENGTH / 2.0, LENGTH], RADIUS, young=YOUNG, density=1e-6)
    ends = [rotors.Bearing(k, 1e13) for k in (0, 2)]
    return rotors.Rotor(shaft, [rotors.Disk(1, mass, 1e-9, 1e-9)], [*ends, rotors.Bearing(1, 0.0, damping)])


def amplitude(speed, damping=DAMPING):
    return UNBALANCE * speed**2 / np.abs(STIFFNESS - MASS * speed**2 + 1j * speed * damping)


@pytest.mark.long
def test_response_and_resonance_of_a_jeffcott_rotor():
    rotor, natural = jeffcott(), np.sqrt(STIFFNESS / MASS)
    speeds = natural * np.array([0.5, 0.98, 1.0, 1.5, 4.0])
    found = rotors.unbalance_response(rotor, speeds, {1: UNBALANCE}).orbit(1)
    np.testing.assert_allclose(found.major, amplitude(speeds), rtol=1e-7)
    np.testing.assert_allclose(found.minor, found.major, rtol=1e-9)
    np.testing.assert_allclose(found.sense, 1.0)
    zeta = DAMPING / (2.0 * MASS * natural)
    peak = rotors.resonance(rotor, (0.3 * natural, 2.0 * natural), {1: UNBALANCE}, 1)
    np.testing.assert_allclose(peak.speed, natural / np.sqrt(1.0 - 2.0 * zeta**2), rtol=1e-7)
    np.testing.assert_allclose(peak.amplitude, UNBALANCE / MASS / (2.0 * zeta * np.sqrt(1.0 - zeta**2)), rtol=1e-7)
    # r^4 / ((1 - r^2)^2 + (2 z r)^2) = half of the peak: a quadratic in r^2
    half = 1.0 / (8.0 * zeta**2 * (1.0 - zeta**2))
    ends = np.sqrt(np.roots([1.0 - 1.0 / half, 4.0 * zeta**2 - 2.0, 1.0]).real)
    np.testing.assert_allclose([peak.below, peak.above], np.sort(ends) * natural, rtol=1e-7)
    np.testing.assert_allclose(peak.amplification_factor, peak.speed / (peak.above - peak.below))
    critical = rotors.critical_speeds(jeffcott(0.0), 2)
    np.testing.assert_allclose(critical.speeds, natural, rtol=1e-7)


@pytest.mark.long
def test_amplification_factor_has_a_derivative():
    natural = np.sqrt(STIFFNESS / MASS)
    factor = lambda c: (
        rotors.resonance(jeffcott(c), (0.3 * natural, 2.0 * natural), {1: UNBALANCE}, 1).amplification_factor
    )
    for derivative in (jax.grad, jax.jacfwd):
        slope = mbs.jit(derivative(factor))(DAMPING)
        np.testing.assert_allclose(slope, (factor(DAMPING + 0.1) - factor(DAMPING - 0.1)) / 0.2, rtol=1e-6)


def test_margins_are_those_of_the_formulas():
    found = rotors.separation_margin(jnp.array([2.0, 2.5, 3.5, 11.5]), "below")
    np.testing.assert_allclose(found, [0.0, 0.0, 0.085, 0.153], atol=1e-15)
    np.testing.assert_allclose(rotors.separation_margin(3.5, "above"), 0.185)
    with pytest.raises(mbs.ModelError, match="below"):
        rotors.separation_margin(3.5, "beside")


def test_wrong_rotors_are_refused():
    shaft = rotors.Shaft([0.0, 0.5, 1.0], 0.01)
    wrong = [
        ("rise", lambda: rotors.Shaft([0.0, 0.5, 0.4], 0.01)),
        ("above the inner", lambda: rotors.Shaft([0.0, 0.5], 0.01, 0.02)),
        ("one radius or 2", lambda: rotors.Shaft([0.0, 0.5, 1.0], [0.01, 0.01, 0.01])),
        ("young", lambda: rotors.Shaft([0.0, 0.5], 0.01, young=-1.0)),
        ("station 3", lambda: rotors.Rotor(shaft, [rotors.Disk(3, 1.0, 0.1, 0.1)])),
        ("not negative", lambda: rotors.Disk(0, -1.0, 0.1, 0.1)),
        ("no rotors.Disk", lambda: rotors.Rotor(shaft, [rotors.Bearing(0, 1e6)])),
        ("speeds must rise", lambda: rotors.BearingTable(0, [2.0, 1.0], np.ones((2, 2, 2)), np.ones((2, 2, 2)))),
        ("no station 7", lambda: rotors.unbalance_response(rotors.Rotor(shaft), [1.0], {7: 1.0})),
    ]
    for match, make in wrong:
        with pytest.raises(mbs.ModelError, match=match):
            make()
    table = rotors.BearingTable(0, [0.0, 1.0], np.ones((2, 2, 2)), np.ones((2, 2, 2)))
    with pytest.raises(mbs.ModelError, match="depend on the speed"):
        rotors.critical_speeds(rotors.Rotor(shaft, (), [table]))
