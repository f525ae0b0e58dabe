"""TY1: a PAC2002 tyre: pure and combined slip, slopes by slip, load, camber and coefficients, peaks."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

import jaxmbs as mbs
from jaxmbs import vehicles
from tests.vehicles.tyres import CASE, COEFFICIENTS

NUMBER = r"(-?[\d.e-]+)"
PLACE = re.compile(rf"at Fz {NUMBER} N, kappa {NUMBER}, tan\(alpha\) {NUMBER}, sin\(gamma\) {NUMBER}")
NAMES = ("Fx0", "Fy0", "Mz0", "Fx", "Fy")


@mbs.jit
def forces(coefficients, at):
    """Forces (5,) at (load, slip, tangent of the slip angle, sine of the inclination)."""
    model, slip = vehicles.MagicFormula(coefficients, "5.2"), vehicles.Slip(*at)
    pure, whole = model.pure_forces(slip), model.forces(slip)
    return jnp.stack([pure.fx, pure.fy, pure.mz, whole.fx, whole.fy])


@mbs.jit
def slopes(coefficients, at):
    return jax.jacrev(forces, argnums=(0, 1))(coefficients, at)


@pytest.mark.slow
def test_rows_of_the_case():
    """All forces to 1e-9 and slopes to 1e-8, of each its own tolerance."""
    given = {name: jnp.asarray(value) for name, value in COEFFICIENTS.items()}
    count = 0
    for row in CASE["outputs"]:
        place = PLACE.search(row["quantity"])
        if not place:
            continue
        at = jnp.array([float(x) for x in place.groups()])
        derivative = re.match(r"d (\w+) / d (\w+)", row["quantity"])
        if derivative:
            name, by = derivative.groups()
            of_coefficients, of_place = slopes(given, at)
            places = {"Fz": 0, "kappa": 1, "a": 2, "g": 3}
            found = of_place[:, places[by]] if by in places else of_coefficients[by]
            found = found[NAMES.index(name)]
        else:
            found = forces(given, at)[NAMES.index(row["quantity"].split()[0])]
        assert abs(found - row["value"]) <= row["tol"] * (abs(row["value"]) or 1.0), row["quantity"]
        count += 1
    assert count == 49


@pytest.mark.slow
def test_peaks_of_the_case():
    """Largest forces of driving and cornering."""
    for row in CASE["outputs"][-6:]:
        load = float(re.search(rf"at Fz {NUMBER} N", row["quantity"])[1])
        driving, sign = "driving" in row["quantity"], 1.0 if "peak" in row["quantity"] else -1.0

        def force(x, load=load, driving=driving, sign=sign):
            at = jnp.array([load, x, 0.0, 0.0] if driving else [load, 0.0, x, 0.0])
            return -sign * float(forces(COEFFICIENTS, at)[0 if driving else 1])

        found = scipy.optimize.minimize_scalar(force, bounds=(0.01, 0.6), method="bounded", options={"xatol": 1e-8})
        np.testing.assert_allclose(-sign * found.fun, row["value"], rtol=row["tol"])


def test_conventions_of_a_program_that_ends_its_curves():
    """Chrono: `C D + 0.1`, `B x` up to pi/2 - 0.01; beyond, the curve is flat."""
    model = vehicles.MagicFormula(COEFFICIENTS, "5.2", "chrono")
    side = [float(model.pure_forces(vehicles.Slip(4850.0, 0.0, x)).fy) for x in (0.01, 0.3, 0.4)]
    ours = [float(forces(COEFFICIENTS, jnp.array([4850.0, 0.0, x, 0.0]))[1]) for x in (0.01, 0.3, 0.4)]
    np.testing.assert_allclose(side[0], ours[0], rtol=1e-4)
    assert side[1] == side[2] and ours[1] != ours[2]
