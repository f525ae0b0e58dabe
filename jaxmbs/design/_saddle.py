"""Saddles and maxima at the end of a search: the objective falls along directions that it never went.

A search by slopes that begins on a line of symmetry stays on it: the slope across is zero, whatever the objective
does there.  Curvatures of the Lagrangian are looked for, by Lanczos' method on differences of gradients, in what
neither its steps nor the limits and bounds that hold it span; nothing is evaluated where they span all.

Source: Lanczos (1950).
"""

import numpy as np

from ._search import Point, Search

_PROBES = 6  # gradients at most
_LENGTH = 1e-4  # of a probe, of the variables' scales
_ROOM = 1e-3  # to its bounds that a variable needs, of its scale
_SPANNED = 1e-6  # least singular value of the unit vectors that span
_FLAT = 1e-9  # curvature that is none, of the largest
_TRIALS = (0.1, -0.1, 0.01, -0.01)  # steps along the curvature, of the scales

SADDLE = (
    "a saddle or a maximum: the objective falls on both sides of the design found, and the search began on a line of "
    "symmetry through it; begin beside that"
)


def lower_point(search: Search) -> Point | None:
    """A point beside a saddle or a maximum at which a search has converged, where the Lagrangian is lower."""
    best, v = search.best, search.variables
    if search.reason != "converged" or not best.finite:
        return None
    scale, (weights, places) = v.move_scale(best.x), search.active_rows(best)
    room = np.minimum(best.x - v.lower, v.upper - best.x) > _ROOM * scale
    basis = _unspanned(search, best.jacobian[weights > 0.0] * scale, room, scale)
    if not basis.size:
        return None

    def slope(point):
        return basis.T @ ((point.gradient + weights @ point.jacobian) * scale)

    def along(direction, length):
        return search.evaluate(best.x + length * scale * (basis @ direction))

    bent = _least_curvature(lambda d: (slope(along(d, _LENGTH)) - slope(best)) / _LENGTH, basis.shape[1])
    if bent is None:
        return None
    curvature, direction = bent
    lagrangian = lambda point: point.value + weights @ point.constraints[places]
    for length in _TRIALS:
        point = along(direction, length)
        if point.finite and lagrangian(point) < lagrangian(best) + 0.1 * curvature * length**2:
            return point
    return None


def _unspanned(search, held, room, scale):
    """Orthonormal directions (n, k) of scaled variables that no step had, and that bounds and limits leave."""
    steps = np.diff(np.array(search.points), axis=0) / scale
    rows = np.concatenate([steps, held])
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = np.concatenate([rows[length[:, 0] > 0.0] / length[length > 0.0][:, None], np.eye(len(scale))[~room]])
    _, sizes, directions = np.linalg.svd(rows, full_matrices=True)
    return directions[np.count_nonzero(sizes > _SPANNED) :].T


def _least_curvature(product, size):
    """(curvature, unit direction (size,)) of the most negative one by Lanczos' method; None where none is negative.

    product: of the second derivative with a unit vector, nan where there is none.
    """
    new, Q, products = np.random.default_rng(0).normal(size=size), [], []
    for _ in range(min(_PROBES, size)):
        for _ in range(2):  # orthogonal to the last digit
            new = new - sum((q * (q @ new) for q in Q), np.zeros(size))
        if not np.linalg.norm(new) > 0.0:
            break
        Q.append(new / np.linalg.norm(new))
        products.append(new := product(Q[-1]))
        if not np.all(np.isfinite(new)):
            return None
        T = np.array(Q) @ np.array(products).T
        values, vectors = np.linalg.eigh(0.5 * (T + T.T))
        if values[0] < -_FLAT * np.max(np.abs(values)):
            return values[0], np.array(Q).T @ vectors[:, 0]
    return None
