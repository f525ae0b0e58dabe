"""Beam section: of a material, flexibility, faults."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxmbs.forces import BeamSection


def test_section_of_a_material():
    b, h = 0.02, 0.05
    section = BeamSection.of_material(2e11, 8e10, 7850.0, b * h, h * b**3 / 12, b * h**3 / 12)
    np.testing.assert_allclose(section.stiffness[:3], [2e8, 8e7 * 5 / 6, 8e7 * 5 / 6])
    np.testing.assert_allclose(section.stiffness[4:], [2e11 * h * b**3 / 12, 2e11 * b * h**3 / 12])
    np.testing.assert_allclose(section.inertia[0], section.inertia[1] + section.inertia[2])
    np.testing.assert_allclose(section.mass, 7.85)
    assert not section.faults()


def test_stiffness_of_an_element_has_the_derivative_by_its_length():
    stiffness = jnp.diag(jnp.array([900.0, 300.0, 350.0, 2.0, 3.0, 4.0])).at[3, 4].set(0.5).at[4, 3].set(0.5)
    section = BeamSection(stiffness, 1.0, [0.02, 0.01, 0.01])
    of_length = jax.jit(lambda l: section.element_stiffness(l))
    slope = jax.jit(jax.jacfwd(of_length))(0.7)
    np.testing.assert_allclose(slope, (of_length(0.7 + 1e-5) - of_length(0.7 - 1e-5)) / 2e-5, rtol=1e-6, atol=1e-4)


def test_rigid_shears_are_infinite():
    """Without shear the flexibility of the force is that of bending alone."""
    section = BeamSection([900.0, np.inf, np.inf, 2.0, 3.0, 4.0], 1.0, [0.02, 0.01, 0.01])
    K = section.element_stiffness(jnp.array(0.7))
    np.testing.assert_allclose(K[1, 1], 12 * 4.0 / 0.7**3, rtol=1e-10)
    assert not section.faults()


def test_faults():
    found = BeamSection([900.0, 300.0, 350.0, 2.0, -3.0, 4.0], 0.0, [0.02, 0.01, 0.0], damping=-1.0).faults()
    assert len(found) == 4
