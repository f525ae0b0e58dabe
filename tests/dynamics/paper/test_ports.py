"""Resistance fields of elements whose own matrix is not symmetric, as that of a bearing's oil film."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import dynamics
from tests.models import OnCart, slopes

FILM = np.array([[30.0, 12.0, 0.0], [-7.0, 25.0, 0.0], [0.0, 0.0, 1.0]])


class Film(mbs.forces.AbstractPoseLaw):
    """What it resists along x depends on the speed along y in another way than the reverse."""

    damping: jax.Array

    def wrench(self, rotation, displacement, angular_velocity, velocity, t):
        return -self.damping @ velocity, jnp.zeros(3)


@pytest.mark.slow
def test_the_field_is_as_unsymmetric_as_its_elements():
    """A point of a pendulum on a cart: R = G^T R_i G with G by differences, e_R = -R phi_dot, and its power."""
    hand, point, phi, phi_dot = OnCart(), (0.05, -0.4, 0.0), np.array([0.3, 0.6]), np.array([1.1, -2.0])
    where = {"between": ("ground", ("bob", point))}
    system = hand.build(forces=[("film", Film(jnp.asarray(FILM)), where)])
    state = mbs.State.at(system, slide=phi[0], swing=phi[1], velocities={"slide": phi_dot[0], "swing": phi_dot[1]})
    G = slopes(lambda phi: hand.place(phi, point), phi)
    R = G.T @ FILM @ G
    assert np.max(np.abs(R - R.T)) > 1.0
    np.testing.assert_allclose(dynamics.resistance_field(system, state), R, rtol=1e-9)
    np.testing.assert_allclose(dynamics.resistance_effort(system, state), -R @ phi_dot, rtol=1e-9)
    v = G @ phi_dot
    np.testing.assert_allclose(dynamics.resistance_effort(system, state) @ phi_dot, -v @ FILM @ v, rtol=1e-9)
