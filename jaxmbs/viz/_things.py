"""Things of a mechanism with their shapes: force elements, constraints, rows and elastic bodies."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

from ..drawings import Ball, Box, Cylinder, Drawing, Gear, Symbol, Thread, Wheel
from ..model._topology import JointRecord
from ..named_arrays import elements_of
from ..runtime import jit

_MARGIN = 0.1  # of the extent of the trajectory, by which surfaces without ends reach beyond what passes over them


class Thing(NamedTuple):
    """A thing and its shapes, whose frames are numbers among `frames`; `joint` where it acts on one.

    Of a cable on a drum the frames of the drum's joint are the last two.
    """

    name: str
    shapes: Drawing
    frames: tuple[int, ...]
    joint: JointRecord | None = None

    @property
    def threads(self) -> list[Thread]:
        """Its lines over several frames."""
        return [shape for shape in self.shapes if isinstance(shape, Thread)]

    @property
    def symbols(self) -> list[Symbol]:
        """Its symbols."""
        return [shape for shape in self.shapes if isinstance(shape, Symbol)]


def things(system) -> list[Thing]:
    """All things of a system that have a drawing."""
    joints = {joint.first_velocity: joint for joint in system.topology.joints if joint.num_velocities}
    found = []
    for group in system.forces:
        for k, (name, law) in enumerate(elements_of(group.names, group.law)):
            velocity = group.first[k] if group.port.is_on_joint else getattr(group.port, "velocity", None)
            joint = joints.get(velocity)
            frames = group.port.frames_of(group, k) + (() if joint is None else joint.frames)
            found += [Thing(name, law.drawing(), frames, joint)] if frames else []
    for group in system.closures:
        kinds = zip(elements_of(group.names, group.kind), group.first, group.second, strict=True)
        found += [Thing(name, kind.drawing(), (a, b)) for (name, kind), a, b in kinds]
    for group in system.rows:
        laws = zip(elements_of(group.names, group.law), group.frames, strict=True)
        found += [Thing(name, law.drawing(), frames) for (name, law), frames in laws if frames]
    for group in system.elastic:
        found += [Thing(n, group.body.drawing(), f) for n, f in zip(group.names, group.frames, strict=True)]
    return [thing for thing in found if thing.shapes]


_SHORT = 0.06  # of the extent of the trajectory: half of a rail that is short


class ShapePoses(NamedTuple):
    """Poses of a shape along a trajectory.

    Attributes:
        R, x: rotations (T, 3, 3) and positions (T, 3) of its frame in the world.
        others: (T, n, 3) the other frames of its thing in the axes of this one, its own origin if there is none.
        low, high: corners (3,) of the box in which these pass, with a margin.
        axis: (3,) of the shape, in the axes of its frame, z if it has none.
        reach: ends [m] of a rail along its axis.
    """

    R: np.ndarray
    x: np.ndarray
    others: np.ndarray
    low: np.ndarray
    high: np.ndarray
    axis: np.ndarray
    reach: tuple[float, float]

    def in_world(self, points) -> np.ndarray:
        """World points (T, k, 3) of points (k, 3) or (T, k, 3) in the axes of the frame."""
        points = np.asarray(points)
        return self.x[:, None] + np.einsum("tij,kj->tki" if points.ndim == 2 else "tij,tkj->tki", self.R, points)


def place_of_shape(thing: Thing, shape: Any, film) -> ShapePoses:
    """Place of a shape of a thing."""
    own = thing.frames[shape.frame]
    others = [film.position_in_frame(own, frame) for frame in thing.frames if frame != own]
    inside = np.stack(others or [np.zeros_like(film.x[:, own])], axis=1)
    sizes = [_size(other) for other in thing.shapes if getattr(other, "frame", shape.frame) != shape.frame]
    margin = max(sizes, default=0.0) + _MARGIN * film.extent
    low, high = inside.min(axis=(0, 1)) - margin, inside.max(axis=(0, 1)) + margin
    axis = getattr(shape, "axis", (0.0, 0.0, 1.0))
    if axis is None and thing.joint is not None:
        axis = film.axes[thing.joint.name]  # the same in both frames of a revolute joint
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    along, short = inside @ axis, _SHORT * film.extent
    reach = (-short, short) if getattr(shape, "is_short", False) else (along.min() - margin, along.max() + margin)
    return ShapePoses(film.R[:, own], film.x[:, own], inside, low, high, axis, reach)


#: Radius of a ball around a shape.
_SIZES: dict[type, Callable] = {
    Ball: lambda shape: shape.radius,
    Gear: lambda shape: shape.radius,
    Wheel: lambda shape: shape.radius,
    Cylinder: lambda shape: shape.radius + shape.length / 2,
    Box: lambda shape: np.linalg.norm(shape.size) / 2,
}


def _size(shape):
    return float(_SIZES.get(type(shape), lambda _: 0.0)(shape))


def thread_courses(thing: Thing, thread: Thread, film) -> tuple[np.ndarray, np.ndarray]:
    """Ends (T, m, 2, 3) of the straight parts of a thread, and points (T, k, 3) along it."""
    frames = np.asarray(thing.frames if thing.joint is None else thing.frames[:-2])
    ends, line = along_trajectory(thread.course, film.R[:, frames], film.x[:, frames])
    return np.asarray(ends), np.asarray(line)


@jit(compile="tape")
def along_trajectory(function, R, x):
    """A function of rotations and positions, at all instants (T, ...)."""
    return jax.vmap(function)(R, x)
