"""Drawing of a cable: its course along tangents and around wheels, the wheels, and the points where loads act."""

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..drawings import Ball, Drawing, Thread, Wheel
from ..palette import PALE
from ._cable_path import CablePath, PathLayout

_ARC = 24  # points of an arc
_WIDTH = 0.3  # of a sheave or cylinder over its radius
_DRUM_WIDTH = 1.0  # of a drum, on which the cable lies in turns


def cable_drawing(route, drum: float | None = None) -> Drawing:
    """The thread, and its wheels in their frames; a drum turns with the child of its joint, the last frame."""
    layout = route.layout
    tied = tuple(k for k, kind in enumerate(layout.kinds) if kind == "point" and (k or drum is None))
    shapes: list = [Thread(route.course, tied)]
    for k, element in enumerate(layout.circles):
        radius, frame = float(route.radii[k]), int(element)
        if layout.kinds[element] == "sphere":
            shapes.append(Ball(radius, frame, color=PALE))
        else:
            shapes.append(Wheel(radius, _WIDTH * radius, frame, np.asarray(route.axes[k]), PALE))
    if drum is not None:
        shapes.append(Wheel(drum, _DRUM_WIDTH * drum, len(layout.kinds) + 1, None, PALE))
    return tuple(shapes)


def cable_course(layout: PathLayout, path: CablePath, centres: Array) -> tuple[Array, Array]:
    """Ends (m, 2, 3) of the spans, and points (k, 3) along the whole cable, arcs included.

    Args: centres: (n, 3) of the elements.
    """
    start, end = (points.rows for points in path.touching_points(layout))
    axes, number, parts = path.axes.rows, set(map(int, layout.circles)), []
    spans = start.shape[0]
    for k in range(spans):
        parts += [start[k][None], end[k][None]]
        after, following = (k + 1) % len(layout.kinds), (k + 1) % spans
        if after in number and (layout.is_closed or k + 1 < spans):
            axis = axes[after]
            if layout.kinds[after] == "sphere":
                axis = jnp.cross(end[k] - centres[after], start[following] - centres[after])
            parts.append(_arc(centres[after], axis, end[k], start[following], path.wrap[after]))
    return jnp.stack([start, end], axis=1), jnp.concatenate(parts)


def _arc(centre, axis, on, off, wrap):
    """Points (n, 3) about an axis from where the cable arrives to where it leaves; none of a negative wrap."""
    size = jnp.sqrt(jnp.sum(axis**2))
    axis = axis / jnp.where(size > 0, size, 1.0)
    low, high = (jnp.dot(point - centre, axis) for point in (on, off))
    arm, share = on - centre - low * axis, jnp.asarray(np.linspace(0.0, 1.0, _ARC), on.dtype)
    angle = jnp.maximum(wrap, 0.0) * share
    turned = jnp.outer(jnp.cos(angle), arm) + jnp.outer(jnp.sin(angle), jnp.cross(axis, arm))
    return centre[None] + turned + jnp.outer(low + (high - low) * share, axis)


def middles(layout: PathLayout, path: CablePath) -> Array:
    """Points (n, 3) of the elements: ends of the cable, and the middles of the chords on its wheels."""
    start, end = (points.rows for points in path.touching_points(layout))
    if layout.is_closed:  # the last span ends on the first element
        return (start + jnp.roll(end, 1, axis=0)) / 2
    return jnp.concatenate([start[:1], (start[1:] + end[:-1]) / 2, end[-1:]])
