"""Loads of a contact by their formulas: depth, forces, pressure, pressure times speed, wear."""

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import Contact, HuntCrossley, JournalInBush, SphereOnPlane

K, A, MU, WEAR, RADIUS = 1e7, 0.4, 0.3, 2e-15, 0.05


def model(pair, **options):
    b = mbs.SystemBuilder()
    b.body("part", 1.0, inertia=1e-3)
    b.joint("part", mbs.Free(), "ground", "part")
    b.contact("touch", pair, "part", "ground", HuntCrossley(K, 1.5, A), mbs.friction.SmoothCoulomb(MU), **options)
    return b.build()


@pytest.mark.slow
def test_a_sliding_ball():
    system, depth = model(SphereOnPlane(RADIUS), wear=WEAR), 1e-4
    state = mbs.State.at(
        system, {"part": (0.0, 0.0, RADIUS - depth, 1.0, 0.0, 0.0, 0.0)}, {"part": (0.3, 0.4, -0.02, 0.0, 0.0, 0.0)}
    )
    found = mbs.dynamics.contact_load(system, state, "touch")
    sliding = np.asarray(found.sliding[0])
    speed = np.hypot(*sliding[:2])
    np.testing.assert_allclose([speed, sliding[2], found.rate[0]], [0.5, 0.0, 0.02], atol=1e-12)
    normal = K * depth**1.5 * (1.0 + A * 0.02)
    np.testing.assert_allclose(found.depth, depth, rtol=1e-10)
    np.testing.assert_allclose(found.normal_force, normal, rtol=1e-9)
    np.testing.assert_allclose(found.friction[0], -MU * normal * sliding / speed, rtol=1e-9, atol=1e-12)
    pressure = normal / (np.pi * RADIUS * depth)
    np.testing.assert_allclose(found.pressure, pressure, rtol=1e-9)
    np.testing.assert_allclose(found.pressure_speed, 0.5 * pressure, rtol=1e-9)
    np.testing.assert_allclose(found.wear_rate, WEAR * normal * 0.5, rtol=1e-9)


def test_a_turning_journal_and_one_apart():
    """A journal rubs at its radius; apart all loads are zero."""
    pair = JournalInBush(0.01, 1e-3, 0.02, sections=1)
    system, depth = model(pair, wear=WEAR), 1e-4
    velocities = {"part": (0.0, 0.0, 0.0, 0.0, 0.0, 50.0)}
    pressed = mbs.State.at(system, {"part": (1e-3 + depth, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)}, velocities)
    found = mbs.dynamics.contact_load(system, pressed, "touch")
    speed, normal = 50.0 * (0.01 - depth / 2), K * depth**1.5
    np.testing.assert_allclose(np.linalg.norm(found.sliding[0]), speed, rtol=1e-9)
    np.testing.assert_allclose(found.pressure_speed, normal / (2 * 0.01 * 0.02) * speed, rtol=1e-8)
    np.testing.assert_allclose(found.wear_rate, WEAR * normal * speed, rtol=1e-8)
    apart = mbs.State.at(system, {"part": (5e-4, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)}, velocities)
    found = mbs.dynamics.contact_load(system, apart, "touch")
    assert found.depth[0] < 0.0
    for name in ("normal_force", "friction", "pressure", "pressure_speed", "wear_rate"):
        np.testing.assert_array_equal(getattr(found, name), 0.0)


def test_another_name():
    system = model(SphereOnPlane(RADIUS))
    with pytest.raises(mbs.ModelError, match="there is no contact 'tip'; there are: touch"):
        mbs.dynamics.contact_load(system, mbs.State.at(system), "tip")
    assert isinstance(system.forces[0].law, Contact)
