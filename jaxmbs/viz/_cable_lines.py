"""Lines of cables in space: spans along their tangents, arcs on the wheels, and the wheels themselves."""

from typing import NamedTuple

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from ..runtime import jit
from ._drawable import cables

_ARC, _ROUND = 24, 48  # points of an arc and of a circle


class CableLine(NamedTuple):
    """The line of a cable at all instants of a trajectory.

    Attributes:
        name: of the cable.
        ends: (T, m, 2, 3) points where each span leaves an element and reaches the next [m].
        line: (T, k, 3) points along the whole cable, arcs included [m].
        wheels: (T, c, n, 3) circles of its sheaves and cylinders [m].
        spheres: centres (T, 3) and radius of each of its spheres [m].
    """

    name: str
    ends: np.ndarray
    line: np.ndarray
    wheels: np.ndarray
    spheres: list


def cable_lines(system, film) -> list[CableLine]:
    """All cables of a system along a trajectory."""
    return [_line(name, law, np.asarray(frames), film) for name, law, frames in cables(system)]


def circle(centre, axis, radius: float) -> np.ndarray:
    """Points (..., n, 3) of a circle about centres (..., 3) and axes (..., 3)."""
    axis = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
    other = np.eye(3)[np.argmin(np.abs(axis), axis=-1)]
    first = np.cross(axis, other)
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    angle = np.linspace(0.0, 2 * np.pi, _ROUND + 1)[:, None]
    turned = np.cos(angle) * first[..., None, :] + np.sin(angle) * np.cross(axis, first)[..., None, :]
    return centre[..., None, :] + radius * turned


@jit(compile="tape")
def _paths(law, R, x):
    return jax.vmap(lambda R, x: _ends(law.layout, law.path(R, x)))(R, x)


def _ends(layout, path):
    start, end = path.touching_points(layout)
    return start.rows, end.rows, path.wrap


def _line(name, law, frames, film):
    R, x = film.R[:, frames], film.x[:, frames]
    start, end, wrap = (np.asarray(part) for part in _paths(law, R, x))
    own = law.layout.circles
    axes = np.einsum("tcij,cj->tci", R[:, own], np.asarray(law.axes).reshape(-1, 3))
    number = {int(element): c for c, element in enumerate(own)}
    parts = []
    for k in range(start.shape[1]):
        parts += [start[:, k, None], end[:, k, None]]
        after = (k + 1) % len(law.kinds)
        following = (k + 1) % start.shape[1]
        if after in number and (law.closed or k + 1 < start.shape[1]):
            axis = axes[:, number[after]]
            if law.kinds[after] == "sphere":
                axis = np.cross(end[:, k] - x[:, after], start[:, following] - x[:, after])
            parts.append(_arc(x[:, after], axis, end[:, k], start[:, following], wrap[:, after]))
    round_ = [k for k, element in enumerate(own) if law.kinds[element] != "sphere"]
    spheres = [(x[:, e], float(law.radii[k])) for k, e in enumerate(own) if law.kinds[e] == "sphere"]
    wheels = [circle(x[:, own[k]], axes[:, k], float(law.radii[k])) for k in round_]
    wheels = np.stack(wheels, axis=1) if wheels else np.zeros((len(x), 0, _ROUND + 1, 3))
    return CableLine(name, np.stack([start, end], axis=2), np.concatenate(parts, axis=1), wheels, spheres)


def _arc(centre, axis, on, off, wrap):
    """Points (T, n, 3) about an axis from where the cable arrives to where it leaves; none of a negative wrap."""
    size = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = axis / np.where(size > 0, size, 1.0)
    climb = [np.sum((point - centre) * axis, axis=1)[:, None, None] for point in (on, off)]
    arm = on - centre - climb[0][:, 0] * axis
    share = np.linspace(0.0, 1.0, _ARC)
    turns = np.maximum(wrap, 0.0)[:, None] * share
    vectors = turns[..., None] * axis[:, None]
    turned = Rotation.from_rotvec(vectors.reshape(-1, 3)).apply(np.repeat(arm, _ARC, axis=0))
    height = climb[0] + (climb[1] - climb[0]) * share[None, :, None]
    return centre[:, None] + turned.reshape(*turns.shape, 3) + height * axis[:, None]
