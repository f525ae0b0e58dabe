"""Rotations against SciPy, and their derivatives against central differences, at 0 and near pi above all."""

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from scipy.spatial.transform import Rotation

from jaxmbs.math import _rotation as rotation

_DIRECTIONS = [np.array(d, float) for d in [(1, 0, 0), (0, -1, 0), (0, 0, 1), (-0.8, 0.6, 0)]]
_SLANTED = np.array([1.0, -2.0, 3.0]) / np.sqrt(14.0)
_ANGLES = [0.0, 1e-9, 1e-4, 0.19, 0.21, 0.64, 1.5, 3.0, np.pi - 1e-6]
_VECTORS = [angle * direction for angle in _ANGLES for direction in [*_DIRECTIONS, _SLANTED]]


def _differences(function, x, step=1e-6):
    points = x[None, :] + step * jnp.concatenate([jnp.eye(len(x)), -jnp.eye(len(x))])
    ahead, behind = jnp.split(jax.vmap(function)(points), 2)
    return jnp.moveaxis((ahead - behind) / (2 * step), 0, -1)


def _derivatives(function):
    """First derivative forward, reverse and by differences; second derivative, and by differences."""

    def all_of_them(x):
        forward, reverse = jax.jacfwd(function), jax.jacrev(function)
        first = forward(x), reverse(x), _differences(function, x)
        return *first, jax.jacfwd(reverse)(x), _differences(forward, x)

    return all_of_them


def _batch(function, *arguments):
    return jax.jit(jax.vmap(function))(*(jnp.array(a) for a in arguments))


def test_matrices_and_quaternions_agree_with_scipy():
    oracle = Rotation.from_rotvec(_VECTORS)
    np.testing.assert_allclose(_batch(rotation.rotation_matrix, _VECTORS), oracle.as_matrix(), atol=1e-14)
    expected = oracle.as_quat(canonical=True, scalar_first=True)
    np.testing.assert_allclose(_batch(rotation.quaternion_exp, _VECTORS), expected, atol=1e-14)
    np.testing.assert_allclose(_batch(rotation.matrix_quaternion, oracle.as_matrix()), expected, atol=1e-9)


def test_rotation_vector_inverts_rotation_matrix():
    matrices = _batch(rotation.rotation_matrix, _VECTORS)
    np.testing.assert_allclose(_batch(rotation.rotation_vector, matrices), _VECTORS, atol=2e-15, rtol=1e-13)


@pytest.mark.long
def test_log_at_exactly_pi():
    matrices = [2 * np.outer(direction, direction) - np.eye(3) for direction in _DIRECTIONS]
    vectors = _batch(rotation.rotation_vector, matrices)
    np.testing.assert_allclose(np.abs(vectors), np.pi * np.abs(_DIRECTIONS), atol=1e-14)
    assert np.all(np.isfinite(_batch(jax.jacfwd(rotation.rotation_vector), matrices)))
    assert np.all(np.isfinite(_batch(jax.jacrev(rotation.rotation_vector), matrices)))


def test_quaternion_functions_ignore_length():
    q = jnp.array([0.3, -0.2, 0.5, 0.1])
    for function in (rotation.quaternion_matrix, rotation.quaternion_log):
        np.testing.assert_allclose(function(q), function(-3.0 * q), atol=1e-15)


def test_product_composes_matrices():
    p, q = jnp.array([0.3, -0.2, 0.5, 0.1]), jnp.array([-0.1, 0.7, 0.2, 0.9])
    product = rotation.quaternion_matrix(rotation.quaternion_product(p, q))
    expected = rotation.quaternion_matrix(p) @ rotation.quaternion_matrix(q)
    np.testing.assert_allclose(product, expected, atol=1e-15)


@pytest.mark.long
def test_rate_is_the_derivative_along_body_angular_velocity():
    q, omega = jnp.array([0.5, -0.5, 0.1, 0.7]), jnp.array([0.2, -0.4, 0.9])
    along = jax.jacfwd(lambda t: rotation.quaternion_product(q, rotation.quaternion_exp(t * omega)))(0.0)
    np.testing.assert_allclose(rotation.quaternion_rate(q, omega), along, atol=1e-15)


