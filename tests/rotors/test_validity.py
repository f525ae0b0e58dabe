"""Bearings beyond the speeds and frequencies of their tables, or the lengths of their films, are told by name."""

import warnings

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import rotors
from jaxmbs.status import Status

SHAFT, DISK = rotors.Shaft(np.linspace(0.0, 1.0, 3), 0.02), rotors.Disk(1, 5.0, 0.01, 0.02)


def table(speeds, omegas=None):
    shape = (len(speeds), *(() if omegas is None else (len(omegas),)), 1, 1)
    return rotors.BearingTable(0, speeds, 1e6 * np.ones(shape) * np.eye(2), 1e2 * np.ones(shape) * np.eye(2), omegas)


def on(bearing):
    return rotors.Rotor(SHAFT, [DISK], [rotors.Bearing(2, 1e6, 10.0), bearing])


BY_SPEED = on(table([100.0, 300.0]))
LOAD = {1: 1e-3}
ASKED = {
    "unbalance_response": lambda rotor, a, b: rotors.unbalance_response(rotor, [a, b], LOAD),
    "whirl_speeds": lambda rotor, a, b: rotors.whirl_speeds(rotor, [a, b], 2),
    "resonance": lambda rotor, a, b: rotors.resonance(rotor, (a, b), LOAD, 1),
    "run_up": lambda rotor, a, b: rotors.run_up(rotor, lambda t: a + (b - a) * t, LOAD, [0.0, 0.5, 1.0]),
    "at_speed": lambda rotor, a, b: rotor.at_speed(b),
    "harmonic_balance": lambda rotor, a, b: mbs.cycles.harmonic_balance(
        rotor.at_speed, [a, b, a], {"1 x": 1.0}, {"stop": ("1 x", lambda x, v: -x)}, (1, 3)
    ),
}


@pytest.mark.parametrize(
    "name", ["unbalance_response", *(pytest.param(n, marks=pytest.mark.long) for n in list(ASKED)[1:])]
)
def test_every_question_tells_of_a_table_that_ends(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        inside = ASKED[name](BY_SPEED, 100.0, 300.0)
    words = "bearing 1 turns faster than the last speed of its table, by 50 rad/s, first at 350 rad/s"
    with pytest.warns(UserWarning, match=words):
        beyond = ASKED[name](BY_SPEED, 200.0, 350.0)
    if hasattr(beyond, "validity"):
        within, outside = (" ".join(repr(result).split()) for result in (inside, beyond))
        assert f"FAILED: {words}" in outside and "FAILED" not in within


def test_margins_of_a_table_and_of_films():
    found = table([100.0, 300.0], [50.0, 400.0]).validity(jnp.asarray(90.0), jnp.asarray(410.0))
    assert {name: float(margin.value) for name, margin in found.items()} == {
        "least speed": -10.0,
        "largest speed": 210.0,
        "least frequency": 360.0,
        "largest frequency": -10.0,
    }
    assert set(table([0.0], [50.0, 400.0]).validity(7.0)) == {"least frequency", "largest frequency"}
    last = 900.0 * np.pi / 30.0
    assert float(table([1.0, last]).validity(last * (1.0 + 1e-12))["largest speed"].value) == 0.0
    lengths = {("short", 0.05): 0.0, ("short", 0.06): -0.01, ("long", 0.2): 0.0, ("long", 0.15): -0.05}
    for (film, length), margin in lengths.items():
        plain = rotors.PlainBearing(0, 0.1, length, 1e-4, 0.1, 500.0, film)
        np.testing.assert_allclose(plain.validity(100.0)["length"].value, margin, atol=1e-12)


@pytest.mark.long
def test_roots_are_judged_at_their_own_frequency():
    """The second root is faster than the table, the speed is not."""
    rotor = on(table([0.0], [0.0, 300.0]))
    with pytest.warns(UserWarning, match="bearing 1 whirls faster than the last frequency of its table"):
        found = rotors.whirl_speeds(rotor, [50.0], 4)
    assert found.whirl[0, 0] < 300.0 < found.whirl[0, 3]
    margin = found.validity.margins["bearing 1"]["largest frequency"].value
    np.testing.assert_allclose(margin, 300.0 - found.whirl, rtol=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rotors.unbalance_response(rotor, [50.0], LOAD)


@pytest.mark.long
def test_designs_of_a_batch_beyond_a_table_have_the_status():
    response = lambda speed: rotors.unbalance_response(BY_SPEED, speed[None], LOAD)
    found = mbs.batch(response, jnp.array([200.0, 400.0]), progress=False)
    assert list(found.status) == [Status.SUCCESS, Status.VALIDITY]
