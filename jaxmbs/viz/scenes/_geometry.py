"""Geometry of a scene: solids of bodies, symbols of joints, springs and traces.

Arrays are encoded as base64 of float32, each solid once.  Body 0 is the ground.
"""

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...drawings import Ball, Box, Cylinder, Gear, Outline, Path, Wheel
from ...model._system import System
from ...palette import COLORS, DARK, PALE, STEEL
from .._body_shapes import default_shapes, inertia_box
from .._drawable import distinct_points, frames_with_blocks, slides, spans, torsions
from .._joint_strokes import STANDING
from .._things import Thing, thread_courses
from ._shape_solids import ShapeSolid
from ._solids import Solid, icosphere, rotation_to_axis, rounded_hull, sweep_tube, unit_coil, unit_cone, unit_cylinder
from ._span_items import is_hidden, span_items
from ._torsion_solids import thread_solid, torsion_solids
from ._trajectory import FrameTrajectory

_CLEAR = 0.45  # opacity of surfaces through which one sees
_SHAPES = (Ball, Box, Cylinder, Gear, Outline, Path, Wheel)  # that show what a body looks like
RAIL = 5.0  # of a rail beyond the middle of its block, in bar radii
BAR_RADIUS = 0.02  # of bars, relative to the extent of the scene, chosen by eye
_MANY_BODIES = 40  # more are drawn with fewer corners, to keep the file below a megabyte


