"""Line drawings of mechanisms: strokes of a pose, in an order that is the same for every pose."""

import numpy as np
from scipy.spatial import ConvexHull

from ..palette import COLORS
from ._drawable import frames_with_blocks, slides, spans, torsions
from ._joint_strokes import STANDING, JointAxis, joint_markers, plate_strokes, thread_strokes, torsion_strokes
from ._shape_lines import thing_lines
from ._slide_strokes import SlideStrokes
from ._strokes import DARK, STEEL, Stroke, element_strokes
from ._things import things

_SURFACE = {"color": STEEL, "linewidth": 1.2, "zorder": 2.3}
_THREAD = {"color": DARK, "linewidth": 1.4, "zorder": 2.7}
_MARK = {"linestyle": "none", "marker": "o", "markersize": 3.5, "color": COLORS[3], "zorder": 4.2}


class LineDrawing:
    """A mechanism in a projection: `at(k)` returns the strokes at instant k of its trajectory.

    `arrows` are places and forces (T, k, 3) by name; the largest force is a fifth of the picture.
    """

    def __init__(self, system, film, look, frames=None, arrows=None):
        self.top, self.trajectory, self.look, found = system.topology, film, look, things(system)
        self.mass, self.com = np.asarray(system.mass), np.asarray(system.com)
        self.slides, self.things = slides(system, film), thing_lines(found, film)
        self.shown, self.spans = frames_with_blocks(self.top, frames, self.slides), spans(found, self.slides)
        extent = max(film.extent, *(thing.extent for thing in self.things), 0.0)
        self.size = 0.022 * extent
        bodies = {s.joint.name: self.top.frame_body[s.joint.frames[1]] for s in self.slides}
        self.sliding = {
            s.joint.name: SlideStrokes(s, film, look, self.size, bodies[s.joint.name]) for s in self.slides
        }
        self.arrows = list((arrows or {}).values())
        largest = max((np.nanmax(np.linalg.norm(f, axis=-1), initial=0.0) for _, f in self.arrows), default=0.0)
        self.arrow_scale = 0.2 * extent / (largest or 1.0)
        self.axes = {j.name: JointAxis(j, film, look) for j in self.top.joints if j.name in film.axes}
        self.torsions = [t for t in torsions(found) if t.joint.name in self.axes]
        self.hidden = {self.top.frame_body[f] for s in self.slides if s.is_telescope for f in s.joint.frames}
        self.pins = self._frames_by_symbol()
        self.feet = self._feet(found)
        self.masses = self._masses()
        self.reaches = [self._reach_of(span) for span in self.spans]

    def _frames_by_symbol(self):
        """Frames of joints with a marker, by symbol, those of deformations left out."""
        found: dict[str, list[int]] = {}
        for joint in self.top.joints:
            if not (joint.is_hidden or joint.is_elastic):
                found.setdefault("pin" if joint.symbol == "point" else joint.symbol, []).extend(joint.frames)
        return found

    def _masses(self):
        """Bodies of one point, which are drawn as a bar to a dot at their centre of mass: (body, frames)."""
        blocks = {self.top.frame_body[s.joint.frames[1]] for s in self.slides}
        elastic = {self.top.frame_body[f] for j in self.top.joints if j.is_elastic for f in j.frames}
        left_out = blocks | elastic | self.hidden
        return [
            (body, frames[:1])
            for body, frames in self.shown.items()
            if body >= 0 and body not in left_out and self._is_point(frames) and self.mass[body] > 0
        ]

    def _is_point(self, frames):
        places = self.trajectory.x[0, frames]
        return len(frames) < 2 or np.ptp(places, axis=0).max() < 1e-9 * self.trajectory.extent

    def _mass(self, k, body, frames):
        """A bar from the joint of a body to its centre of mass, and a dot there."""
        film, color = self.trajectory, COLORS[body % len(COLORS)]
        centre = film.x[k, body + 1] + film.R[k, body + 1] @ self.com[body]
        bar = self.look(np.stack([*film.x[k, frames], centre]))
        dot = {"linestyle": "none", "marker": "o", "markersize": 7, "color": color, "zorder": 3}
        return [Stroke(bar, {"color": color, "linewidth": 2.0, "zorder": 2.9}), Stroke(bar[-1:], dot)]

    def _feet(self, found):
        """Frames on the ground that stand on a foot: of joints, of ends of elements, of wheels and cables."""
        standing = {f for j in self.top.joints if j.symbol in STANDING and not j.is_hidden for f in j.frames}
        standing |= {f for span in self.spans if span.slide is None for f in span.frames}
        for thing in found:
            for thread in thing.threads:
                held = {*thread.ends, *(shape.frame for shape in thing.shapes if hasattr(shape, "frame"))}
                standing |= {thing.frames[f] for f in held}
        return [f for f in sorted(standing) if self.top.frame_body[f] < 0]

    def at(self, k: int) -> list[Stroke]:
        """All strokes of an instant."""
        points = self.look(self.trajectory.x[k])
        strokes = [stroke for slide in self.sliding.values() for stroke in slide.rail(k)]
        strokes += [self._body(points, body, frames) for body, frames in self.shown.items() if body >= 0]
        for body, frames in self.masses:
            strokes += self._mass(k, body, frames)
        for slide in self.sliding.values():
            strokes += slide.strokes(k)
        for span, reach in zip(self.spans, self.reaches, strict=True):
            strokes += element_strokes(span.kind, self._ends(k, span), reach, self.size, span.lane)
        for torsion in self.torsions:
            strokes += torsion_strokes(torsion.kind, self.axes[torsion.joint.name], k, self.size)
        for thing in self.things:
            strokes += self._thing(k, thing)
        for places, forces in self.arrows:
            strokes += self._arrows(places[k], forces[k])
        return [stroke for stroke in strokes if stroke is not None] + self._joints(k, points)

    def _body(self, points, body, frames):
        """A stick, or the hull of points that span an area; None for a body of one point."""
        if body in self.hidden or self._is_point(frames):
            return None
        style = {"color": COLORS[body % len(COLORS)], "linewidth": 3.0, "solid_capstyle": "round", "zorder": 3}
        return Stroke(_outline(points[frames]), style | {"solid_joinstyle": "round"})

    def _ends(self, k, span):
        """Ends (2, 2) of an element in the picture."""
        if span.slide is not None:
            return self.sliding[span.slide.joint.name].ends(k)
        return self.look(self.trajectory.x[k, list(span.frames)])

    def _reach_of(self, span):
        """Least and largest length of an element as seen."""
        lengths = [np.linalg.norm(np.diff(self._ends(k, span), axis=0)) for k in range(len(self.trajectory.ts))]
        return float(min(lengths)), float(max(lengths))

    def _thing(self, k, thing):
        """Surfaces and wheels, threads over them, and the points where they touch."""
        strokes = [Stroke(self.look(points[k]), _SURFACE) for points in thing.lines]
        strokes += [Stroke(self._outline_of_ball(x[k], radius), _SURFACE) for x, radius in thing.balls]
        strokes += [Stroke(shape.project(k, self.look), _SURFACE) for shape in thing.rounds]
        strokes += [Stroke(self.look(points[k]), _THREAD) for points in thing.threads]
        return strokes + ([Stroke(self.look(thing.marks[k]), _MARK)] if thing.marks.shape[1] else [])

    def _arrows(self, places, forces):
        style = {"color": COLORS[3], "linewidth": 1.6, "zorder": 4.3}
        along = self.arrow_scale * self.look(forces)
        return [Stroke(self._arrow(x, d), style) for x, d in zip(self.look(places), along, strict=True)]

    def _arrow(self, tail, along):
        """Shaft and head of an arrow (6, 2); NaN, which leaves no dot, without a force."""
        length = np.linalg.norm(along)
        if not length > 0:
            return np.full((6, 2), np.nan)
        unit = along / length
        across, tip = np.array([-unit[1], unit[0]]), tail + along
        head = min(self.size, 0.4 * length)
        back = tip - head * unit
        return np.stack([tail, tip, back + 0.5 * head * across, tip, back - 0.5 * head * across, tip])

    def _outline_of_ball(self, centre, radius):
        angle = np.linspace(0.0, 2 * np.pi, 49)
        return self.look(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def _joints(self, k, points):
        """Threads, plates and markers of joints."""
        strokes = []
        for joint in self.top.joints:
            if joint.symbol in ("screw", "plane") and joint.name in self.axes:
                draw = thread_strokes if joint.symbol == "screw" else plate_strokes
                strokes += draw(self.axes[joint.name], k, self.size)
        places = {symbol: points[frames] for symbol, frames in self.pins.items() if symbol not in ("slide", "sleeve")}
        turning = [s for s in self.slides if s.joint.symbol == "sleeve" and not s.is_telescope]
        sleeves = [self.sliding[s.joint.name].block(k)[None] for s in turning]
        if sleeves:
            places["pin"] = np.concatenate([places.get("pin", points[:0]), *sleeves])
        return strokes + joint_markers(places, points[self.feet].reshape(-1, 2))

    def name_places(self) -> list[tuple[str, np.ndarray]]:
        """Names of joints and where they are written at the first instant, of a slide at its block."""
        blocks = {name: slide.block(0) for name, slide in self.sliding.items() if not slide.slide.is_telescope}
        return [
            (
                joint.name,
                blocks.get(joint.name, self.look(self.trajectory.x[0, joint.frames[joint.symbol == "plane"]])),
            )
            for joint in self.top.joints
            if joint.symbol not in ("none", "free") and not joint.is_elastic
        ]


def _outline(place):
    """Points (n, 2) of a body as a line: a stick along its longest extent, or the hull if they span an area."""
    if not np.all(np.isfinite(place)):  # a state that was never reached: nothing is drawn
        return place
    centred = place - place.mean(axis=0)
    _, size, axis = np.linalg.svd(centred)
    if len(place) < 3 or size[1] < 0.05 * size[0]:
        return place[np.argsort(centred @ axis[0], kind="stable")]
    hull = ConvexHull(place).vertices
    return place[np.append(hull, hull[0])]
