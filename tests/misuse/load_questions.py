"""Examples of random vibration, sine tests, load cases and identification."""

import inspect

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import experiment, fatigue, qualification

from .attempts import call
from .cases import case
from .matrices import OSCILLATOR

TABLE = fatigue.psd_table([20.5, 50.0, 800.0], [0.026, 0.16, 0.16], "g^2/Hz")
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


def _torque(u, motion):
    _, v, a = motion.at(motion.times(8))
    return u["a"] * a[:, 0] + 0.5 * v[:, 0]


def _segment(start, ts):
    return start * ts, 2.0 * start


def _sampled(motion):
    return motion.at(np.linspace(0.0, 1.5, 4))


def _two_masses(u):
    K = u["k"] * np.array([[2.0, -1.0], [-1.0, 1.0]])
    return mbs.LinearSystem(mass=np.diag([1.0, 0.5]), stiffness=K, coordinates=["a z", "b z"])


def _updated(modes):
    """The update by measured modes made by the class: their numbers are judged there."""
    return experiment.update(_two_masses, {"k": 8e3}, modes=modes).identification.values


CASES = {
    "identification.best_excitation": case(
        lambda z: call(
            _torque, {"a": 1.5}, ((-0.5,), (0.75,)), 2.5, 8.5, 2.0, 1, deviations=0.25, steps=3, progress=False
        ),
        positive="speed acceleration period deviations",
    ),
    "identification.FourierMotion": case(
        lambda z: call(np.array([0.5]), np.array([[0.25, 0.5]]), np.array([[0.75, 0.1]]), 2.0),
        through=lambda kind: answered(kind, _sampled),
        positive="period",
    ),
    "identification.log_cholesky": case(
        lambda z: call(2.5, np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.6, 0.7])), positive="mass"
    ),
    "identification.from_log_cholesky": case(lambda z: call(np.linspace(0.1, 0.6, 10))),
    "identification.multiple_shooting": case(
        lambda z: call(_segment, np.array([1.5, 2.5]), np.linspace(0.0, 1.0, 5))
    ),
    "experiment.MeasuredModes": case(
        lambda z: call([12.5, 29.5], np.array([[0.75, 0.7], [1.0, -1.0]]), ("a z", "b z"), [0.02, 0.03]),
        "channels name: names are free",
        positive="frequencies",
    ),
    "experiment.update": case(
        lambda z: call(_two_masses, {"k": 8e3}, {"k": (1e3, 5e4)}, modes=experiment.MeasuredModes([12.18, 29.41])),
        "bounds inf: no bound",
        "bounds name: refused as another structure",
    ),
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
        lambda z: call(fatigue.psd_table([20.5, 800.0], [4.5, 0.4], "N^2/Hz"), {"m z": 1.5}),
        through=lambda kind: answered(kind, _respond),
    ),
    "qualification.LoadCase": case(
        lambda z: call("landing", HISTORY, COMPONENTS, np.array([0.5, 1.0, 1.5]), 1.5, 2.5),
        "name name: names are free",
        "names name: names are free",
        positive="factor sigmas",
    ),
    "qualification.load_envelope": case(lambda z: call([_load_case()])),
    "jaxmbs.random_response": case(lambda z: call(OSCILLATOR, BASE, ["m z"]), f"inputs name: {NAMES}"),
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
