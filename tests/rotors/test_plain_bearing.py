"""Plain bearings: the example of Friswell and others, closed forms, and the film of long ones by quadrature."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import rotors

#: Example 5.5.1 of Friswell, Penny, Garvey, Lees, Dynamics of rotating machines (2010): 525 N at 1500 rev/min.
NUMBERS = {"diameter": 0.1, "length": 0.03, "clearance": 1e-4, "viscosity": 0.1, "load": 525.0}
SPEED = 1500.0 * 2.0 * np.pi / 60.0
ECCENTRICITY = 0.2663
STIFFNESS = np.array([[12.81e6, 16.39e6], [-25.06e6, 8.815e6]])
DAMPING = np.array([[232.9e3, -81.92e3], [-81.92e3, 294.9e3]])


def closed_form(e):
    """Stiffness times clearance over load, and damping times clearance and speed over load; ibid. (5.89), (5.90)."""
    left, h = 1.0 - e**2, (np.pi**2 * (1.0 - e**2) + 16.0 * e**2) ** -1.5
    a = [
        [4.0 * (np.pi**2 * (2.0 - e**2) + 16.0 * e**2), np.pi * (np.pi**2 * left**2 - 16.0 * e**4) / (e * left**0.5)],
        [
            -np.pi * (np.pi**2 * left * (1.0 + 2.0 * e**2) + 32.0 * e**2 * (1.0 + e**2)) / (e * left**0.5),
            4.0 * (np.pi**2 * (1.0 + 2.0 * e**2) + 32.0 * e**2 * (1.0 + e**2) / left),
        ],
    ]
    mixed = -8.0 * (np.pi**2 * (1.0 + 2.0 * e**2) - 16.0 * e**2)
    b = [
        [2.0 * np.pi * left**0.5 * (np.pi**2 * (1.0 + 2.0 * e**2) - 16.0 * e**2) / e, mixed],
        [mixed, 2.0 * np.pi * (np.pi**2 * left**2 + 48.0 * e**2) / (e * left**0.5)],
    ]
    return h * np.array(a), h * np.array(b)


@pytest.mark.slow
def test_published_example_and_closed_form():
    bearing = rotors.PlainBearing(0, **NUMBERS)
    coefficients = jax.jit(lambda b, w: (b.eccentricity(w), *b.coefficients(w)))
    e, K, C = coefficients(bearing, jnp.asarray(SPEED))
    np.testing.assert_allclose(e, ECCENTRICITY, rtol=2e-4)
    np.testing.assert_allclose(K, STIFFNESS, rtol=5e-4)
    np.testing.assert_allclose(C, DAMPING, rtol=5e-4)
    for speed in (20.0, SPEED, 2000.0):
        e, K, C = coefficients(bearing, jnp.asarray(speed))
        a, b = closed_form(float(e))
        np.testing.assert_allclose(np.asarray(K) * 1e-4 / 525.0, a, rtol=1e-8)
        np.testing.assert_allclose(np.asarray(C) * 1e-4 * speed / 525.0, b, rtol=1e-8)


@pytest.mark.long
def test_film_carries_the_load_and_slopes_are_those_of_differences():
    def stiffness(viscosity):
        bearing = rotors.PlainBearing(0, **NUMBERS | {"viscosity": viscosity})
        return bearing.coefficients(jnp.asarray(SPEED))[0]

    bearing = rotors.PlainBearing(0, **NUMBERS)
    force = bearing.film_force(bearing.place(jnp.asarray(SPEED)), jnp.zeros(2), jnp.asarray(SPEED))
    np.testing.assert_allclose(force, [0.0, 525.0], atol=1e-8)
    slope = jax.jit(jax.jacfwd(stiffness))(0.1)
    np.testing.assert_allclose(slope, (stiffness(0.1001) - stiffness(0.0999)) / 2e-4, rtol=1e-5)


@pytest.mark.long
def test_long_bearing_is_half_of_sommerfelds_film():
    """Its pressure by quadrature of Reynolds' equation around the film, and the attitude in closed form."""
    bearing = rotors.PlainBearing(0, **NUMBERS | {"length": 0.3}, film="long")
    theta = np.linspace(0.0, np.pi, 100_001)
    for e, e_rate, turn in ((0.6, 0.0, 0.0), (0.6, 20.0, 10.0), (0.3, -15.0, 80.0)):
        gap = 1.0 + e * np.cos(theta)
        flow = (SPEED - 2.0 * turn) * gap + 2.0 * e_rate * np.sin(theta)
        slope = (flow - np.trapezoid(flow / gap**3, theta) / np.trapezoid(1.0 / gap**3, theta)) / gap**3
        pressure = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(theta))])
        unit = 6.0 * 0.1 * 0.05**3 * 0.3 / 1e-4**2
        wanted = unit * np.trapezoid(pressure * np.array([np.cos(theta), np.sin(theta)]), theta)
        place, velocity = 1e-4 * np.array([e, 0.0]), 1e-4 * np.array([e_rate, e * turn])
        np.testing.assert_allclose(bearing.film_force(*map(jnp.asarray, (place, velocity, SPEED))), wanted, rtol=1e-6)
    e = bearing.eccentricity(jnp.asarray(SPEED))
    x, y = bearing.place(jnp.asarray(SPEED))
    np.testing.assert_allclose(-x / y, np.pi * np.sqrt(1.0 - e**2) / (2.0 * e), rtol=1e-9)
    force = bearing.film_force(jnp.stack([x, y]), jnp.zeros(2), jnp.asarray(SPEED))
    np.testing.assert_allclose(force, [0.0, 525.0], atol=1e-8)
