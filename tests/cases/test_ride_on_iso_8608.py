"""RR1: a quarter car on random roads of ISO 8608: root mean squares, comfort, slopes, best dampers, weightings."""

import json
import re
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

import jaxmbs as mbs
from jaxmbs import vehicles

CASE = json.loads((Path(__file__).parent / "RR1_quarter_car_iso8608.json").read_text())
GIVEN = {name: CASE["parameters"][name] for name in ("ms", "mu", "ks", "c", "kt")}
NAMES = ("acceleration of the body", "suspension travel", "dynamic tyre load", "load of the spring", "Wk")


def quarter(like=None, *, ms, mu, ks, c, kt):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name, mass in (("plate", 1.0), ("wheel", mu), ("body", ms)):
        b.body(name, mass=mass)
    b.joint("road", mbs.Prismatic("z"), "ground", "plate", drive=mbs.forces.Constant(0.0))
    b.joint("tyre", mbs.Prismatic("z"), "plate", "wheel")
    b.joint("strut", mbs.Prismatic("z"), "wheel", "body")
    b.force("tyre", mbs.SpringDamper(stiffness=kt), joint="tyre")
    b.force("strut", mbs.SpringDamper(stiffness=ks, damping=c), joint="strut")
    return b.build(like=like)


FIRST = quarter(**GIVEN)


@mbs.jit
def answers(numbers, level, speed):
    """Root mean squares (5,) in the order of the case."""
    system = quarter(FIRST, **numbers)
    state = mbs.State.at(system)

    def outputs(state, accelerations):
        travel = state.coordinates[2]
        return jnp.stack(
            [jnp.sum(accelerations), travel, numbers["kt"] * state.coordinates[1], numbers["ks"] * travel]
        )

    linear = mbs.linearise(system, state, inputs=["road"], outputs=outputs)
    first = linear.output_names[0]
    return vehicles.ride(linear, vehicles.RandomRoad(level), speed, weightings={first: "Wk"}).rms


@mbs.jit
def slopes(numbers, level, speed):
    return jax.jacrev(answers)(numbers, level, speed)


@pytest.mark.long
def test_rows_of_the_case():
    """All 30 of roads and slopes, to 1e-9 and 1e-8; two best dampers to 1e-6."""
    count = 0
    derivatives = slopes(GIVEN, CASE["parameters"]["roads"]["C"], 20.0)
    for row in CASE["outputs"]:
        words = row["quantity"]
        place = re.search(r"class (\w), (\d+) m/s", words)
        if not place:
            continue
        which = next(k for k, name in enumerate(NAMES) if name in words)
        if words.startswith("d "):
            found = derivatives[re.search(r" / d (\w+)", words)[1]][which]
            floor = 1e-7 * (1.0 if abs(row["value"]) < 1e-15 else 0.0) * float(answers(GIVEN, 2.56e-4, 20.0)[which])
            floor = floor / 22000.0
        else:
            found = answers(GIVEN, CASE["parameters"]["roads"][place[1]], float(place[2]))[which]
            floor = 0.0
        assert abs(found - row["value"]) <= row["tol"] * abs(row["value"]) + floor, words
        count += 1
    assert count == 35
    for which, row in zip((0, 2), CASE["outputs"][35:37], strict=True):
        slope = lambda c, which=which: slopes(GIVEN | {"c": c}, 2.56e-4, 20.0)["c"][which]
        best = scipy.optimize.brentq(slope, 500.0, 4000.0, xtol=1e-6)
        np.testing.assert_allclose(best, row["value"], rtol=row["tol"])


def test_weightings_of_the_case():
    for row in CASE["outputs"][37:]:
        frequency = float(re.search(r"at ([\d.]+) Hz", row["quantity"])[1])
        found, rounded = vehicles.weighting("Wk").factor(frequency), 0.0015 * ("published" in row["quantity"])
        np.testing.assert_allclose(found, row["value"], rtol=row["tol"], atol=rounded)
