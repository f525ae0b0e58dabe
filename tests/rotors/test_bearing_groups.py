"""Bearings of a kind are computed at once: each as by itself, and many cost no more equations than two."""

import jax
import numpy as np
import pytest

from jaxmbs import rotors


class Cross:
    """A bearing of a kind of its own."""

    station = 3

    def coefficients(self, speed):
        return speed * np.array([[0.0, 1.0], [-1.0, 0.0]]), np.eye(2)


def _all(number):
    """Bearings of every kind at stations from 0 on."""
    table = lambda k, scale: rotors.BearingTable(k, [0.0, 300.0], scale * np.ones((2, 2, 2)), np.zeros((2, 2, 2)))
    found = []
    for k in range(number):
        found += [rotors.Bearing(k, 1e6 * (k + 1), 10.0 * k), table(k, 1e5 * (k + 1.0))]
        found += [rotors.PlainBearing(k, 0.1, 0.03, 1e-4, 0.1, 500.0 + k, film) for film in ("short", "long")]
    return found


@pytest.mark.slow
def test_supports_are_those_of_each_bearing():
    shaft, bearings = rotors.Shaft(np.linspace(0.0, 1.0, 4), 0.02), [*_all(2), Cross()]
    rotor, speed = rotors.Rotor(shaft, [], bearings), 200.0
    wanted = np.zeros((2, rotor.num_coordinates, rotor.num_coordinates))
    for bearing in bearings:
        at = np.array([rotor.column(bearing.station, axis) for axis in "xy"])
        for part, own in zip(wanted, bearing.coefficients(speed), strict=True):
            part[np.ix_(at, at)] += own
    np.testing.assert_allclose(rotor.supports(speed), wanted, rtol=1e-12)


def test_forces_have_the_order_of_the_bearings():
    shaft = rotors.Shaft(np.linspace(0.0, 1.0, 4), 0.02)
    soft, stiff = (lambda k, x=x: rotors.Bearing(k, x) for x in (1e5, 1e7))
    plain = rotors.PlainBearing(1, 0.1, 0.03, 1e-4, 0.1, 500.0)
    rotor = rotors.Rotor(shaft, [rotors.Disk(2, 5.0, 0.01, 0.02)], [soft(0), plain, stiff(3)])
    found = rotors.unbalance_response(rotor, [50.0], {2: 1e-3})
    for k, stiffness in ((0, 1e5), (2, 1e7)):
        station = rotor.bearings[k].station
        np.testing.assert_allclose(found.forces[0, k], stiffness * found.deflections[0, station], rtol=1e-12)


@pytest.mark.parametrize("question", ["supports", "inertias"])
def test_many_cost_no_equations_each(question):
    shaft, ask = rotors.Shaft(np.linspace(0.0, 1.0, 17), 0.02), {"supports": (100.0,), "inertias": ()}[question]
    sizes = []
    for number in (2, 16):
        disks = [rotors.Disk(k, 1.0, 0.1, 0.1) for k in range(number)]
        rotor = rotors.Rotor(shaft, disks, _all(number))
        sizes.append(len(str(jax.make_jaxpr(lambda rotor: getattr(rotor, question)(*ask))(rotor)).splitlines()))
    assert sizes[1] < sizes[0] + 14 * 20  # of stacking their numbers alone