def encode_array(values: Any, kind: str = "<f4") -> str:
    """Encode an array as base64."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def rgba(color: str, alpha=1.0) -> list[float]:
    """Red, green, blue and opacity between 0 and 1 of a colour "#rrggbb"."""
    return [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)] + [alpha]


class SolidLibrary:
    """All solids of a scene, each stored once."""

    def __init__(self):
        self.stored: list[dict] = []
        self.numbers: dict = {}
        self.cylinder, self.cone = self(unit_cylinder()), self(unit_cone())
        points, faces = icosphere(3)
        self.ball = self(Solid(points, points, faces))

    def __call__(self, solid: Solid) -> int:
        """Store a solid and return its index."""
        faces = np.asarray(solid.faces)
        made = {
            "vertices": encode_array(solid.vertices),
            "normals": encode_array(solid.normals),
            "faces": encode_array(faces, "<u4"),
        }
        key = tuple(made.values())
        if key not in self.numbers:
            self.numbers[key] = len(self.stored)
            self.stored.append(made)
        return self.numbers[key]


def _shaped_frames(thing) -> set[int]:
    """Numbers of the frames of a thing whose bodies it shows."""
    return {shape.frame for shape in thing.shapes if isinstance(shape, _SHAPES)}


class MechanismGeometry:
    """Geometry of one mechanism; `radius` [m] is that of its bars, `up` (3,) the direction against gravity."""

    def __init__(
        self,
        system: System,
        things: list[Thing],
        film: FrameTrajectory,
        solids: SolidLibrary,
        radius: Any,
        up: np.ndarray,
        shapes: Mapping,
    ):
        self.system, self.things, self.top, self.trajectory = system, things, system.topology, film
        self.solids, self.r, self.up, self.shapes = solids, radius, up, shapes
        self.items: list[dict] = []
        self.tags: list[dict] = []
        self.shaped = {self.top.frame_body[thing.frames[f]] for thing in things for f in _shaped_frames(thing)}
        self.points: list[tuple[str, np.ndarray]] = []  # names and places (T, 3) of points that no body carries
        self._add_bodies()
        self._add_joints()
        self._add_spans()
        self._add_threads()
        self._add_torsions()

    def add_unit_solid(self, name, body, number, position, z, radius, length, color, alpha=1.0):
        """Add a unit solid on a body, from a position along z."""
        frame = np.eye(4)
        frame[:3, :3] = rotation_to_axis(np.asarray(z, float)) * [radius, radius, length]
        frame[:3, 3] = position
        item = {"name": name, "solid": number, "body": body, "local": frame.T.ravel().tolist()}
        self.items.append(item | {"color": rgba(color, alpha)})

    def _add_bodies(self):
        # Sizes below are in bar radii: symbols of joints must stand out of the bars, and were chosen by eye.
        self.slides = slides(self.system, self.trajectory)
        shown = frames_with_blocks(self.top, None, self.slides)
        spared = {b for s in self.slides if s.is_telescope for b in map(self._body, s.joint.frames)}
        blocks = {self._body(s.joint.frames[1]) for s in self.slides}
        beams = {self.top.frame_body[f] for joint in self.top.joints if joint.is_elastic for f in joint.frames}
        meshed = {name for name, value in self.shapes.items() if value is None}
        few = 2 if len(shown) > _MANY_BODIES else 3
        for body, frames in shown.items():
            name = self.top.body_names[body] if body >= 0 else "ground"
            own = self.shapes.get(name, self.shapes.get(name.partition(".")[0]) if name in meshed else None)
            color = COLORS[body % len(COLORS)] if body >= 0 else PALE
            for solid in own or ():
                self._add_solid(name, body + 1, solid, solid.color or color)
            if own or body < 0 or body + 1 in spared or self._is_elastic(name) or body in beams:  # a mesh, or spans
                continue
            points = distinct_points([self.trajectory.position_in_body(self.top, f) for f in frames], 0.6 * self.r)
            com = np.asarray(self.system.com[body], float)
            if len(points) > 1:
                for solid in default_shapes(*self._points(body, frames), self.r, few):
                    self._add_solid(name, body + 1, solid, color)
            elif len(points) and np.linalg.norm(com - points[0]) > self.r and body + 1 not in blocks:
                self._add_solid(name, body + 1, rounded_hull([points[0], com], 0.6 * self.r, few), color)
                self._add_mass_marker(name, body, com, color)
            elif body + 1 not in blocks:
                self._add_mass_marker(name, body, com, color)

    def _is_elastic(self, name):
        """True for a part of an elastic body: an interface, the joint of one, or the modes."""
        return name.partition(".")[0] in {n for group in self.system.elastic for n in group.names}

    def _points(self, body, frames):
        """Positions of a body's joints and named frames, and axes of its revolute joints, in body axes."""
        joints, axes = [], []
        for joint in self.top.joints:
            here = [f for f in joint.frames if f in frames]
            joints += [self.trajectory.position_in_body(self.top, f) for f in here]
            if here and joint.symbol == "pin" and joint.name in self.trajectory.axes:
                world = self.trajectory.R[0, joint.frames[0]] @ self.trajectory.axes[joint.name]
                axes.append(self.trajectory.R[0, body + 1].T @ world)
        others = set(frames) - {f for joint in self.top.joints for f in joint.frames}
        named = [self.trajectory.position_in_body(self.top, f) for f in sorted(others)]
        return (np.array(part).reshape(-1, 3) for part in (joints, named, axes))

    def _add_solid(self, name, body, solid, color):
        self.items.append({"name": name, "solid": self.solids(solid), "body": body, "color": rgba(color)})

    def _add_mass_marker(self, name, body, com, color):
        """Add the inertia box of a body, or a ball where that is small or a thing shows the body's shape."""
        edges, axes = inertia_box(self.system, body, self.trajectory.extent)
        if edges.max(initial=0.0) < 2.0 * self.r or body in self.shaped:
            self.add_unit_solid(name, body + 1, self.solids.ball, com, (0, 0, 1), 2.2 * self.r, 2.2 * self.r, color)
        else:
            size = np.maximum(edges, 0.5 * self.r)
            self._add_solid(name, body + 1, Solid.box(size).placed(com, axes), color)

    def _body(self, frame):
        return self.top.frame_body[frame] + 1

    def _axis_in_body(self, frame, axis):
        """An axis of a frame, in the axes of its body."""
        return self.trajectory.R[0, self._body(frame)].T @ self.trajectory.R[0, frame] @ axis

    def _add_joints(self):
        r = self.r
        for slide in self.slides:
            self._add_slide(slide)
        sliding = {s.joint.name: s for s in self.slides}
        for joint in self.top.joints:
            frame = joint.frames[0]
            body, place = self._body(frame), self.trajectory.position_in_body(self.top, frame)
            if joint.symbol not in ("none", "free"):
                block = None if joint.name not in sliding else self._block(sliding[joint.name])
                tag_body, point = (body, place) if block is None else block
                self.tags.append({"name": joint.name, "body": tag_body, "point": point.tolist()})
            if joint.name in sliding or joint.name not in self.trajectory.axes or self._is_elastic(joint.name):
                continue
            axis = self._axis_in_body(frame, self.trajectory.axes[joint.name])
            if joint.symbol in ("pin", "screw", "cross"):
                axes = [axis] if joint.symbol != "cross" else [axis, np.cross(axis, [0.31, 0.87, 0.38])]
                for z in axes:
                    z = z / np.linalg.norm(z)
                    self.add_unit_solid(
                        joint.name, body, self.solids.cylinder, place - 1.5 * r * z, z, 0.6 * r, 3 * r, DARK
                    )
                if joint.symbol == "screw":
                    thread = thread_solid(r).placed(place, rotation_to_axis(axis))
                    self._add_solid(joint.name, body, thread, STEEL)
            elif joint.symbol == "ball":
                self.add_unit_solid(joint.name, body, self.solids.ball, place, axis, 1.4 * r, 1.4 * r, DARK)
            elif joint.symbol == "plane":  # goes with the child
                body, place = self._body(joint.frames[1]), self.trajectory.position_in_body(self.top, joint.frames[1])
                axis = self._axis_in_body(joint.frames[1], self.trajectory.axes[joint.name])
                self.add_unit_solid(
                    joint.name, body, self.solids.cylinder, place - 0.2 * r * axis, axis, 4 * r, 0.2 * r, PALE
                )
            if body == 0 and joint.symbol in STANDING and not joint.is_hidden:
                self._add_ground_support(joint.name, place)

    def _block(self, slide):
        """Body and place of the block of a slide; None of a telescope."""
        if slide.is_telescope:
            return None
        frame = slide.joint.frames[1]
        along = slide.offset * self._axis_in_body(frame, slide.axis)  # both frames agree
        return self._body(frame), self.trajectory.position_in_body(self.top, frame) + along

    def _add_ground_support(self, name, place):
        base = place - 4.5 * self.r * self.up
        self.add_unit_solid(name, 0, self.solids(unit_cone(0.35)), base, self.up, 2.6 * self.r, 4.5 * self.r, PALE)

    def _add_slide(self, slide):
        """Add barrel and rod of a cylinder, else a rail with a block."""
        r, (a, b), name = self.r, slide.joint.frames, slide.joint.name
        z = self._axis_in_body(a, slide.axis), self._axis_in_body(b, slide.axis)
        at = [self.trajectory.position_in_body(self.top, frame) for frame in (a, b)]
        low, high = slide.reach
        if slide.is_telescope:
            sign = 1.0 if low > 0 else -1.0
            least, most = min(abs(low), abs(high)), max(abs(low), abs(high))
            barrel = 0.9 * least
            rod = max(0.96 * least, most - 0.85 * barrel)
            self.add_unit_solid(
                name, self._body(a), self.solids.cylinder, at[0], sign * z[0], 1.15 * r, barrel, STEEL
            )
            self.add_unit_solid(name, self._body(b), self.solids.cylinder, at[1], -sign * z[1], 0.6 * r, rod, PALE)
            return
        start, length = at[0] + (low - RAIL * r) * z[0], high - low + 2 * RAIL * r
        self.add_unit_solid(name, self._body(a), self.solids.cylinder, start, z[0], 0.45 * r, length, STEEL)
        color, middle = COLORS[(self._body(b) - 1) % len(COLORS)], at[1] + slide.offset * z[1]
        if slide.joint.symbol == "sleeve":
            self.add_unit_solid(
                name, self._body(b), self.solids.cylinder, middle - 2 * r * z[1], z[1], 1.2 * r, 4 * r, color
            )
        else:
            block = Solid.box((2.8 * r, 2.8 * r, 5.2 * r)).placed(middle, rotation_to_axis(z[1]))
            self._add_solid(name, self._body(b), block, color)

    def _add_spans(self):
        for span in spans(self.things, self.slides):
            if span.name in self.shapes:  # an elastic body that is drawn as its mesh
                continue
            ends, lengths = self._span_ends(span)
            if span.slide is None:
                for frame in span.frames:
                    self._add_ground_end(span.name, frame)
            if is_hidden(span.kind, lengths, self.r):
                body, place = ends[0]
                size = 1.9 * self.r
                self.add_unit_solid(span.name, body, self.solids.ball, place, (0, 0, 1), size, size, DARK)
                continue
            both = [{"body": body, "point": place.tolist()} for body, place in ends]
            for item in span_items(span.kind, lengths, self.r, self.solids.cylinder, self._coil):
                self.items.append({"name": span.name, "ends": both} | item | {"color": rgba(item["color"])})

    def _span_ends(self, span):
        """(body, place) of both ends, on a slide from the end of its rail to its block, and lengths (T,)."""
        film, slide = self.trajectory, span.slide
        a, b = span.frames if slide is None else slide.joint.frames
        ends = [(self._body(frame), film.position_in_body(self.top, frame)) for frame in (a, b)]
        if slide is not None and not slide.is_telescope:
            start = min(0.0, slide.reach[0] - 3 * RAIL * self.r)
            ends = [(ends[0][0], ends[0][1] + start * self._axis_in_body(a, slide.axis)), self._block(slide)]
        places = [film.x[:, body] + np.einsum("tij,j->ti", film.R[:, body], place) for body, place in ends]
        return ends, np.linalg.norm(places[1] - places[0], axis=1)

    def _add_ground_end(self, name, frame):
        """Add a ball where an element is tied to the ground."""
        if self._body(frame) == 0:
            place, size = self.trajectory.position_in_body(self.top, frame), 0.9 * self.r
            self.add_unit_solid(name, 0, self.solids.ball, place, (0, 0, 1), size, size, PALE)

    def _add_threads(self):
        """Add the straight parts of threads, whose ends move on wheels."""
        shown = [(thing, thread) for thing in self.things for thread in thing.threads]
        for thing, thread in shown:
            if thing.name in self.shapes:
                continue
            spans = thread_courses(thing, thread, self.trajectory)[0]
            for k in range(spans.shape[1]):
                ends = []
                for side in (0, 1):
                    self.points.append((f"{thing.name} {k}", spans[:, k, side]))
                    ends.append({"body": self.top.bodies.size + len(self.points), "point": [0.0, 0.0, 0.0]})
                item = {"name": thing.name, "solid": self.solids.cylinder, "ends": ends, "part": (0.0, 1.0)}
                self.items.append(item | {"radius": 0.2 * self.r, "color": rgba(DARK)})
            for end in thread.ends:
                self._add_ground_end(thing.name, thing.frames[end])

    def _coil(self, length, radius):
        """A coil for the length of a spring, rounded to powers of two so that few solids are stored."""
        slender = max(length / radius, 1.0)
        return self.solids(unit_coil(2.0 ** np.clip(np.round(np.log2(slender)), 2, 6)))

    def _add_torsions(self):
        for torsion in torsions(self.things):
            if torsion.joint.name not in self.trajectory.axes:
                continue
            first = torsion.joint.frames[0]
            axis = self.trajectory.R[0, first] @ self.trajectory.axes[torsion.joint.name]
            made = torsion_solids(torsion.kind, axis, self.r)
            for frame, (solid, color) in zip(torsion.joint.frames, made, strict=True):
                body, place = self._body(frame), self.trajectory.position_in_body(self.top, frame)
                self._add_solid(torsion.name, body, solid.placed(place, self.trajectory.R[0, body].T), color)

    def add_shapes(self, found: list[ShapeSolid]):
        """Add the solids of things, last the clear ones, through which one sees what was drawn before."""
        for name, frame, solid, is_clear, color in sorted(found, key=lambda one: one.is_clear):
            if name in self.shapes:
                continue
            body, place = self._body(frame), self.trajectory.position_in_body(self.top, frame)
            local = np.eye(4)
            local[:3, :3] = self.trajectory.R[0, body].T @ self.trajectory.R[0, frame]
            local[:3, 3] = place
            shade = rgba(color or (COLORS[(body - 1) % len(COLORS)] if body else PALE), _CLEAR if is_clear else 1.0)
            item = {"name": name, "solid": self.solids(solid), "body": body, "local": local.T.ravel().tolist()}
            self.items.append(item | {"color": shade})

    def add_trace(self, name, points, color):
        """Add the path of points (T, 3) in the world."""
        solid = self.solids(sweep_tube(points, 0.2 * self.r, sides=5))
        self.items.append({"name": f"path of {name}", "solid": solid, "body": 0, "color": rgba(color), "trace": True})


def pose_tracks(film: FrameTrajectory, bodies: int) -> np.ndarray:
    """Position and quaternion x y z w (T, 1 + bodies, 7) of the ground and all bodies, of continuous sign."""
    R, x = film.R[:, : bodies + 1], film.x[:, : bodies + 1]
    q = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat().reshape(*R.shape[:2], 4)
    turned = np.sum(q[1:] * q[:-1], axis=-1) < 0
    signs = np.concatenate([np.ones((1, bodies + 1)), np.cumprod(np.where(turned, -1.0, 1.0), axis=0)])
    return np.concatenate([x, q * signs[..., None]], axis=-1)
