"""A design under a limit on a load over the cycle: the least counterweight of a wheel, in closed form."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

UNBALANCE, SPEED, MOST = 0.12, 30.0, 40.0  # [kg m], [rad/s], [N]


def wheel(counterweight, like=None):
    """A wheel under a motor without load; the counterweight is mass times radius [kg m]."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("wheel", 3.0, ((UNBALANCE - counterweight) / 3.0, 0.0, 0.0), 0.05)
    b.joint("shaft", mbs.Revolute("z"), "ground", "wheel")
    b.force("motor", mbs.Actuator(lambda angle, speed, t: 0.5 * (SPEED - speed)), joint="shaft")
    return b.build(like=like)


@pytest.mark.long
def test_limit_on_a_load_over_the_cycle():
    """It turns evenly, so that the bearing carries what is left of the unbalance times the square of the speed."""
    like = wheel(0.0)
    start = mbs.State.at(like, velocities={"shaft": 28.0})

    def load(design):
        system = wheel(design["counterweight"], like)
        cycle = mbs.periodic(system, 0.2, start, free="period", turns={"shaft": 1}, steps=24, throw=False)
        force = mbs.reactions(system, cycle)["shaft"].force
        return jnp.max(jnp.sqrt(jnp.sum(force**2, axis=1)))

    limit = mbs.Limit("bearing", load, upper=MOST)
    bounds = {"counterweight": (0.0, 0.11)}
    found = mbs.minimise(
        lambda d: d["counterweight"], {"counterweight": 0.02}, bounds, limits=[limit], progress=False
    )
    np.testing.assert_allclose(found.design["counterweight"], UNBALANCE - MOST / SPEED**2, rtol=1e-6)
    assert found.limit("bearing").active
    np.testing.assert_allclose(abs(found.limit("bearing").price), 1.0 / SPEED**2, rtol=1e-4)
