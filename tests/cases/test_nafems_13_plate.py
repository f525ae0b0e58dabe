"""RV1: NAFEMS R0016 test 13, a simply supported thin plate under a pressure: harmonic and random."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.elements import Quadrilateral
from jaxmbs.fatigue import psd_table
from jaxmbs.fem import Structure, assemble, gather_rows, pressure_load
from jaxmbs.qualification import Coordinates, RandomForce, random_response, sine_response
from jaxmbs.vibration import modes
from tests.qualification import read_case

CASE = read_case("RV1_nafems_13_plate")


def quarter(n):
    """A quarter of the plate with its axes of symmetry at x = 0 and y = 0, and the load of a unit pressure."""
    x, y = (g.ravel() for g in np.meshgrid(np.linspace(0, 5, n + 1), np.linspace(0, 5, n + 1)))
    number = lambda i, j: j * (n + 1) + i
    squares = [
        (number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)) for j in range(n) for i in range(n)
    ]
    held = {}
    for k in range(len(x)):
        own = ["x", "y", "rz"]
        own += ["ry"] if x[k] == 0 else []
        own += ["rx"] if y[k] == 0 else []
        own += ["z", "rx"] if x[k] == 5 else []
        own += ["z", "ry"] if y[k] == 5 else []
        held[k] = " ".join(dict.fromkeys(own))
    element = Quadrilateral(2e11, 0.3, 0.05, 8000.0)
    structure = Structure(np.stack([x, y, 0 * x], axis=1), {"plate": (element, squares)}, held=held)
    return assemble(structure), gather_rows(structure, pressure_load(structure, "plate", 1.0))


def answers(n):
    system, load = quarter(n)
    centre = "0 z"
    table = psd_table([0.01, 40.0], [1e4, 1e4], "Pa^2/Hz")
    out = {"w": Coordinates(centre, "displacement")}
    random = random_response(system, {"p": RandomForce(table, load)}, out, ratios=0.02)
    sine = sine_response(
        system, ([1.0, 40.0], [100.0, 100.0]), out, RandomForce(None, load), unit="N", ratios=0.02, points=2000
    )
    peak = sine.frequencies[jnp.argmax(sine.amplitudes[:, 0])]
    return np.array([modes(system, 1).frequencies[0], sine.peaks[0], random.psd(peak)[0, 0], random.rms[0]])


@pytest.mark.long
def test_converged_and_published_values():
    """The error of the mesh is of second order; extrapolated it meets the converged series, and the published values
    of the first mode to what they leave out."""
    coarse, fine = answers(6), answers(12)
    found = (4 * fine - coarse) / 3
    names = ("first frequency Hz", "harmonic: peak displacement m", "random: peak displacement PSD m^2/Hz")
    wanted = [CASE[name] for name in (*names, "random: rms displacement, 0 to 40 Hz, m")]
    np.testing.assert_allclose(found, wanted, rtol=2e-3)
    published = [
        CASE["published: harmonic peak displacement m"],
        CASE["published: random peak displacement PSD m^2/Hz"],
    ]
    np.testing.assert_allclose(found[1:3], published, rtol=4e-3)
