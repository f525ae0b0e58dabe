"""Examples of random vibration, sine tests, load cases and identification."""

import inspect

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import qualification

from .attempts import call
from .cases import case
from .matrices import OSCILLATOR

TABLE = qualification.psd_table([20.5, 50.0, 800.0], [0.026, 0.16, 0.16])
BASE = {"base": qualification.BaseAcceleration(TABLE, "z")}
ROWS = np.array([[1.5], [-0.3], [0.1]])
HISTORY = np.array([[0.5, 2.0], [-1.0, 3.0], [0.25, 1.0]])
COMPONENTS = ["x", "y"]
NAMES = "names of outputs are free"


def _response():
    return mbs.random_response(OSCILLATOR, BASE, {"s": qualification.Recovery(ROWS, ["x", "y", "xy"])})


def _load_case():
    return qualification.LoadCase("landing", HISTORY, COMPONENTS, np.array([0.5, 1.0, 1.5]), 1.5, 2.5)


def _respond(source):
    """The response to an input made by a class: its numbers are judged where they are used."""
    return mbs.random_response(OSCILLATOR, {"base": source}, ["m z"])


def answered(kind, answer):
    def made(*args, **options):
        return answer(kind(*args, **options))

    made.__signature__ = inspect.signature(kind)
    return made


def _line(u):
    return u["a"] * jnp.array([0.5, 1.0, 2.5])


CASES = {
    "identification.identify": case(
        lambda z: call(
            _line, np.array([0.6, 1.1, 2.4]), {"a": 1.5}, {"a": (0.5, 4.0)}, 0.25, prior={"a": (1.5, 0.5)}, robust=1.5
        ),
        "data nan: a gap",
        "bounds inf: no bound",
        "bounds name: refused as another structure",
        "robust inf: no outliers",
        positive="deviations robust",
    ),
    "qualification.BaseAcceleration": case(
        lambda z: call(TABLE, "z"), "spectrum none: a direction alone", through=lambda kind: answered(kind, _respond)
    ),
    "qualification.RandomForce": case(
        lambda z: call(qualification.psd_table([20.5, 800.0], [4.5, 0.4], "N^2/Hz"), {"m z": 1.5}),
        through=lambda kind: answered(kind, _respond),
    ),
    "qualification.LoadCase": case(
        lambda z: call("landing", HISTORY, COMPONENTS, np.array([0.5, 1.0, 1.5]), 1.5, 2.5),
        "name name: names are free",
        "names name: names are free",
        positive="factor sigmas",
    ),
    "qualification.load_envelope": case(lambda z: call([_load_case()])),
    "jaxmbs.random_response": case(lambda z: call(OSCILLATOR, BASE, ["m z"])),
    "qualification.random_response": case(
        lambda z: call(OSCILLATOR, BASE, ["m z"], None, None, 0.05, 1, 16),
        f"inputs name: {NAMES}",
        positive="loss",
    ),
    "qualification.sine_response": case(
        lambda z: call(
            OSCILLATOR,
            (np.array([5.5, 100.0]), np.array([1.5, 1.0])),
            {"a": qualification.Coordinates("m z")},
            notch={"a": 50.5},
            frequencies=np.array([31.5, 32.0]),
        ),
        f"out name: {NAMES}",
        "frequencies shape: any number",
        "notch inf: no limit",
    ),
    "qualification.stress_spectrum": case(lambda z: call(_response(), "s x")),
    "qualification.von_mises_spectrum": case(lambda z: call(_response(), ["s x", "s y", "s xy"])),
    "qualification.critical_plane": case(lambda z: call(_response(), ["s x", "s y", "s xy"], "normal")),
}
