"""Critical plane of a random stress: the plane whose stress has the greatest variance."""

from collections.abc import Iterable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..errors import ModelError
from ..math import _square as square
from ..quantities import XYZ, Quantity
from ..reports import Report, Reported
from ..runtime import jit
from ._random_response import RandomResponse
from ._stress_spectrum import StressSpectrum, stress_places

KINDS = ("normal", "shear")
#: Steps of Newton's method from the best of the directions that are tried.
STEPS = 8


class CriticalPlane(Reported, eqx.Module):
    """Plane on which the variance of the stress is greatest.

    Attributes:
        normal: (3,) unit normal of the plane; its sign has no meaning.
        along: (3,) unit vector of the direction of the stress: the normal again, or one in the plane.
        spectrum: of the stress on the plane, with its moments.
    """

    normal: Float[Array, "3"]
    along: Float[Array, "3"]
    spectrum: StressSpectrum

    def report(self) -> Report:
        found = {"normal": self.normal, "along": self.along}
        return Report([*(Quantity(*pair, "", (XYZ,)) for pair in found.items()), *self.spectrum.report().quantities])


def critical_plane(response: RandomResponse, names: Iterable[str], kind: str = "normal") -> CriticalPlane:
    """Plane of greatest variance of the normal or shear stress, from the covariance of the components.

    Args:
        names: outputs that are the components x y xy (plane stress: the normal lies in the plane), or x y z xy yz zx.
        kind: "normal" or "shear".

    The plane follows the covariance in derivatives.  Where several planes are equally stressed it is one of them,
    and has no derivative.

    Raises: ModelError for another number of components and another kind, UnknownNameError.
    Source: Macha (1989).
    """
    if kind not in KINDS:
        raise ModelError([f"kind = {kind!r} must be 'normal' or 'shear'"], "the question")
    places = stress_places(response, names)
    P = response.covariance([response.names[k] for k in places])
    normal, along = _greatest(P, kind == "normal")
    row = _row(normal, along, len(places) == 3)
    return CriticalPlane(normal, along, StressSpectrum(response, jnp.outer(row, row), places))


def _row(n, s, is_plane):
    """Coefficients of the components in the stress `n . sigma s`."""
    if is_plane:
        return jnp.stack([n[0] * s[0], n[1] * s[1], n[0] * s[1] + n[1] * s[0]])
    cross = [n[i] * s[j] + n[j] * s[i] for i, j in ((0, 1), (1, 2), (2, 0))]
    return jnp.concatenate([n * s, jnp.stack(cross)])


def _first_axes(is_plane):
    """Frames (k, 3, 3) to try: their first two rows are normal and direction of the shear stress."""
    if is_plane:
        angle = np.pi * np.arange(36) / 36
        zero, one = np.zeros(36), np.ones(36)
        rows = [(np.cos(angle), np.sin(angle), zero), (-np.sin(angle), np.cos(angle), zero), (zero, zero, one)]
        return np.moveaxis(np.array(rows), 2, 0)
    k = np.arange(200) + 0.5
    polar, azimuth = np.arccos(1 - k / 200), np.pi * (1 + 5**0.5) * k  # points of a half sphere, evenly spread
    frames = []
    for p, a in zip(polar, azimuth, strict=True):
        n = np.array([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)])
        u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        u, v = u / np.linalg.norm(u), np.cross(n, u / np.linalg.norm(u))
        for turn in np.pi * np.arange(6) / 6:
            s = np.cos(turn) * u + np.sin(turn) * v
            frames.append([n, s, np.cross(n, s)])
    return np.array(frames)


@jit
def _greatest(P, is_normal):
    """Normal and direction of the greatest variance; the last step of Newton's method has the derivative."""
    is_plane = len(P) == 3
    frames = jnp.asarray(_first_axes(is_plane), P.dtype)

    def row(frame):
        return _row(frame[0], frame[0] if is_normal else frame[1], is_plane)

    def turned(frame, t):
        """The frame turned by small angles about its axes: of a normal stress the first one does nothing."""
        x, y, z = (0.0, 0.0, t[0]) if is_plane else (0.0, t[0], t[1]) if is_normal else (t[0], t[1], t[2])
        zero = jnp.zeros_like(t[0])
        x, y, z = (zero + part for part in (x, y, z))
        skew = jnp.stack([jnp.stack(r) for r in ((zero, -z, y), (z, zero, -x), (-y, x, zero))])
        # Cayley's transform is a rotation for any angles
        return square.solve(jnp.eye(3, dtype=P.dtype) + skew / 2, (jnp.eye(3, dtype=P.dtype) - skew / 2) @ frame)

    def step(frame, P, size):
        def value(t):
            c = row(turned(frame, t))
            return c @ P @ c / size

        zero = jnp.zeros(1 if is_plane else 2 if is_normal else 3, P.dtype)
        gradient, H = jax.grad(value)(zero), jax.hessian(value)(zero)
        values, X = jnp.linalg.eigh(lax.stop_gradient(H))
        least = 1e-3 * jnp.max(jnp.abs(values)) + 1e-30
        away = X @ ((X.T @ lax.stop_gradient(gradient)) / jnp.maximum(jnp.abs(values), least))
        regular = jnp.all(values < -1e-9 * jnp.max(jnp.abs(values)))
        sharp = -square.solve(jnp.where(regular, lax.stop_gradient(H), -jnp.eye(len(zero), dtype=P.dtype)), gradient)
        return turned(frame, jnp.where(regular, sharp, away))

    fixed = lax.stop_gradient(P)
    size = jnp.maximum(jnp.trace(fixed), 1e-300 if P.dtype == jnp.float64 else 1e-30)
    rows = jax.vmap(row)(frames)
    frame = frames[jnp.argmax(jnp.einsum("ki,ij,kj->k", rows, fixed, rows))]
    frame = lax.scan(lambda frame, _: (step(frame, fixed, size), None), frame, None, length=STEPS)[0]
    frame = step(lax.stop_gradient(frame), P, size)
    return frame[0], frame[0] if is_normal else frame[1]
