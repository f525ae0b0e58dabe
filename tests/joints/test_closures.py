"""Constraints between two frames: the units of their multipliers."""

import numpy as np
import pytest

import jaxmbs as mbs


@pytest.mark.slow
def test_the_multiplier_of_a_rod_is_its_force():
    """A mass that swings on a rod: the rod pulls with `m (g cos x + v^2 / l)`, and positive would push."""
    mass, length, angle, speed = 2.0, 0.9, 0.4, 1.3
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("carrier", mass=0.0)
    b.body("bob", mass=mass)
    b.joint("x", mbs.Prismatic("x"), "ground", "carrier")
    b.joint("z", mbs.Prismatic("z"), "carrier", "bob")
    b.constraint("rod", mbs.joints.Distance(length), between=("ground", "bob"))
    system = b.build(independent=["x"])
    place = {"x": length * np.sin(angle)}
    state = mbs.State.at(system, place, velocities={"x": speed * np.cos(angle)}, guess={"z": -0.8})
    _, multipliers = mbs.forward_dynamics(system, state)
    pull = mass * (9.81 * np.cos(angle) + speed**2 / length)
    np.testing.assert_allclose(multipliers, [-pull], rtol=1e-9)
