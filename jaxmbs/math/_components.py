"""The algebra of `spatial` component by component, for loops that should be fast.

A quantity is a tuple of its components, each an array over (bodies, 1[, batch]); XLA fuses such expressions into one
loop, of up to six components.  `unpack` and `pack` go to and from arrays whose axis 1 holds the components.
"""

import jax.numpy as jnp
from jax import lax


def unpack(x):
    """Components of an array (bodies, components, ...) as a tuple."""
    # A split, whose transpose is one concatenation; slices would transpose to a sum of padded arrays.
    return tuple(lax.split(x, (1,) * x.shape[1], axis=1))


def pack(components):
    """Array (bodies, components, ...) of a tuple of components."""
    return jnp.concatenate(components, axis=1)


def add(a, b):
    """Sum, component by component."""
    return tuple(x + y for x, y in zip(a, b, strict=True))


def scale(a, s):
    """Product of a vector and a scalar."""
    return tuple(x * s for x in a)


def dot(a, b):
    """Scalar product of two tuples of equal length."""
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        total = total + x * y
    return total


def cross(a, b):
    """Vector product of two 3-vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rotate(R, x):
    """Rotation (9 components, row by row) applied to a 3-vector."""
    return dot(R[:3], x), dot(R[3:6], x), dot(R[6:], x)


def transpose(A):
    """Inverse of a rotation."""
    return A[0::3] + A[1::3] + A[2::3]


def compose(A, B):
    """Product of two rotations."""
    return transpose(sum((rotate(A, B[i::3]) for i in range(3)), ()))


def pose_rate(world, twist):
    """Rate of a world pose (12 components) that moves with a world twist."""
    columns = sum((cross(twist[:3], world[i:9:3]) for i in range(3)), ())
    return transpose(columns) + add(twist[3:], cross(twist[:3], world[9:]))


def axial(A):
    """`v` of the skew part `v x` of a matrix (9 components)."""
    return 0.5 * (A[7] - A[5]), 0.5 * (A[2] - A[6]), 0.5 * (A[3] - A[1])


def quaternion_rotation(q):
    """Rotation (9 components) of a quaternion (w, x, y, z) of any length but zero."""
    w, x, y, z = scale(q, 2.0 / dot(q, q))
    xx, yy, zz = x * q[1], y * q[2], z * q[3]
    xy, xz, yz, wx, wy, wz = x * q[2], x * q[3], y * q[3], w * q[1], w * q[2], w * q[3]
    return (1.0 - yy - zz, xy - wz, xz + wy, xy + wz, 1.0 - xx - zz, yz - wx, xz - wy, yz + wx, 1.0 - xx - yy)


def cross_motion(v, s):
    """Rate of a twist `s` fixed in a frame that moves with the twist `v`: `v x s`."""
    return cross(v[:3], s[:3]) + add(cross(v[:3], s[3:]), cross(v[3:], s[:3]))


def cross_force(v, h):
    """Rate of a wrench or momentum `h` fixed in a frame that moves with the twist `v`: `v x* h`."""
    return add(cross(v[:3], h[:3]), cross(v[3:], h[3:])) + cross(v[:3], h[3:])


def momentum(J, v):
    """Momentum of an inertia (10) with twist (6), about the world origin."""
    m, h, w, l = J[0], J[1:4], v[:3], v[3:]
    spin = (dot(J[4:7], w), dot((J[5], J[7], J[8]), w), dot((J[6], J[8], J[9]), w))
    return add(spin, cross(h, l)) + add(scale(l, m), cross(w, h))


def momentum_rate(J, v, v_dot):
    """Rate of a momentum, `J v_dot + v x* J v`."""
    return add(momentum(J, v_dot), cross_force(v, momentum(J, v)))


def world_inertia(R, X, m, c, I):
    """Inertia (10) about the world origin of bodies at rotation R, position X.

    `m` mass, `c` centre of mass (3), `I` = (xx, xy, xz, yy, yz, zz) about it, both in body axes.
    """
    C = add(X, rotate(R, c))
    h = scale(C, m)
    T = compose(R, (I[0], I[1], I[2], I[1], I[3], I[4], I[2], I[4], I[5]))
    spin = {(i, j): dot(T[3 * i : 3 * i + 3], R[3 * j : 3 * j + 3]) for i in range(3) for j in range(i, 3)}
    hC = dot(h, C)
    return (m, *h) + tuple(s + (hC - h[i] * C[i] if i == j else -h[i] * C[j]) for (i, j), s in spin.items())


# A symmetric 6 x 6 matrix is kept as the 21 numbers of its upper triangle, row by row.
UPPER = tuple((i, j) for i in range(6) for j in range(i, 6))
_SLOT = {p: k for k, (i, j) in enumerate(UPPER) for p in ((i, j), (j, i))}


def symmetric_matrix(J):
    """The 6 x 6 matrix of an inertia (10), as 21 numbers."""
    m, h = J[0], J[1:4]
    z = jnp.zeros_like(m)
    return (J[4], J[5], J[6], z, -h[2], h[1], J[7], J[8], h[2], z, -h[0], J[9], -h[1], h[0], z, m, z, z, m, z, m)


def symmetric_product(A, v):
    """Symmetric matrix (21) times vector (6)."""
    return tuple(dot([A[_SLOT[i, j]] for j in range(6)], v) for i in range(6))
