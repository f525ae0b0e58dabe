"""Reference of the case A04, Bricard's mechanism, in NumPy and SciPy: one equation of one freedom.

A threefold axis of the cube maps each corner to the one after the next, and the motion keeps this symmetry: the
angles of the corners 0, 2, 4 are a, of 1, 3, 5 are b, and the loop is closed where (1 + cos a) (1 + cos b) = 1
(orthogonal Bricard linkage, e.g. Baker 1980).  A slender rod's kinetic energy is that of the velocities of its ends.
"""

import numpy as np
from scipy.integrate import solve_ivp

_EDGES = np.array(((1.0, 0, 0), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (0, 1, 0)))  # the rods at the start, a cube
_AXES = np.array(((0.0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)))
_GRAVITY = 9.81


def _rotation(axis, angle):
    """Of an angle, also a complex one, about an axis."""
    x, y, z = axis
    K = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def _tangent(a, b):
    """Rates of a, b along the curve of closed loops, for a unit of speed along it."""
    return -np.sin(b) * (1.0 + np.cos(a)), np.sin(a) * (1.0 + np.cos(b))


def corners(a, b):
    """The six corners (6, 3) and, for a unit of speed, their velocities (6, 3)."""
    turns = (np.pi / 2 - a, np.pi / 2 - b) * 3
    rates = tuple(-rate for rate in _tangent(a, b)) * 3
    place, velocity = np.zeros(3), np.zeros(3)
    rotation, spin = np.eye(3), np.zeros(3)
    places, velocities = [place], [velocity]
    for axis, turn, rate, edge in zip(_AXES, turns, rates, _EDGES, strict=False):
        spin = spin + rotation @ axis * rate
        rotation = rotation @ _rotation(axis, turn)
        place, velocity = place + rotation @ edge, velocity + np.cross(spin, rotation @ edge)
        places.append(place)
        velocities.append(velocity)
    return np.array(places), np.array(velocities)


def _inertia_and_potential(a, b):
    """Effective inertia for the speed along the curve, and potential energy."""
    places, v = corners(a, b)
    inertia = np.sum(v[:-1] ** 2 + v[:-1] * v[1:] + v[1:] ** 2) / 3.0
    return inertia, _GRAVITY * np.sum(places[:-1, 1] + places[1:, 1]) / 2.0


def _slope(_, y):
    """Rates of (a, b, speed along the curve); derivatives along it by a complex step."""
    a, b, speed = y
    rate_a, rate_b = _tangent(a, b)
    step = 1e-30
    inertia, potential = _inertia_and_potential(a + 1j * step * rate_a, b + 1j * step * rate_b)
    effort = -(0.5 * inertia.imag * speed**2 + potential.imag) / step
    return [rate_a * speed, rate_b * speed, effort / inertia.real]


def path_of_p3(times):
    """Place of the corner P3 (T, 3) at the times [m], released at rest from the cube at zero."""
    start, times = [np.pi / 2, np.pi / 2, 0.0], np.asarray(times, float)
    motion = solve_ivp(_slope, (0.0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13)
    return np.array([corners(a, b)[0][3] for a, b, _ in motion.y.T])
