"""Solids of force elements in a scene: springs, dampers and rods between two points, ropes, torsion springs."""

import functools
from typing import Any

import numpy as np

from ...palette import DARK, PALE
from .._drawable import spans, torsions
from .._things import thread_courses
from ._joint_solids import RAIL, block_of
from ._solid_library import rgba
from ._solids import unit_coil
from ._span_items import is_hidden, span_items
from ._torsion_solids import torsion_solids


def add_spans(scene: Any) -> None:
    """Add the elements between two points, and the balls where they are tied to the ground."""
    for span in spans(scene.things, scene.slides):
        if span.name in scene.shapes:  # an elastic body that is drawn as its mesh
            continue
        ends, lengths = _span_ends(scene, span)
        if span.slide is None:
            for frame in span.frames:
                _add_ground_end(scene, span.name, frame)
        if is_hidden(span.kind, lengths, scene.r):
            body, place = ends[0]
            size = 1.9 * scene.r
            scene.add_unit_solid(span.name, body, scene.solids.ball, place, (0, 0, 1), size, size, DARK)
            continue
        both = [{"body": body, "point": place.tolist()} for body, place in ends]
        for item in span_items(span.kind, lengths, scene.r, scene.solids.cylinder, functools.partial(_coil, scene)):
            scene.items.append({"name": span.name, "ends": both} | item | {"color": rgba(item["color"])})


def _span_ends(scene, span):
    """(body, place) of both ends, on a slide from the end of its rail to its block, and lengths (T,)."""
    film, slide = scene.trajectory, span.slide
    a, b = span.frames if slide is None else slide.joint.frames
    ends = [(scene.body_of(frame), film.position_in_body(scene.top, frame)) for frame in (a, b)]
    if slide is not None and not slide.is_telescope:
        start = min(0.0, slide.reach[0] - 3 * RAIL * scene.r)
        ends = [(ends[0][0], ends[0][1] + start * scene.axis_in_body(a, slide.axis)), block_of(scene, slide)]
    places = [film.x[:, body] + np.einsum("tij,j->ti", film.R[:, body], place) for body, place in ends]
    return ends, np.linalg.norm(places[1] - places[0], axis=1)


def _add_ground_end(scene, name, frame):
    """Add a ball where an element is tied to the ground."""
    if scene.body_of(frame) == 0:
        place, size = scene.trajectory.position_in_body(scene.top, frame), 0.9 * scene.r
        scene.add_unit_solid(name, 0, scene.solids.ball, place, (0, 0, 1), size, size, PALE)


def add_threads(scene: Any) -> None:
    """Add the straight parts of threads, whose ends move on wheels."""
    shown = [(thing, thread) for thing in scene.things for thread in thing.threads]
    for thing, thread in shown:
        if thing.name in scene.shapes:
            continue
        spans = thread_courses(thing, thread, scene.trajectory)[0]
        for k in range(spans.shape[1]):
            ends = []
            for side in (0, 1):
                scene.points.append((f"{thing.name} {k}", spans[:, k, side]))
                ends.append({"body": scene.top.bodies.size + len(scene.points), "point": [0.0, 0.0, 0.0]})
            item = {"name": thing.name, "solid": scene.solids.cylinder, "ends": ends, "part": (0.0, 1.0)}
            scene.items.append(item | {"radius": 0.2 * scene.r, "color": rgba(DARK)})
        for end in thread.ends:
            _add_ground_end(scene, thing.name, thing.frames[end])


def _coil(scene, length, radius):
    """A coil for the length of a spring, rounded to powers of two so that few solids are stored."""
    slender = max(length / radius, 1.0)
    return scene.solids(unit_coil(2.0 ** np.clip(np.round(np.log2(slender)), 2, 6)))


def add_torsions(scene: Any) -> None:
    """Add the springs and dampers about the axes of joints."""
    for torsion in torsions(scene.things):
        if torsion.joint.name not in scene.trajectory.axes:
            continue
        first = torsion.joint.frames[0]
        axis = scene.trajectory.R[0, first] @ scene.trajectory.axes[torsion.joint.name]
        made = torsion_solids(torsion.kind, axis, scene.r)
        for frame, (solid, color) in zip(torsion.joint.frames, made, strict=True):
            body, place = scene.body_of(frame), scene.trajectory.position_in_body(scene.top, frame)
            scene.add_solid(torsion.name, body, solid.placed(place, scene.trajectory.R[0, body].T), color)
