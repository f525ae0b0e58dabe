"""Beam element: its wrench is the gradient of its energy; a helix is exact; small loads give the beam's matrix."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.forces import BeamElement, BeamSection
from jaxmbs.math._rotation import rotation_matrix

SECTION = BeamSection([900.0, 300.0, 350.0, 2.0, 3.0, 4.0], 1.0, [0.02, 0.01, 0.01])
LENGTH = 0.7
LAW = BeamElement(SECTION.element_stiffness(jnp.array(LENGTH)), [LENGTH, 0, 0, 0, 0, 0])
STILL = jnp.zeros(3)


@jax.jit
def energy(law, vector, d, step):
    return law.potential(rotation_matrix(step[3:]) @ rotation_matrix(vector), d + step[:3], 0.0)


@pytest.mark.long
def test_wrench_is_minus_the_gradient_of_the_energy():
    vector, d = jnp.array([0.4, -0.9, 1.1]), jnp.array([0.6, 0.2, -0.1])
    wrench = jnp.concatenate(jax.jit(BeamElement.wrench)(LAW, rotation_matrix(vector), d, STILL, STILL, 0.0))
    h = 1e-5
    ends = [[energy(LAW, vector, d, s * h * row) for s in (1, -1)] for row in jnp.eye(6)]
    np.testing.assert_allclose(wrench, [-(a - b) / (2 * h) for a, b in ends], rtol=1e-7, atol=1e-6)


@pytest.mark.long
def test_constant_bending_is_exact():
    """Half a turn but a little, by one element: the moment is E I curvature, without a force."""
    angle = 3.0
    d = LENGTH * jnp.array([jnp.sin(angle), 1 - jnp.cos(angle), 0.0]) / angle
    force, moment = LAW.wrench(rotation_matrix(jnp.array([0.0, 0.0, angle])), d, STILL, STILL, 0.0)
    np.testing.assert_allclose(force, 0.0, atol=1e-12)
    np.testing.assert_allclose(moment, [0, 0, -4.0 * angle / LENGTH], rtol=1e-12, atol=1e-12)


@pytest.mark.long
def test_a_cantilever_of_one_element_is_exact_for_small_loads():
    """Tip stiffness: `P l^3 / (3 E I) + P l / G A` under a force, slope `P l^2 / (2 E I)`."""
    K = jax.jacfwd(lambda s: -jnp.concatenate(LAW.wrench(rotation_matrix(s[3:]), s[:3] + d, STILL, STILL, 0.0)))
    d = jnp.array([LENGTH, 0.0, 0.0])
    flexibility = np.linalg.inv(K(jnp.zeros(6)))
    np.testing.assert_allclose(flexibility[1, 1], LENGTH**3 / 12 + LENGTH / 300, rtol=1e-10)
    np.testing.assert_allclose(flexibility[5, 1], LENGTH**2 / 8, rtol=1e-10)
    np.testing.assert_allclose(flexibility[2, 2], LENGTH**3 / 9 + LENGTH / 350, rtol=1e-10)
    np.testing.assert_allclose(flexibility[0, 0], LENGTH / 900, rtol=1e-10)
    np.testing.assert_allclose(flexibility[3, 3], LENGTH / 2, rtol=1e-10)


@pytest.mark.long
def test_damping_dissipates():
    law = BeamElement(LAW.stiffness, LAW.screw, damping=0.01)
    assert law.dissipates and not LAW.dissipates
    w, v = jnp.array([0.3, -0.2, 0.5]), jnp.array([0.1, 0.4, -0.2])
    R, d = rotation_matrix(jnp.array([0.2, 0.5, -0.3])), jnp.array([0.6, 0.1, 0.2])
    both = [one.wrench(R, d, w, v, 0.0) for one in (law, LAW)]
    power = (both[0][0] - both[1][0]) @ v + (both[0][1] - both[1][1]) @ w
    assert power < -1e-4


def test_faults():
    found = BeamElement(-LAW.stiffness, np.zeros(6), damping=-1.0).faults()
    assert len(found) == 3 and "positive definite" in found[0] and "length" in found[1] and "damping" in found[2]
    assert not LAW.faults()
