"""Slips of every day in tests of equipment are said: isolators that were forgotten, frequencies in rad/s."""

import warnings

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import qualification as qual
from jaxmbs.coupling import RigidBody, bushing, connect
from jaxmbs.fatigue import psd_table

FEET = {"fl": (0.15, 0.1, 0.0), "fr": (0.15, -0.1, 0.0), "rl": (-0.15, 0.1, 0.0), "rr": (-0.15, -0.1, 0.0)}
GEVS = [20.0, 50.0, 800.0, 2000.0], [0.026, 0.16, 0.16, 0.026]


def box(*feet):
    body = RigidBody(mass=6.0, inertia=(0.04, 0.06, 0.08), points=FEET)
    return connect({"box": body}, {f: bushing(("box", [(f, d) for d in "xyz"]), stiffness=[1e5] * 3) for f in feet})


def shaken(system):
    base = {"base": qual.BaseAcceleration(psd_table(*GEVS, "g^2/Hz"), "z")}
    return mbs.random_response(system, base, {"a": qual.Coordinates("box.com z")}, ratios=0.08)


@pytest.mark.slow
def test_isolators_that_were_forgotten():
    with pytest.warns(UserWarning, match="does not hold 3 motions of the structure"):
        shaken(box("fl"))
    assert "held in part" in str(mbs.check(box("fl")))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shaken(box(*FEET))
    assert mbs.check(box(*FEET)).grounded == "held" and mbs.check(box()).grounded == "free"


@pytest.mark.parametrize("frequencies", [GEVS[0], [5.0, 100.0], [20.0, 50.0, 123.0, 2000.0]])
def test_frequencies_in_radians(frequencies):
    f = np.array(frequencies)
    with pytest.warns(UserWarning, match="are they rad/s"):
        psd_table(2 * np.pi * f, np.ones(len(f)), "g^2/Hz")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        psd_table(f, np.ones(len(f)), "g^2/Hz")
        psd_table(2 * np.pi * f, np.ones(len(f)), "g^2/Hz", frequency_unit="rad/s")
        psd_table(np.geomspace(20.0, 2000.0, 7), np.ones(7), "g^2/Hz")
