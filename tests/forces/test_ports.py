"""Ports between frames that move: the flow is the rate of the displacement, the wrenches do the power of the port."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.forces._frame_motion import FrameMotion
from jaxmbs.forces._ports import LinePort, PosePort
from jaxmbs.math._linalg import skew
from jaxmbs.math._rotation import rotation_matrix

RANDOM = np.random.default_rng(3)
PORTS = [LinePort(), PosePort()]


def end():
    """A frame that turns and moves."""
    turn, place, twist = (jnp.array(RANDOM.normal(size=n)) for n in (3, 3, 6))
    return FrameMotion(rotation_matrix(turn), place, twist)


def moved(a, b, t):
    """The two frames a little later: R' = spin x R, x' = velocity."""
    return [FrameMotion(e.R + t * skew(e.spin) @ e.R, e.x + t * e.velocity, e.V) for e in (a, b)]


@pytest.mark.parametrize("port", PORTS, ids=lambda port: type(port).__name__)
def test_the_flow_is_the_rate_of_the_displacement(port):
    a, b = end(), end()
    displacement, rate = jax.jvp(lambda t: port.displacement(*moved(a, b, t)), (0.0,), (1.0,))
    found = port.rate(displacement, port.flow(a, b))
    for one, other in zip(found, rate, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-13)


@pytest.mark.parametrize("port", PORTS, ids=lambda port: type(port).__name__)
def test_wrenches_do_the_power_of_effort_and_flow(port):
    a, b = end(), end()
    flow = port.flow(a, b)
    on_the_line = isinstance(port, LinePort)
    effort = 1.7 * (b.x - a.x) if on_the_line else jnp.array(RANDOM.normal(size=flow.shape))
    on_a, on_b = port.wrench(a, b, effort)
    np.testing.assert_allclose(on_a @ a.V + on_b @ b.V, effort @ flow, rtol=1e-13)
    np.testing.assert_allclose(on_a + on_b, 0.0, atol=1e-15)  # forces and moments of the pair about the origin
