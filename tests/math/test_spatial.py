"""Spatial algebra against NumPy's vectors and matrices, of single states and of batches with their axes last."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxmbs.math import _spatial as spatial
from jaxmbs.runtime._jit import SMALL_PROGRAM

N, BATCH = 4, 3
RNG = np.random.default_rng(3)


def vectors(size):
    return RNG.normal(size=(N, size, BATCH))


def turns():
    """Rotations (N, 3, 3, BATCH)."""
    found = Rotation.random(N * BATCH, random_state=RNG.integers(1 << 30)).as_matrix()
    return np.moveaxis(found.reshape(N, BATCH, 3, 3), 1, 3)


def skew(v):
    return np.cross(np.eye(3), v)


def twist_matrix(v):
    """`v x` on twists (angular, linear)."""
    return np.block([[skew(v[:3]), np.zeros((3, 3))], [skew(v[3:]), skew(v[:3])]])


def inertia_matrix(J):
    """6 x 6 matrix of an inertia's 10 numbers on twists (angular, linear)."""
    m, h, (xx, xy, xz, yy, yz, zz) = J[0], skew(J[1:4]), J[4:]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.block([[about, h], [-h, m * np.eye(3)]])


def inertia(W, m, c, I):
    """10 numbers about the origin by the theorem of parallel axes."""
    R, X = pose(W)
    C, (xx, xy, xz, yy, yz, zz) = X + R @ c, I
    about = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T + m[0] * skew(C).T @ skew(C)
    return np.r_[m[0], m[0] * C, about[np.triu_indices(3)]]


def pose(W):
    return W[:9].reshape(3, 3), W[9:]


def moved(above, below):
    (R, X), (S, x) = pose(above), pose(below)
    return np.r_[(R @ S).ravel(), X + R @ x]


def pose_rate(W, v):
    R, X = pose(W)
    return np.r_[(skew(v[:3]) @ R).ravel(), v[3:] + np.cross(v[:3], X)]


def quaternion(q):
    return Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix()


def poses():
    return np.concatenate([turns().reshape(N, 9, BATCH), vectors(3)], axis=1)


def axial(A):
    skewed = (A - A.T) / 2.0
    return np.array([skewed[2, 1], skewed[0, 2], skewed[1, 0]])


def momentum_rate(J, v, v_dot):
    return inertia_matrix(J) @ v_dot - twist_matrix(v).T @ inertia_matrix(J) @ v


CASES = {
    "dot": (spatial.dot, np.dot, vectors(6), vectors(6)),
    "cross": (spatial.cross, np.cross, vectors(3), vectors(3)),
    "rotate": (spatial.rotate, np.matmul, turns(), vectors(3)),
    "compose": (spatial.compose, np.matmul, turns(), turns()),
    "less": (spatial.compose_inverse, lambda A, B: A @ np.linalg.inv(B), turns(), turns()),
    "turned": (
        lambda R, angle: spatial.rotate_about_axis(R, angle[:, 0]),
        lambda R, angle: R @ Rotation.from_rotvec([0.0, 0.0, angle[0]]).as_matrix(),
        turns(),
        vectors(1),
    ),
    "axial": (
        lambda a: spatial.axial(a.reshape(N, 3, 3, *a.shape[2:])),
        lambda a: axial(a.reshape(3, 3)),
        vectors(9),
    ),
    "quaternion_rotations": (spatial.quaternion_rotations, quaternion, vectors(4)),
    "moved": (spatial.compose_pose, moved, poses(), poses()),
    "pose_rate": (spatial.pose_rate, pose_rate, poses(), vectors(6)),
    "screw_twists": (
        lambda z, X, turn, lead: spatial.screw_twists(z, X, turn[:, 0], lead[:, 0]),
        lambda z, X, turn, lead: np.r_[turn * z, np.cross(X, turn * z) + lead * z],
        *(vectors(3), vectors(3), vectors(1), vectors(1)),
    ),
    "cross_motion": (spatial.cross_motion, lambda v, s: twist_matrix(v) @ s, vectors(6), vectors(6)),
    "cross_force": (spatial.cross_force, lambda v, h: -twist_matrix(v).T @ h, vectors(6), vectors(6)),
    "momentum_rate": (spatial.momentum_rate, momentum_rate, vectors(10), vectors(6), vectors(6)),
    "momentum": (spatial.momentum, lambda J, v: inertia_matrix(J) @ v, vectors(10), vectors(6)),
    "world_inertia": (spatial.world_inertia, inertia, poses(), vectors(1), vectors(3), vectors(6)),
}


@pytest.mark.parametrize("small", [False, True])
@pytest.mark.parametrize("name", CASES)
def test_single_states_and_batches(name, small):
    ours, theirs, *arrays = CASES[name]
    each = [[np.asarray(theirs(*(x[n, ..., k] for x in arrays))) for k in range(BATCH)] for n in range(N)]
    expected = np.moveaxis(np.array(each), 1, -1)
    with SMALL_PROGRAM(small):
        batch = jax.jit(ours)(*map(jnp.asarray, arrays))
        single = jax.jit(ours)(*(jnp.asarray(x[..., 0]) for x in arrays))
    np.testing.assert_allclose(batch, expected, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(single, expected[..., 0], rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("name", ["cross", "cross_motion", "cross_force", "momentum", "rotate", "compose"])
def test_derivatives_of_products(name):
    """A product of two: with the change of one and the other, forward, and reverse by the power of both."""
    ours, theirs, A, B = CASES[name]
    (a, da), (b, db) = ((jnp.asarray(x[..., 0]), jnp.asarray(x[..., 1])) for x in (A, B))
    along = jax.jvp(ours, (a, b), (da, db))[1]
    pairs = zip((*da, *a), (*b, *db), strict=True)
    halves = [theirs(np.asarray(x), np.asarray(y)) for x, y in pairs]
    expected = np.add(halves[:N], halves[N:])
    np.testing.assert_allclose(along, expected, rtol=1e-12, atol=1e-13)
    weight = jnp.asarray(np.random.default_rng(4).normal(size=along.shape))
    a_bar, b_bar = jax.vjp(ours, a, b)[1](weight)
    np.testing.assert_allclose(jnp.vdot(weight, along), jnp.vdot(a_bar, da) + jnp.vdot(b_bar, db), rtol=1e-12)
    batch = jax.jvp(ours, (jnp.asarray(A), jnp.asarray(B)), (jnp.asarray(A), jnp.asarray(B)))[1]
    np.testing.assert_allclose(batch[..., 0], 2.0 * ours(a, b), rtol=1e-12, atol=1e-13)


def test_the_order_of_the_public_six_vectors():
    six = jnp.arange(6.0)[None]
    np.testing.assert_array_equal(spatial.to_public_order(six)[0], [3.0, 4.0, 5.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(spatial.from_public_order(spatial.to_public_order(six)), six)
