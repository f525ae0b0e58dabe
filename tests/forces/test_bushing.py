"""Bushing: the wrench is the gradient of the potential on the group of poses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.forces import Bushing
from jaxmbs.math._rotation import rotation_matrix
from tests.marks import cases

_ROOT = np.roll(np.random.default_rng(3).normal(size=(6, 6)), 3, axis=(0, 1))
FULL = Bushing(_ROOT @ _ROOT.T, damping=0.1 * _ROOT.T @ _ROOT, preload=[3.0, 0.0, -1.0, 1.0, -2.0, 0.5])
REST = jnp.zeros(3)
VECTORS = {
    "zero": (0.0, 0.0, 0.0),
    "tiny": (1e-9, 0.0, 2e-9),
    "small": (0.1, -0.15, 0.05),
    "series": (0.2, 0.0, 0.0),
}
VECTORS |= {"medium": (0.9, -0.4, 1.1), "large": (-1.8, 1.9, 1.2)}


@jax.jit
def at_rest(law, rotation, displacement):
    return jnp.concatenate(law.wrench(rotation, displacement, REST, REST, 0.0))


@jax.jit
def perturbed_energy(law, vector, displacement, step):
    """Energy after a small translation step[:3] of B and rotation step[3:] about A axes."""
    rotation = rotation_matrix(step[3:]) @ rotation_matrix(vector)
    return law.potential(rotation, displacement + step[:3], 0.0)


gradient_of_energy = jax.jit(jax.grad(perturbed_energy, 3))


@pytest.mark.parametrize("name", cases(VECTORS, long=["zero", "tiny", "small"]))
def test_wrench_is_minus_the_gradient_of_the_potential(name):
    vector = jnp.array(VECTORS[name])
    displacement = jnp.array([0.2, -0.1, 0.4])
    wrench = at_rest(FULL, rotation_matrix(vector), displacement)
    exact = gradient_of_energy(FULL, vector, displacement, jnp.zeros(6))
    np.testing.assert_allclose(wrench, -exact, rtol=1e-10, atol=1e-10)
    h = 1e-5
    ends = [[perturbed_energy(FULL, vector, displacement, s * h * row) for s in (1, -1)] for row in jnp.eye(6)]
    np.testing.assert_allclose(wrench, [-(a - b) / (2 * h) for a, b in ends], rtol=1e-7, atol=1e-7)


def test_stiffness_at_zero_is_the_matrix():
    law = Bushing(FULL.stiffness)
    stiffness = jax.jit(jax.jacfwd(lambda s: -at_rest(law, rotation_matrix(s[3:]), s[:3])))(jnp.zeros(6))
    np.testing.assert_allclose(stiffness, law.stiffness, rtol=1e-12, atol=1e-12)


@jax.jit
def moving_wrench(s, law):
    return jnp.concatenate(law.wrench(rotation_matrix(s[:3]), s[3:], 0.3 * s[:3], s[3:], 0.0))


@jax.jit
def slopes_of_wrench(s, law):
    """By the pose, by the law's numbers, and the second one by the pose."""
    second = jax.hessian(lambda s: moving_wrench(s, law).sum())(s)
    return jax.jacrev(moving_wrench)(s, law), jax.jacfwd(moving_wrench, 1)(s, law), second


@pytest.mark.long
@pytest.mark.parametrize("vector", [jnp.array(v) for v in VECTORS.values()], ids=VECTORS)
def test_derivatives_are_finite_and_right(vector):
    h, pose = 1e-6, np.r_[np.asarray(vector), 0.2, -0.1, 0.4]
    slope, law_slopes, second = slopes_of_wrench(pose, FULL)
    ends = [
        np.subtract(moving_wrench(pose + h * row, FULL), moving_wrench(pose - h * row, FULL)) / (2 * h)
        for row in np.eye(6)
    ]
    np.testing.assert_allclose(slope, np.stack(ends, axis=1), rtol=1e-6, atol=1e-6)
    changed = jax.tree.map(lambda leaf: leaf * (1 + h), FULL)
    expected = sum(
        np.tensordot(d, leaf, leaf.ndim)
        for d, leaf in zip(jax.tree.leaves(law_slopes), jax.tree.leaves(FULL), strict=True)
    )
    found = np.subtract(moving_wrench(pose, changed), moving_wrench(pose, FULL)) / h
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    assert np.isfinite(second).all()


@pytest.mark.long
def test_damping_dissipates():
    twists = jax.random.normal(jax.random.key(1), (50, 6))
    law = Bushing(damping=FULL.damping)
    power = jax.vmap(lambda w: w @ jnp.concatenate(law.wrench(jnp.eye(3), REST, w[3:], w[:3], 0.0)))(twists)
    assert power.max() <= 0.0


def test_forms_of_stiffness_agree():
    pair, diagonal = Bushing((2.0, 5.0)), Bushing([2.0] * 3 + [5.0] * 3)
    np.testing.assert_array_equal(pair.stiffness, diagonal.stiffness)
    np.testing.assert_array_equal(Bushing(np.diag([2.0] * 3 + [5.0] * 3)).stiffness, pair.stiffness)
    vector = jnp.array([0.3, -1.0, 0.8])
    wrench = at_rest(Bushing((0.0, 2.0)), rotation_matrix(vector), jnp.ones(3))
    np.testing.assert_allclose(wrench, jnp.concatenate([REST, -2.0 * vector]), atol=1e-14)
    with pytest.raises(ValueError):
        Bushing(jnp.ones(3))


def test_stacking_and_tracing():
    laws = [FULL, jax.tree.map(lambda leaf: 2 * leaf, FULL)]
    stack = jax.tree.map(lambda *leaves: jnp.stack(leaves), *laws)
    rotation = rotation_matrix(jnp.array([0.3, 0.2, 0.1]))
    together = jax.vmap(lambda law: at_rest(law, rotation, jnp.ones(3)))(stack)
    np.testing.assert_allclose(together[1], 2 * together[0], rtol=1e-13)
    slope = jax.jit(jax.grad(lambda k: at_rest(Bushing((2.0 * k, k)), rotation, jnp.ones(3)).sum()))(3.0)
    np.testing.assert_allclose(slope, -6.6, rtol=1e-12)


def test_faults():
    assert FULL.faults() == []
    assert "stiffness matrix must be symmetric" in Bushing(np.arange(36.0).reshape(6, 6)).faults()
    assert "damping matrix must be positive semidefinite" in Bushing(damping=(-1.0, 1.0)).faults()
