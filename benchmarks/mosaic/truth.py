"""The tasks in NumPy alone, in complex numbers: Lagrange's equations in absolute angles, and derivatives by the
complex step (Squire and Trapp 1998).

Nothing here is of the solvers under test.  A rod at angle theta points along (cos theta, -sin theta) in the x-z
plane, z upwards; the centre of mass of rod i is a sum of d[i, j] times the directions of the rods j.
"""

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
TOLERANCE = 1e-13
STEP = 1e-40


def directions(theta):
    """Directions (n, 2) of rods, and their derivatives by the angles."""
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([c, -s], axis=-1), np.stack([-s, -c], axis=-1)


def accelerations(theta, omega, d, mass, length, ends=None):
    """Second derivatives (n,) of the angles, and the forces (2,) that close a loop.

    Args: d: places of the centres of mass (bodies, n); ends: coefficients (n,) of a sum of directions that is
    constant, or None for an open chain.
    """
    coefficients = np.einsum("i,ij,ik->jk", mass, d, d)
    difference = theta[:, None] - theta[None, :]
    M = coefficients * np.cos(difference) + np.diag(mass * length**2 / 12.0)
    force = GRAVITY * (mass @ d) * np.cos(theta) - (coefficients * np.sin(difference)) @ omega**2
    if ends is None:
        return np.linalg.solve(M, force), np.zeros(2)
    along, across = directions(theta)
    A = (ends[:, None] * across).T
    gamma = (ends * omega**2) @ along  # minus the derivative of A times omega: directions turn towards their negative
    saddle = np.block([[M, -A.T], [A, np.zeros((2, 2))]])
    found = np.linalg.solve(saddle, np.concatenate([force, gamma]))
    return found[: len(theta)], found[len(theta) :]


def motion(theta, d, mass, length, end, ends=None):
    """Angles and rates at the end of a motion from rest."""
    n = len(theta)

    def rate(_, y):
        return np.concatenate([y[n:], accelerations(y[:n], y[n:], d, mass, length, ends)[0]])

    start = np.concatenate([theta, np.zeros(n)]).astype(complex)
    solution = solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=TOLERANCE, atol=TOLERANCE)
    return solution.y[:n, -1], solution.y[n:, -1]


def chain(mass, length, end, angle=0.3):
    """Place (2,) of the tip of a chain that is released straight, at an angle below the horizontal."""
    n = len(mass)
    d = np.tril(np.broadcast_to(length, (n, n)), -1) + np.diag(length / 2.0)
    theta, _ = motion(np.full(n, angle), d, mass, length, end)
    return length @ directions(theta)[0]


def four_bar_pose(length, crank):
    """Angles (3,) of crank, coupler and rocker by Newton's method; length: of crank, coupler, rocker and ground."""
    theta = np.array([crank, -0.3, -1.2], dtype=complex)
    for _ in range(30):
        along, across = directions(theta)
        ends = np.array([length[0], length[1], -length[2]])
        residual = ends @ along - np.array([length[3], 0.0])
        A = (ends[:, None] * across).T
        theta[1:] -= np.linalg.solve(A[:, 1:], residual)
    return theta


def four_bar(mass, length, end, crank=-1.0):
    """Angle of the rocker [rad] at the end of a motion from rest, and the force (2,) of the ground on the crank."""
    d = np.array(
        [[length[0] / 2, 0 * length[0], 0 * length[0]], [length[0], length[1] / 2, 0], [0, 0, length[2] / 2]]
    )
    ends = np.array([length[0], length[1], -length[2]])
    theta, omega = motion(four_bar_pose(length, crank), d, mass, length[:3], end, ends)
    alpha, closing = accelerations(theta, omega, d, mass, length[:3], ends)
    along, across = directions(theta)
    a = d @ (alpha[:, None] * across - omega[:, None] ** 2 * along)
    needed = mass[:, None] * (a + np.array([0.0, GRAVITY]))
    on_rocker = (
        needed[2] + closing
    )  # of its bearing: the loop is closed by `closing` on the coupler, its opposite here
    return theta[2], needed.sum(axis=0) - on_rocker


def gradient(function, x):
    """Jacobian (m, n) of a function of a vector (n,) to one (m,) by the complex step."""
    columns = []
    for k in range(len(x)):
        z = x.astype(complex)
        z[k] += 1j * STEP
        columns.append(np.atleast_1d(function(z)).imag / STEP)
    return np.stack(columns, axis=-1)
