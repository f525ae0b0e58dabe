"""Modes without cyclic coordinates: a sprung pendulum on a free slide, and a rotor that spins."""

import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import OnCart


@pytest.mark.slow
def test_a_pendulum_on_a_free_cart_in_closed_form():
    """Free in x: the cart's momentum stays, and the pendulum swings against the reduced mass (Routh)."""
    cart = OnCart()
    system = cart.build()
    lin = mbs.linearise(system, mbs.State.at(system))
    every, swing = mbs.modes(lin), mbs.modes(lin, without=["slide"])
    M, K = np.asarray(lin.mass), np.asarray(lin.stiffness)
    k, m = K[1, 1], M[1, 1] - M[0, 1] ** 2 / M[0, 0]
    assert every.values.shape == (4,) and swing.values.shape == (2,)
    np.testing.assert_allclose(swing.omega, np.sqrt(k / m), rtol=1e-9)
    np.testing.assert_allclose(np.sort(np.abs(every.roots))[2:], np.sqrt(k / m), rtol=1e-6)


@pytest.mark.slow
def test_the_spin_of_a_rotor_is_left_out():
    """A pendulum on a turning shaft: rotor and pendulum, roots against those of all modes without the two zeros."""
    b = mbs.SystemBuilder()
    b.body("shaft", 1.0, inertia=(0.3, 0.3, 0.5))
    b.body("bob", 1.0, (0.0, 0.0, -0.4), 0.01)
    b.joint("spin", mbs.Revolute("z"), "ground", "shaft")
    b.joint("swing", mbs.Revolute("y"), "shaft", "bob", parent_frame=(0.1, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(2.0), joint="swing")
    system = b.build()
    spinning = mbs.State.at(system, swing=_steady(system), velocities={"spin": 4.0})
    lin = mbs.linearise(system, spinning)
    every, left = mbs.modes(lin), mbs.modes(lin, without=["spin"])
    size = np.sort(np.abs(every.roots))
    assert size[1] < 1e-4 * size[2]
    np.testing.assert_allclose(np.sort(np.abs(left.roots)), size[2:], rtol=1e-6)


def _steady(system):
    """The angle at which the bob neither rises nor falls at 4 rad/s."""
    from scipy.optimize import brentq

    def rises(angle):
        state = mbs.State.at(system, swing=angle, velocities={"spin": 4.0})
        return float(mbs.forward_dynamics(system, state)[0][system.columns("swing")[0]])

    return brentq(rises, -1.0, 1.0, xtol=1e-13)


@pytest.mark.slow
def test_what_is_not_cyclic_is_said():
    cart = OnCart()
    system = cart.build()
    lin = mbs.linearise(system, mbs.State.at(system))
    pendulum = next(name for name in lin.names if name != "slide")
    with pytest.raises(mbs.ModelError, match="not a cyclic coordinate"):
        mbs.modes(lin, without=[pendulum])
    with pytest.raises(mbs.UnknownNameError, match="slide"):
        mbs.modes(lin, without=["slid"])