def _check(forward, reverse, differences, second, second_differences):
    np.testing.assert_allclose(forward, differences, atol=1e-8)
    np.testing.assert_allclose(reverse, forward, atol=1e-12)
    np.testing.assert_allclose(second, second_differences, atol=1e-7)


@pytest.mark.parametrize(
    "function", [pytest.param(rotation.rotation_matrix, marks=pytest.mark.long), rotation.quaternion_exp]
)
def test_derivatives_of_matrix_and_exponential(function):
    vectors = [angle * _SLANTED for angle in (0.0, 1e-9, 0.64, 2.0, np.pi - 1e-8)]
    _check(*_batch(_derivatives(function), vectors))


@pytest.mark.long
def test_derivatives_of_the_logarithm():
    vectors = [angle * _SLANTED for angle in (0.0, 1e-9, 0.19, 0.21, 2.0, np.pi - 1e-3)]

    def all_of_them(vector):
        matrix = rotation.rotation_matrix(vector)
        log = _derivatives(lambda small: rotation.rotation_vector(matrix @ rotation.rotation_matrix(small)))
        return log(jnp.zeros(3))

    _check(*_batch(all_of_them, vectors))


def test_derivative_of_the_logarithm_close_to_pi_on_its_own_side():
    """Turning about its own axis changes the angle at rate one, however near pi."""

    def rate(direction):
        angle = np.pi - 1e-9
        return jax.jacfwd(lambda a: rotation.rotation_vector(rotation.rotation_matrix(a * direction)))(angle)

    np.testing.assert_allclose(_batch(rate, _DIRECTIONS), _DIRECTIONS, atol=1e-12)


@pytest.mark.long
def test_second_derivative_at_zero_of_the_angle_squared():
    def square(vector):
        return jnp.sum(rotation.rotation_vector(rotation.rotation_matrix(vector)) ** 2)

    gradient, hessian = jax.jit(lambda x: (jax.grad(square)(x), jax.hessian(square)(x)))(jnp.zeros(3))
    np.testing.assert_allclose(hessian, 2 * np.eye(3), atol=1e-14)
    np.testing.assert_allclose(gradient, np.zeros(3), atol=1e-15)


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", "-y", "-z"])
def test_axis_basis_of_coordinate_axes_is_exact(axis):
    basis = np.array(rotation.axis_basis(2.0 * rotation.axis_vector(axis)))
    assert set(np.abs(basis).ravel().tolist()) == {0.0, 1.0}
    assert np.linalg.det(basis) == 1.0
    np.testing.assert_array_equal(basis[:, 2], rotation.axis_vector(axis))
    if axis == "z":
        np.testing.assert_array_equal(basis, np.eye(3))


@pytest.mark.long
def test_axis_basis_of_any_axis():
    axes = np.array([*_DIRECTIONS, -_DIRECTIONS[2], [1, 1, 1], [1e-9, 0, -1], [0.3, -0.8, 0.4]])
    bases = np.array(_batch(rotation.axis_basis, 3.0 * axes))
    products = np.einsum("bij,bik->bjk", bases, bases)
    np.testing.assert_allclose(products, np.tile(np.eye(3), (len(axes), 1, 1)), atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(bases), np.ones(len(axes)), atol=1e-15)
    lengths = np.linalg.norm(axes, axis=1, keepdims=True)
    np.testing.assert_allclose(bases[:, :, 2], axes / lengths, atol=1e-15)
    derivatives = _batch(_derivatives(rotation.axis_basis), axes)
    _check(*(d[-1] for d in derivatives))
    assert all(np.all(np.isfinite(d)) for d in derivatives)


def test_axis_vector_refuses_nonsense():
    np.testing.assert_allclose(rotation.axis_vector((3, 0, 4)), [0.6, 0.0, 0.8])
    with pytest.raises(ValueError, match="'w'"):
        rotation.axis_vector("w")
    with pytest.raises(ValueError, match="three components"):
        rotation.axis_vector((1.0, 2.0))
