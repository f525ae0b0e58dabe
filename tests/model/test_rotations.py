"""Rotations from one form to another, beside SciPy's, and as the state of a ball takes them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs import rotations

#: Random ones, none at all, small ones, half a turn about axes and between them, and nearly so.
VECTORS = np.concatenate(
    [
        np.random.default_rng(3).normal(size=(20, 3)),
        np.zeros((1, 3)),
        1e-9 * np.eye(3),
        np.pi * np.eye(3),
        np.pi * (1 - 1e-9) * np.array([[0.6, 0.0, 0.8], [-0.6, 0.8, 0.0]]),
    ]
)
SCIPY = Rotation.from_rotvec(VECTORS)


@pytest.mark.slow
def test_forms_agree_with_scipy():
    matrices = SCIPY.as_matrix()
    np.testing.assert_allclose(rotations.from_vector(VECTORS), matrices, atol=1e-12)
    np.testing.assert_allclose(
        rotations.from_quaternion(3.0 * SCIPY.as_quat(scalar_first=True)), matrices, atol=1e-12
    )
    q = np.asarray(rotations.to_quaternion(matrices))
    wanted = SCIPY.as_quat(scalar_first=True)
    np.testing.assert_allclose(rotations.from_quaternion(3.0 * wanted), matrices, atol=1e-12)
    np.testing.assert_allclose(q * np.sign(np.sum(q * wanted, axis=1, keepdims=True)), wanted, atol=1e-12)
    assert np.all(q[:, 0] >= 0)
    back = Rotation.from_rotvec(np.array(rotations.to_vector(matrices)))
    np.testing.assert_allclose(back.as_matrix(), matrices, atol=1e-8)
    angles = np.linspace(-4.0, 4.0, 9)
    for axis, number in (("x", (1, 0, 0)), ("-z", (0, 0, -1)), ((0.0, 2.0, 1.0), (0, 2, 1))):
        unit = np.array(number) / np.linalg.norm(number)
        wanted = Rotation.from_rotvec(angles[:, None] * unit).as_matrix()
        np.testing.assert_allclose(rotations.from_axis_angle(axis, angles), wanted, atol=1e-12)


@jax.jit
def slopes(vector):
    """Slopes of the way to quaternions and back, forward and reverse, of the matrix, and matrices to both sides."""

    def through(v):
        q = rotations.to_quaternion(rotations.from_vector(v))
        return rotations.to_vector(rotations.from_quaternion(2.0 * q))  # v again

    steps = vector[None, None] + 1e-6 * jnp.stack([jnp.eye(3), -jnp.eye(3)])
    slope = jax.jacrev(rotations.from_vector)(vector)
    return jax.jacfwd(through)(vector), jax.jacrev(through)(vector), slope, rotations.from_vector(steps)


@pytest.mark.slow
@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (0.3, -0.2, 1.0), (0.0, 3.0, 0.5)])
def test_derivatives_are_those_of_differences(vector):
    forward, reverse, slope, turned = slopes(jnp.array(vector))
    np.testing.assert_allclose(forward, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(reverse, np.eye(3), atol=1e-9)
    ahead, behind = turned
    np.testing.assert_allclose(slope, np.moveaxis(ahead - behind, 0, -1) / 2e-6, atol=1e-9)


@pytest.mark.slow
def test_a_ball_takes_the_quaternion_of_a_rotation():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.5, 0, 0), inertia=0.1)
    b.joint("ball", mbs.Spherical(), "ground", "arm")
    system = b.build()
    wanted = rotations.from_axis_angle((1.0, 1.0, 0.0), 2.5)
    state = mbs.State.at(system, ball=rotations.to_quaternion(wanted))
    found = mbs.rotation(system, state, "arm")
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    np.testing.assert_allclose(rotations.to_quaternion(found), system.coordinates(state)["ball"], atol=1e-12)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: rotations.from_quaternion(np.zeros(4)), "length zero"),
        (lambda: rotations.from_quaternion(np.ones(3)), r"\(..., 4\), not \(3,\)"),
        (lambda: rotations.from_vector([0.0, np.nan, 0.0]), "finite"),
        (lambda: rotations.from_axis_angle((0, 0, 0), 1.0), "no direction"),
        (lambda: rotations.from_axis_angle("w", 1.0), "not one of x, y, z"),
        (lambda: rotations.to_quaternion(2.0 * np.eye(3)), "not a rotation matrix"),
        (lambda: rotations.to_vector(np.diag([1.0, 1.0, -1.0])), "not a rotation matrix"),
        (lambda: rotations.to_vector(np.ones(9)), r"\(..., 3, 3\)"),
        (lambda: mbs.Pose((0, 0, 0), (1, 0, 0, 0)), "mbs.rotations"),
    ],
)
def test_what_is_no_rotation_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()
