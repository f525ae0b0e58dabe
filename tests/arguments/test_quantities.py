"""Quantities of pint are numbers of base units at every door; what has the wrong dimension is refused."""

import numpy as np
import pytest

import jaxmbs as mbs

pint = pytest.importorskip("pint")
u = pint.UnitRegistry()


def arm(mass, com, stiffness, pivot):
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("arm", mass=mass, com=com, inertia=0.1)
    b.joint("pin", mbs.Revolute("y"), "ground", "arm", parent_frame=pivot)
    b.force(
        "spring", mbs.SpringDamper(stiffness, free_length=0.1), between=(("ground", (0, 0, 1)), ("arm", (0.3, 0, 0)))
    )
    return b.build()


@pytest.fixture(scope="module")
def systems():
    plain = arm(0.5, (0.4, 0.0, 0.0), 2e3, (0.0, 0.0, 0.2))
    zero = 0 * u.mm
    given = arm(500 * u.gram, (400 * u.mm, zero, zero), 2 * u.N / u.mm, np.array([0, 0, 20.0]) * u.cm)
    return plain, given


def test_builders_and_laws(systems):
    plain, given = systems
    for name in ("mass", "com"):
        np.testing.assert_allclose(getattr(given, name), getattr(plain, name), rtol=1e-15)
    np.testing.assert_allclose(given.forces[0].law.stiffness, 2e3, rtol=1e-15)
    np.testing.assert_allclose(given.placement.position, plain.placement.position, rtol=1e-15)


def test_verbs(systems):
    plain, given = systems
    one = mbs.simulate(plain, mbs.State.at(plain, pin=np.pi / 6), ts=np.linspace(0.0, 0.2, 5))
    two = mbs.simulate(given, mbs.State.at(given, pin=30 * u.degree), ts=np.linspace(0.0, 200.0, 5) * u.ms)
    np.testing.assert_allclose(two.states.coordinates, one.states.coordinates, atol=1e-11)
    turned = mbs.State.at(given, {"pin": 0.1 * u.turn}, velocities={"pin": 60 * u.rpm})
    np.testing.assert_allclose([turned.coordinates[0], turned.velocities[0]], [0.2 * np.pi, 2 * np.pi], rtol=1e-12)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda s: mbs.SystemBuilder().body("a", mass=2 * u.mm), r"mass = 2 millimeter has the dimension \[length\]"),
        (
            lambda s: mbs.simulate(s, mbs.State.at(s), t1=2 * u.m),
            r"t1 = 2 meter has the dimension \[length\], not \[time\]",
        ),
        (lambda s: mbs.SystemBuilder(gravity=(0, 0, -9.81 * u.N)), "gravity = -9.81 newton"),
    ],
)
def test_wrong_dimensions(systems, call, words):
    with pytest.raises(mbs.ModelError, match=words):
        call(systems[0])


def test_a_design(systems):
    found = mbs.minimise(lambda d: (d["x"] - 0.3) ** 2, {"x": 10 * u.cm}, {"x": (0 * u.m, 1 * u.m)}, progress=False)
    np.testing.assert_allclose(found.design["x"], 0.3, atol=1e-6)
