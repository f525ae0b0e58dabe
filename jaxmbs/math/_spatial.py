"""Spatial algebra: rotations, twists, wrenches, momenta and inertias of every body at once.

Arrays are (bodies, components[, batch]).  Twists are (angular, linear velocity of the point at the world origin),
momenta and wrenches are (moment about the world origin, force), rotations (bodies, 3, 3[, batch]), inertias 10
additive numbers (m, m c (3), I_xx, I_xy, I_xz, I_yy, I_yz, I_zz about the origin).

By components XLA fuses it into loops, which are the fastest, in batches above all.  Programs that are compiled
"quick" take small products of matrices instead: two thirds of the equations of a gradient, and of its time of
compilation; trees run up to 1.7 times as long, a four-bar 1.1 times.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.custom_derivatives import SymbolicZero

from ..runtime import SMALL_PROGRAM, is_on
from . import _components as components
from ._components import pack, unpack
from ._linalg import CROSS

# Constant tensors (a, b, k) of matrices linear in k numbers, like CROSS: `v x` and `v x*` by a twist; an inertia's
# matrix by its 10 numbers; a symmetric matrix by the 6 of its upper triangle.
_MOTION, _FORCE = np.zeros((6, 6, 6)), np.zeros((6, 6, 6))
_INERTIA, _SYMMETRIC = np.zeros((6, 6, 10)), np.zeros((3, 3, 6))
_MOTION[:3, :3, :3] = _MOTION[3:, 3:, :3] = _MOTION[3:, :3, 3:] = CROSS
_FORCE[:3, :3, :3] = _FORCE[3:, 3:, :3] = _FORCE[:3, 3:, 3:] = CROSS
for _k, (_i, _j) in enumerate(((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))):
    _SYMMETRIC[_i, _j, _k] = _SYMMETRIC[_j, _i, _k] = 1.0
_INERTIA[:3, :3, 4:], _INERTIA[3:, 3:, 0] = _SYMMETRIC, np.eye(3)
_INERTIA[:3, 3:, 1:4], _INERTIA[3:, :3, 1:4] = CROSS, -CROSS
_ABOUT_Z = np.zeros((3, 3, 3))  # by cosine, sine and one
_ABOUT_Z[[0, 1, 2, 1, 0], [0, 1, 2, 0, 1], [0, 0, 2, 1, 1]] = 1.0, 1.0, 1.0, 1.0, -1.0
#: Places of the upper triangle's 6 numbers among the 9 of a symmetric matrix.
TRIANGLE = np.array([0, 1, 2, 4, 5, 8])


def _fused(*arrays, axes=1):
    """True if the algebra of arrays with so many axes behind that of the bodies goes by components."""
    by_components = is_on("spatial_components") and not SMALL_PROGRAM.value
    return by_components or any(x.ndim > 1 + axes for x in arrays)


def _by_components(function, *arrays):
    return pack(function(*map(unpack, arrays)))


def _matrix(tensor, x):
    """Matrices (n, a, b) of vectors x (n, k), linear by a constant tensor (a, b, k)."""
    return jnp.tensordot(x, jnp.asarray(tensor, x.dtype), ((1,), (2,)), precision=lax.Precision.HIGHEST)


def _times(A, x, axis=1):
    """Matrices A (n, a, b) times x (n, b) or (n, b, c); axis 2: times the transposes of x (n, c, b)."""
    return lax.dot_general(A, x, (((2,), (axis,)), ((0,), (0,))), precision=lax.Precision.HIGHEST)


def to_public_order(six, axis=-1):
    """Six-vectors as users read them, (force, moment) or (linear, angular), from those inside the library, which are
    (moment, force) or (angular, linear)."""
    return jnp.roll(six, 3, axis)


def from_public_order(six, axis=-1):
    """Six-vectors in the library's order, (moment, force) or (angular, linear), from those of users."""
    return jnp.roll(six, 3, axis)


def rotations(poses):
    """Rotations (n, 3, 3, ...) of poses (n, 12, ...): 9 numbers row by row, then the position."""
    return poses[:, :9].reshape(poses.shape[0], 3, 3, *poses.shape[2:])


def rows(R):
    """Rotations (n, 3, 3, ...) as 9 numbers row by row (n, 9, ...)."""
    return R.reshape(R.shape[0], 9, *R.shape[3:])


def scale(a, s):
    """Product of vectors a (n, c, ...) and scalars s (n, ...)."""
    return a * s[:, None]


