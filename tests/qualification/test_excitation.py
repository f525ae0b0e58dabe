"""Tests on a moving ground of what nothing holds to it, by every question that has one: refused by name."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import qualification as qual
from jaxmbs.coupling import base_motion
from jaxmbs.errors import ModelError

SPRING = np.array([[1.0, -1.0], [-1.0, 1.0]])
PSD = mbs.fatigue.psd_table([10.0, 500.0], [0.05, 0.05], "g^2/Hz")
OUT = {"acc": qual.Coordinates("a z")}


def pair(ground=0.0, dashpot=0.0, **options):
    """Two masses on a spring, the first on a spring and a dashpot to the ground."""
    to_ground = np.diag([1.0, 0.0])
    return mbs.LinearSystem(
        mass=np.diag([2.0, 1.0]),
        stiffness=5e4 * SPRING + ground * to_ground,
        damping=20.0 * SPRING + dashpot * to_ground,
        coordinates=["a z", "b z"],
        positions={"a": (0, 0, 0), "b": (0, 0, 1)},
        **options,
    )


QUESTIONS = {
    "random": lambda s, source: mbs.random_response(s, {"base": source(PSD)}, OUT).rms,
    "sine": lambda s, source: qual.sine_response(s, ([10.0, 500.0], [1.0, 1.0]), OUT, source(None), unit="g").peaks,
    "shock": lambda s, source: (
        qual.response_spectrum(s, ([1e-6, 500.0], [1.0, 1.0]), OUT, source=source(None), unit="m/s^2").peaks
    ),
}
of_all = pytest.mark.parametrize("question", QUESTIONS.values(), ids=list(QUESTIONS))


def ground(spectrum):
    return qual.BaseAcceleration(spectrum, "z")


@of_all
def test_what_nothing_holds_is_named(question):
    with pytest.raises(ModelError, match=r"moves the ground, and nothing holds 'a' z, 'b' z to it"):
        question(pair(), ground)


@of_all
def test_a_part_that_nothing_holds_is_named(question):
    held, n = pair(ground=1e4), 3
    matrices = {name: np.pad(np.asarray(getattr(held, name)), (0, 1)) for name in ("mass", "stiffness", "damping")}
    matrices["mass"][2, 2] = 1.0
    places = {"a": (0, 0, 0), "b": (0, 0, 1), "c": (0, 0, 2)}
    lone = mbs.LinearSystem(**matrices, coordinates=["a z", "b z", "c z"], positions=places)
    assert lone.num_rows == n
    with pytest.raises(ModelError, match="nothing holds 'c' z to it"):
        question(lone, ground)


@of_all
def test_moved_coordinates_that_hold_nothing_name_the_rest(question):
    free = pair()
    lone = np.pad(np.asarray(free.stiffness), (0, 1))
    system = mbs.LinearSystem(mass=np.eye(3), stiffness=lone, coordinates=["a z", "b z", "c z"])
    with pytest.raises(ModelError, match="nothing holds 'a' z, 'b' z"):
        question(system, lambda spectrum: qual.BaseAcceleration(spectrum, {"c z": 1.0}, at="c z"))


@pytest.mark.long
@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_soft_springs_and_dashpots_to_the_ground_hold(scale):
    """In any unit: the first mass of a dead pair in parallel follows `T = k / (k - m w^2)`, far below both modes."""
    soft = pair(ground=1e-6)
    soft = mbs.LinearSystem(
        mass=scale * soft.mass, stiffness=scale * soft.stiffness, coordinates=["a z", "b z"],
        positions={"a": (0, 0, 0), "b": (0, 0, 1)},
    )  # fmt: skip
    found = qual.sine_response(soft, ([1e-6, 2e-6], [1.0, 1.0]), OUT, frequencies=[1e-6], unit="m/s^2", ratios=1e-3)
    w = 2e-6 * np.pi
    np.testing.assert_allclose(found.peaks, 1e-6 / (1e-6 - 3.0 * w**2), rtol=1e-4)
    dashed = qual.sine_response(pair(dashpot=5.0), ([1.0, 2.0], [1.0, 1.0]), OUT, frequencies=[1.0], unit="m/s^2")
    w = 2 * np.pi  # far below the mode of 87 Hz both masses move as one on the dashpot
    np.testing.assert_allclose(found.peaks > 0, True)
    np.testing.assert_allclose(dashed.peaks, abs(5j * w / (5j * w - 3.0 * w**2)), rtol=1e-3)


def test_traced_what_nothing_holds_is_not_a_number():
    free = pair()

    def rms(stiffness):
        system = mbs.LinearSystem(
            mass=free.mass, stiffness=stiffness, damping=free.damping, coordinates=["a z", "b z"],
            positions={"a": (0, 0, 0), "b": (0, 0, 1)},
        )  # fmt: skip
        return qual.sine_response(system, ([10.0, 500.0], [1.0, 1.0]), OUT, frequencies=[20.0], unit="g").peaks

    assert np.isnan(jax.jit(rms)(free.stiffness)).all()


def test_base_motion_names_what_the_interface_does_not_hold():
    stiffness = np.pad(np.asarray(pair().stiffness), (0, 1))
    lone = mbs.LinearSystem(mass=np.eye(3), stiffness=stiffness, coordinates=["a z", "b z", "c z"], interface=["c z"])
    with pytest.raises(ModelError, match="nothing holds 'a' z, 'b' z"):
        base_motion(lone, np.ones((3, 1)), 0.01)
