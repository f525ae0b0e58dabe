"""Friction whose load statics leaves open: named at the build and by `check`, and not where a joint frees it."""

import warnings

import pytest

import jaxmbs as mbs


def door(**numbers):
    """A door on two hinges."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("door", mass=20.0, com=(0.4, 0, 0), inertia=(1.0, 1.0, 1.0))
    for name, height in (("low", -0.5), ("high", 0.5)):
        b.joint(name, mbs.Revolute("z"), "ground", "door", parent_frame=(0, 0, height), child_frame=(0, 0, height))
    b.friction("rub low", "low", 0.1, radius=0.01, **numbers)
    return b


def test_door_on_two_hinges_is_named():
    with pytest.warns(UserWarning, match=r"joint 'low': .* load open \(force x, force y\).*low, high"):
        system = door().build()
    assert "friction of joint 'low': redundant constraints leave its load open" in mbs.check(system)
    with pytest.warns(UserWarning, match=r"force x, force y, force z, moment x, moment y\)"):
        door(length=0.05).build()


def test_door_whose_load_is_determined_is_not():
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("door", mass=20.0, com=(0.4, 0, 0), inertia=(1.0, 1.0, 1.0))
    b.joint("low", mbs.joints.Spherical(), "ground", "door", parent_frame=(0, 0, -0.5), child_frame=(0, 0, -0.5))
    b.constraint("high", mbs.joints.PointOnLine(), between=(("ground", (0, 0, 0.5)), ("door", (0, 0, 0.5))))
    b.friction("rub", "low", 0.1, radius=0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        system = b.build()
    assert "load open" not in mbs.check(system)
