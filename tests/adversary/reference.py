"""Newton-Euler equations of bodies in absolute coordinates, in plain NumPy: the judge of the random mechanisms.

Every body moves freely, by the velocity of its centre of mass and its angular velocity, both in world axes; a joint
is a set of rows between two frames.  Nothing of the library is used.  Derivatives along the motion are complex steps,
the saddle system is solved in extended precision, so that its answers serve masses of many decades too.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

STEP = 1e-30  # of the complex steps
RANK = 1e-9  # singular values of the scaled rows that count as zero
NUM_COORDINATES = {
    "prismatic": 1,
    "cylindrical": 2,
    "universal": 2,
    "spherical": 4,
    "planar": 3,
    "free": 7,
    "weld": 0,
}
NUM_RATES = NUM_COORDINATES | {"spherical": 3, "free": 6}


def num_coordinates(kind):
    return NUM_COORDINATES.get(kind, 1)


def num_rates(kind):
    return NUM_RATES.get(kind, 1)


@dataclass(frozen=True)
class Joint:
    """Frames are (rotation, position) in body axes; `turn` takes canonical axes, z the joint's, to theirs."""

    kind: str
    parent: int
    child: int
    parent_frame: tuple
    child_frame: tuple
    turn: np.ndarray
    pitch: float


@dataclass(frozen=True)
class Mechanism:
    """Bodies 0 ... n-1 with poses (rotation, position of the body's frame), ground -1; one spring from the ground."""

    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    rotation: np.ndarray
    position: np.ndarray
    joints: tuple
    gravity: np.ndarray
    spring: tuple  # body, point on the ground, point in body axes, stiffness, damping, free length

    @property
    def centres(self):
        return self.position + np.einsum("nij,nj->ni", self.rotation, self.com)

    @property
    def size(self):
        """A length that makes angles and distances comparable."""
        points = np.array([_frame(self, j.child, j.child_frame, self.rotation, self.centres)[1] for j in self.joints])
        return float(np.max(np.linalg.norm(points - points.mean(0), axis=1))) or 1.0


@dataclass(frozen=True)
class Answer:
    """Accelerations of the joints' rates and of the bodies (n, 6), wrenches (joints, 6) on the children about their
    frames, in their axes, and which of their components statics determines."""

    accelerations: list
    bodies: np.ndarray
    wrenches: np.ndarray
    unique: np.ndarray
    mobility: int
    redundant: int
    conditioning: float  # smallest singular value of the rows that is not zero
    gap: float  # largest relative row of acceleration left open


def skew(a):
    """Matrices (..., 3, 3) of the vector product."""
    out = np.zeros((*a.shape, 3), a.dtype)
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return out - np.swapaxes(out, -1, -2)


def _frame(m, body, frame, R, c):
    """World rotation and position of a frame from the rotations R and the centres of mass c of the bodies."""
    if body < 0:
        return frame
    return R[body] @ frame[0], c[body] + R[body] @ (frame[1] - m.com[body])


def _split(joint, C):
    """Rows (m, 6) and freedoms (f, 6) of the relative twist (velocity, angular velocity) in canonical parent axes."""
    e, turned = np.eye(6), np.hstack([np.zeros((3, 3), C.dtype), C.T])
    if joint.kind == "spherical":
        return e[:3], turned
    if joint.kind == "free":
        return e[:0], np.vstack([e[:3], turned])
    if joint.kind == "universal":
        across = np.concatenate([np.zeros(3), np.cross(e[0, :3], C[:, 1])])
        return np.vstack([e[:3], across]), np.vstack([e[3], turned[1]])
    if joint.kind == "screw":
        return np.vstack([e[[0, 1, 3, 4]], e[2] - joint.pitch * e[5]]), e[[5]]
    free = {"revolute": [5], "prismatic": [2], "cylindrical": [2, 5], "planar": [0, 1, 5], "weld": []}[joint.kind]
    return np.delete(e, free, axis=0), e[free]


def _relative(m, joint, R, c):
    """Map (6, 6n) from body twists to the relative twist at the child's frame, and the relative rotation."""
    A, B = (_frame(m, *end, R, c) for end in ((joint.parent, joint.parent_frame), (joint.child, joint.child_frame)))
    axes = A[0] @ joint.turn
    out = np.zeros((6, 6 * len(m.mass)), R.dtype)
    for body, sign in ((joint.parent, -1.0), (joint.child, 1.0)):
        if body >= 0:
            own = slice(6 * body, 6 * body + 6)
            lever = -skew(B[1] - c[body])
            out[:3, own] += sign * axes.T @ np.hstack([np.eye(3), lever])
            out[3:, own] += sign * np.hstack([np.zeros((3, 3)), axes.T])
    return out, axes.T @ B[0] @ joint.turn


def maps(m, R=None, c=None):
    """Rows (rows, 6n) of all joints, and a list of the maps (f, 6n) to the joints' rates."""
    R, c = (m.rotation, m.centres) if R is None else (R, c)
    rows, rates = [], []
    for joint in m.joints:
        relative, C = _relative(m, joint, R, c)
        across, along = _split(joint, C)
        rows.append(across @ relative)
        rates.append(along @ relative)
    return np.vstack(rows), rates


def _scaled(m, J):
    """Rows in lengths of the bodies' twists in lengths; scales of rows and columns."""
    n = len(m.mass)
    column = np.tile(np.r_[np.ones(3), np.full(3, 1.0 / m.size)], n)
    turns = np.all(J.reshape(len(J), n, 6)[:, :, :3] == 0.0, axis=(1, 2))
    row = np.where(turns, m.size, 1.0)
    return row[:, None] * J * column, row, column


