"""Numbers far out of a model's own scale are said in one line; no machine of the zoo is doubted."""

import warnings

import pytest

import jaxmbs as mbs
from jaxmbs.model._scale import scale_lines
from tests.zoo import of_all


def arm(height=0.2, amplitude=0.6, com=0.4, mass=5.0, more=0.5):
    """The machine of README, with a payload."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("arm", mass=mass, com=(com, 0, 0), inertia=mbs.inertia.rod(mass, 0.8))
    b.body("payload", mass=more, com=(0.05, 0, 0), inertia=1e-3)
    b.joint("shoulder", mbs.Revolute("y"), "ground", "arm", drive=mbs.Harmonic(amplitude=amplitude))
    b.joint("grip", mbs.Weld(), "arm", "payload", parent_frame=(0.8, 0, 0))
    b.force(
        "spring", mbs.SpringDamper(200.0, free_length=0.1), between=(("ground", (0, 0, height)), ("arm", (0.3, 0, 0)))
    )
    return b.build()


@pytest.mark.parametrize(
    "numbers, words",
    [
        ({"height": 200.0}, "is 200 m, 250 times the next largest length: is it in millimetres"),
        ({"com": 400.0}, "centre of mass of body 'arm' is 400 m"),
        ({"amplitude": 34.0}, "the drive of joint 'shoulder' swings by 34 rad: angles are in radians"),
    ],
)
def test_slips_are_said(numbers, words):
    with pytest.warns(UserWarning, match=words):
        system = arm(**numbers)
    assert words in system.describe() and words in "".join(system.doubts())


@pytest.mark.parametrize(
    "numbers", [{"height": 200.0}, {"com": 400.0}, {"eye": 300.0}, {"free": 100.0}, {"height": 200.0, "free": 0.0}]
)
def test_a_length_in_millimetres_in_a_model_of_one_body(numbers):
    def build(height=0.2, com=0.4, eye=0.3, free=0.1):
        b = mbs.SystemBuilder()
        b.body("arm", mass=5.0, com=(com, 0, 0), inertia=mbs.inertia.rod(5.0, 0.8))
        b.joint("shoulder", mbs.Revolute("y"), "ground", "arm")
        places = ("ground", (0, 0, height)), ("arm", (eye, 0, 0))
        b.force("spring", mbs.SpringDamper(200.0, free_length=free), between=places)
        return b.build()

    with pytest.warns(UserWarning, match="times the next largest length: is it in millimetres"):
        build(**numbers)
    assert build().doubts() == []


def test_degrees_of_a_start():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.4, 0, 0))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    system = b.build()
    with pytest.warns(UserWarning, match="put at 10 rad, 1.6 turns; angles are in radians"):
        mbs.State.at(system, pin=10.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mbs.State.at(system, pin=7.3)
        mbs.State.at(system, pin=5.0)


def test_a_machine_as_it_is_meant():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert arm().doubts() == []
        arm(height=20.0)  # a hoist on a wall


def test_masses_in_grams():
    b = mbs.SystemBuilder()
    for k, mass in enumerate([0.2, 0.3, 0.25, 40_000.0]):
        b.body(f"b{k}", mass=mass, inertia=1e-3)
        b.joint(f"j{k}", mbs.Revolute("y"), "ground" if k == 0 else f"b{k - 1}", f"b{k}", parent_frame=(0.1, 0, 0))
    with pytest.warns(UserWarning, match="mass of body 'b3' is 4e\\+04 kg, 1.333e\\+05 times"):
        b.build()


@of_all()
def test_no_machine_of_the_zoo_is_doubted(specimen):
    assert scale_lines(specimen.system) == []
