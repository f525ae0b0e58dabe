"""A bound on adaptive steps: a pulse that steps of a mass at rest pass over is met."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs


def pushed():
    """A mass of 2 kg with a pulse of 0.3 N s, a bell of 4 ms, after five seconds."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", 2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "mass")
    bell = lambda x, v, t: 0.3 / (0.002 * jnp.sqrt(jnp.pi)) * jnp.exp(-(((t - 5.0) / 0.002) ** 2))
    b.force("pulse", mbs.Actuator(bell), joint="x")
    return b.build()


def test_a_short_pulse_is_met():
    system = pushed()
    start = mbs.State.at(system)
    found = mbs.simulate(system, start, ts=[7.7], longest_step=0.003)
    np.testing.assert_allclose(found.end.velocities, 0.3 / 2.0, rtol=1e-8)
    assert int(found.diagnostics.num_steps) >= 7.7 / 0.003


def test_wrong_bounds_are_refused():
    system = pushed()
    start = mbs.State.at(system)
    for match, given in {
        "positive": {"longest_step": -1.0},
        "one positive number": {"longest_step": [0.1, 0.2]},
        "leave dt=": {"longest_step": 0.1, "dt": 0.1},
    }.items():
        with pytest.raises((ValueError, mbs.ModelError), match=match):
            mbs.simulate(system, start, t1=1.0, **given)