def _spaces(m, J):
    """Rank, null space and left null space of the rows in their own units, the least singular value."""
    scaled, row, column = _scaled(m, J)
    U, s, Vt = np.linalg.svd(scaled)
    rank = int(np.sum(s > RANK * max(s[0], 1.0))) if len(s) else 0
    return rank, column[:, None] * Vt[rank:].T, row[:, None] * U[:, rank:], s[rank - 1] if rank else 1.0


def random_motion(m, random, speed=2.0):
    """Body twists (n, 6) that all joints allow, of about the given rates."""
    N = _spaces(m, maps(m)[0])[1]
    twist = (N @ random.normal(size=N.shape[1])).reshape(-1, 6)
    fastest = max(np.max(np.abs(twist[:, :3])) / m.size, np.max(np.abs(twist[:, 3:])), 1e-300)
    return twist * (speed / fastest) if N.shape[1] else twist


def joint_rates(m, twist):
    """Rates of every joint from the body twists."""
    return [along @ twist.ravel() for along in maps(m)[1]]


def _loads(m, twist):
    """Gravity, gyroscopic moments and the spring: (6n,)."""
    f = np.zeros((len(m.mass), 6))
    world = m.rotation @ m.inertia @ np.swapaxes(m.rotation, 1, 2)
    f[:, :3] = m.mass[:, None] * m.gravity
    f[:, 3:] = -np.cross(twist[:, 3:], np.einsum("nij,nj->ni", world, twist[:, 3:]))
    body, ground, point, stiffness, damping, free = m.spring
    arm = m.rotation[body] @ (point - m.com[body])
    d = m.centres[body] + arm - ground
    n = d / np.linalg.norm(d)
    rate = n @ (twist[body, :3] + np.cross(twist[body, 3:], arm))
    force = -(stiffness * (np.linalg.norm(d) - free) + damping * rate) * n
    f[body] += np.r_[force, np.cross(arm, force)]
    return f.ravel(), world


def _eliminated(A, b):
    """Solution of A x = b by elimination with row scaling and pivots, in extended precision."""
    A, b = np.asarray(A, np.longdouble), np.asarray(b, np.longdouble)
    column = 1.0 / np.max(np.abs(A), axis=0)
    A = A * column
    row = 1.0 / np.max(np.abs(A), axis=1)
    A = np.column_stack([row[:, None] * A, row * b])
    for k in range(len(A)):
        p = k + int(np.argmax(np.abs(A[k:, k])))
        A[[k, p]] = A[[p, k]]
        A[k + 1 :, k:] -= (A[k + 1 :, k] / A[k, k])[:, None] * A[k, k:]
    x = np.zeros(len(A), np.longdouble)
    for k in range(len(A))[::-1]:
        x[k] = (A[k, -1] - A[k, k + 1 : -1] @ x[k + 1 :]) / A[k, k]
    return np.asarray(column * x, float)


def _wrenches(m, multipliers):
    """Wrenches (joints, 6, ...) on the children about their frames, in their axes."""
    out, at = [], 0
    for joint in m.joints:
        A, B = (
            _frame(m, *e, m.rotation, m.centres)
            for e in ((joint.parent, joint.parent_frame), (joint.child, joint.child_frame))
        )
        across = _split(joint, joint.turn.T @ A[0].T @ B[0] @ joint.turn)[0]
        wrench = across.T @ multipliers[at : at + len(across)]
        turn = B[0].T @ A[0] @ joint.turn
        out.append(np.concatenate([turn @ wrench[:3], turn @ wrench[3:]]))
        at += len(across)
    return np.array(out)


def answer(m, twist):
    """Accelerations and reactions at a pose and motion that the joints allow."""
    n, R, c = len(m.mass), m.rotation, m.centres
    J, rates = maps(m)
    moved = R + 1j * STEP * skew(twist[:, 3:]) @ R, c + 1j * STEP * twist[:, :3]
    J_dot, rates_dot = maps(m, *moved)
    v = twist.ravel()
    bias = J_dot.imag / STEP @ v
    f, world = _loads(m, twist)
    M = scipy.linalg.block_diag(*[B for k in range(n) for B in (m.mass[k] * np.eye(3), world[k])])
    rank, _, Y, least = _spaces(m, J)
    chosen = scipy.linalg.qr(_scaled(m, J)[0].T, pivoting=True, mode="r")[1][:rank]
    K = np.block([[M, -J[chosen].T], [J[chosen], np.zeros((rank, rank))]])
    x = _eliminated(K, np.r_[f, -bias[chosen]])
    multipliers = np.zeros(len(J))
    multipliers[chosen] = x[6 * n :]
    accelerations = [B.imag / STEP @ v + A @ x[: 6 * n] for A, B in zip(rates, rates_dot, strict=True)]
    gap = np.max(np.abs(J @ x[: 6 * n] + bias), initial=0.0) / (1e-300 + np.max(np.abs(bias), initial=1e-3))
    change = _wrenches(m, Y) / np.r_[np.ones(3), np.full(3, m.size)][None, :, None]
    largest = np.max(np.abs(change), initial=0.0, axis=2)
    unique = largest <= 1e-7 * max(np.max(largest, initial=0.0), 1e-300)
    wrenches = _wrenches(m, multipliers[:, None])[..., 0]
    bodies = x[: 6 * n].reshape(n, 6)
    return Answer(accelerations, bodies, wrenches, unique, 6 * n - rank, len(J) - rank, least, gap)