def dot(a, b):
    """Scalar products (n, ...) of vectors (n, c, ...)."""
    if _fused(a, b):
        return components.dot(unpack(a), unpack(b))[:, 0]
    return lax.dot_general(a, b, (((1,), (1,)), ((0,), (0,))), precision=lax.Precision.HIGHEST)


def cross(a, b):
    """Vector products of 3-vectors (n, 3, ...)."""
    if _fused(a, b):
        return _by_components(components.cross, a, b)
    return _cycled(a * _cycled(b) - _cycled(a) * b)  # two products with `CROSS` would be slower


def _cycled(x):
    """(y, z, x) of vectors (x, y, z)."""
    return jnp.concatenate([x[:, 1:], x[:, :1]], axis=1)


def rotate(R, x):
    """Rotations R (n, 3, 3, ...) applied to vectors x (n, 3, ...)."""
    return _product(R, x[:, :, None])[:, :, 0] if _fused(x) else _times(R, x)


def compose(A, B):
    """Products of rotations (n, 3, 3, ...)."""
    return _product(A, B) if _fused(A, axes=2) else _times(A, B)


def compose_inverse(A, B):
    """`A B^-1` of rotations (n, 3, 3, ...)."""
    return _product(A, jnp.swapaxes(B, 1, 2)) if _fused(A, axes=2) else _times(A, B, 2)


def _by_entries(A, B):
    """`_product` entry by entry."""
    rows, columns = (x.reshape(x.shape[0], -1, *x.shape[3:]) for x in (A, jnp.swapaxes(B, 1, 2)))
    a, b = (unpack(x) for x in (rows, columns))
    triples = [(a[i : i + 3], b[j : j + 3]) for i in range(0, len(a), 3) for j in range(0, len(b), 3)]
    entries = pack([components.dot(x, y) for x, y in triples])
    return entries.reshape(entries.shape[0], A.shape[1], B.shape[2], *entries.shape[2:])


@jax.custom_jvp
def _product(A, B):
    """Products of matrices (n, i, 3, ...) and (n, 3, j, ...), as sums of three outer ones: one loop, while nine
    components were nine, a third as fast in batches.  Derivatives of single states are products proper, whose
    transposes are too; those of batches go by entries: the transpose of an outer product is a sum."""
    return A[:, :, 0:1] * B[:, 0:1] + A[:, :, 1:2] * B[:, 1:2] + A[:, :, 2:3] * B[:, 2:3]


@functools.partial(_product.defjvp, symbolic_zeros=True)
def _product_jvp(primals, tangents):
    (A, B), (dA, dB) = primals, tangents
    product = _times if A.ndim == 3 else _by_entries
    found = _product(A, B)
    left = jnp.zeros_like(found) if type(dA) is SymbolicZero else product(dA, B)
    return found, left if type(dB) is SymbolicZero else left + product(A, dB)


def compose_pose(above, below):
    """Poses (n, 12, ...) `below` in the frames of poses `above`."""
    R = rotations(above)
    x = above[:, 9:] + rotate(R, below[:, 9:])
    return jnp.concatenate([rows(compose(R, rotations(below))), x], axis=1)


def quaternion_rotations(q):
    """Rotations (n, 3, 3, ...) of quaternions (w, x, y, z) (n, 4, ...) of any length but zero."""
    nine = _by_components(components.quaternion_rotation, q)
    return nine.reshape(nine.shape[0], 3, 3, *nine.shape[2:])


def axial(R):
    """Vectors (n, 3, ...) of the skew parts of matrices (n, 3, 3, ...): `v` of `v x`."""
    if _fused(R, axes=2):
        return _by_components(components.axial, rows(R))
    return 0.5 * jnp.tensordot(R, jnp.asarray(CROSS, R.dtype), 2, precision=lax.Precision.HIGHEST)


def rotate_about_axis(R, angle):
    """Rotations R (n, 3, 3, ...) turned by angles (n, ...) about their own z."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    if not _fused(angle, axes=0):
        return _times(R, _matrix(_ABOUT_Z, jnp.stack([c, s, jnp.ones_like(c)], axis=1)))
    c, s, x, y = c[:, None, None], s[:, None, None], R[:, :, 0:1], R[:, :, 1:2]
    return jnp.concatenate([c * x + s * y, c * y - s * x, jnp.broadcast_to(R[:, :, 2:], (c * x).shape)], axis=2)


def rotation_rate(omega, R):
    """Rates (n, 3, 3, ...) of rotations R that turn with angular velocities omega (n, 3, ...)."""
    if _fused(omega):
        return pack(components.cross(unpack(omega[:, :, None]), unpack(R)))
    return _times(_matrix(CROSS, omega), R)


def pose_rate(world, twist):
    """Rates of world poses (n, 12, ...) that move with world twists (n, 6, ...)."""
    if world.ndim > 2:
        return _by_components(components.pose_rate, world, twist)
    omega, x = twist[:, :3], world[:, 9:]
    return jnp.concatenate([rows(rotation_rate(omega, rotations(world))), twist[:, 3:] + cross(omega, x)], axis=1)


def screw_twists(z, X, turn, lead):
    """Twists (n, 6, ...) of unit rates of screws along z through X (n, 3, ...).

    `turn` (None: one) and `lead` (n, ...) are the rates about and along z.
    """
    spin = z if turn is None else scale(z, turn)
    return jnp.concatenate([spin, cross(X, spin) + scale(z, lead)], axis=1)


def cross_motion(v, s):
    """Rates of twists `s` fixed in frames that move with the twists `v`: `v x s` (n, 6, ...)."""
    if _fused(v, s):
        return _by_components(components.cross_motion, v, s)
    return _times(_matrix(_MOTION, v), s)


def cross_force(v, h):
    """Rates of wrenches or momenta `h` fixed in frames that move with the twists `v`: `v x* h` (n, 6, ...)."""
    if _fused(v, h):
        return _by_components(components.cross_force, v, h)
    return _times(_matrix(_FORCE, v), h)


def momentum(J, v):
    """Momenta (n, 6, ...) of inertias (n, 10, ...) with twists (n, 6, ...), about the world origin."""
    return _by_components(components.momentum, J, v) if _fused(J, v) else _times(_matrix(_INERTIA, J), v)


def momentum_by_matrix(J, v):
    """`momentum` of twists (n, 6), in few equations: where it is a small part of what is computed."""
    return jnp.sum(_matrix(_INERTIA, J) * v[:, None], axis=2)


def momentum_rate(J, v, v_dot):
    """Rates (n, 6, ...) of momenta, `J v_dot + v x* J v`."""
    if _fused(J, v):
        return _by_components(components.momentum_rate, J, v, v_dot)
    return momentum(J, v_dot) + cross_force(v, momentum(J, v))


def world_inertia(W, m, c, I):
    """Inertias (n, 10, ...) about the world origin of bodies at poses W (n, 12, ...).

    `m` (n, 1, ...) mass, `c` centre of mass (n, 3, ...), `I` = (xx, xy, xz, yy, yz, zz) about it, both in body axes.
    """
    if W.ndim > 2:  # the derivatives of batches are faster by components
        mass, w = jnp.broadcast_to(m, W[:, :1].shape), unpack(W)  # parameters may serve a batch of states
        return pack(components.world_inertia(w[:9], w[9:], *unpack(mass), unpack(c), unpack(I)))
    R = rotations(W)
    C = W[:, 9:] + rotate(R, c)
    h = m * C
    if not _fused(W):
        about = compose_inverse(_times(R, _matrix(_SYMMETRIC, I)), R) - _times(_matrix(CROSS, h), _matrix(CROSS, C))
        return jnp.concatenate([m, h, rows(about)[:, TRIANGLE]], axis=1)
    local = jnp.stack([I[:, :3], _joined(I, 1, 3), _joined(I, 2, 4)], axis=1)
    about = (
        compose_inverse(compose(R, local), R)
        + dot(h, C)[:, None, None] * _along(np.eye(3), W)
        - h[:, :, None] * C[:, None]
    )
    mass = jnp.broadcast_to(m, h[:, :1].shape)  # parameters may serve a batch of states
    return jnp.concatenate([mass, h, about[:, 0], about[:, 1, 1:], about[:, 2, 2:]], axis=1)


def _joined(I, one, two):
    """Entry `one` and the two from `two` on."""
    return jnp.concatenate([I[:, one : one + 1], I[:, two : two + 2]], axis=1)


def _along(matrix, x):
    """A static matrix with the axes of x."""
    return jnp.asarray(matrix, x.dtype).reshape((1, *matrix.shape, *[1] * (x.ndim - 2)))
