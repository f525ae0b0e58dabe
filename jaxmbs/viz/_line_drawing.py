"""Line drawings of mechanisms: strokes of a pose, in an order that is the same for every pose."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from ..palette import COLORS
from ._drawable import body_frames, slides, spans, torsions
from ._shape_lines import thing_lines
from ._things import things

_STEEL, _DARK = "0.45", "0.2"
_NO_RING = ("none", "slide", "weld")  # symbols of joints that have a block, or nothing


class Stroke(NamedTuple):
    """Points (n, 2) of a line, or of an area if `fill`, and its style for matplotlib."""

    points: np.ndarray
    style: dict
    fill: bool = False


class LineDrawing:
    """A mechanism in a projection: `at(k)` returns the strokes at instant k of its trajectory.

    `arrows` are places and forces (T, k, 3) by name; the largest force is a fifth of the picture.
    """

    def __init__(self, system, film, look, frames=None, arrows=None):
        self.system, self.top, self.trajectory, self.look = system, system.topology, film, look
        self.shown = body_frames(self.top, frames)
        found = things(system)
        self.slides, self.spans, self.things = slides(system, film), spans(found), thing_lines(found, film)
        self.ends = {f for span in self.spans for f in span.frames}
        self.ends |= {f for thing in found if thing.threads for f in thing.frames}
        self.arrows = list((arrows or {}).values())
        largest = max((np.nanmax(np.linalg.norm(f, axis=-1), initial=0.0) for _, f in self.arrows), default=0.0)
        radii = [float(getattr(shape, "radius", 0.0)) for thing in found for shape in thing.shapes]
        extent = max([film.extent, *(2.0 * radius for radius in radii)])
        self.arrow_scale = 0.2 * extent / (largest or 1.0)
        self.torsions = [t for t in torsions(found) if t.joint.name in film.axes]
        self.hidden = {self.top.frame_body[f] for s in self.slides if s.is_telescope for f in s.joint.frames}
        self.size = 0.022 * extent
        self.pins = {f for j in self.top.joints if j.symbol not in _NO_RING for f in j.frames}

    def at(self, k: int) -> list[Stroke]:
        """All strokes of an instant."""
        points = self.look(self.trajectory.x[k])
        strokes = [self._rail(k, slide) for slide in self.slides]
        strokes += [self._body(points, body, frames) for body, frames in self.shown.items() if body >= 0]
        for slide in self.slides:
            strokes += self._slide(k, slide)
        for span in self.spans:
            strokes += self._span(points, span)
        for torsion in self.torsions:
            strokes += self._torsion(k, torsion)
        for thing in self.things:
            strokes += self._thing(k, thing)
        for places, forces in self.arrows:
            strokes += self._arrows(places[k], forces[k])
        return [stroke for stroke in strokes if stroke is not None] + self._marks(points)

    def _body(self, points, body, frames):
        """A stick, or the hull of points that span an area; None for a body of one point."""
        place = points[frames]
        wide = self.trajectory.x[0, frames]
        if body in self.hidden or len(frames) < 2 or np.ptp(wide, axis=0).max() < 1e-9 * self.trajectory.extent:
            return None
        style = {"color": COLORS[body % len(COLORS)], "linewidth": 3.0, "solid_capstyle": "round", "zorder": 3}
        return Stroke(_outline(place), style | {"solid_joinstyle": "round"})

    def _line(self, k, slide, near, far, side=0):
        """Two points of the picture on the axis of a slide, at distances from its first (second) frame."""
        frame = slide.joint.frames[side]
        axis = self.trajectory.R[k, slide.joint.frames[0]] @ slide.axis
        return self.look(self.trajectory.x[k, frame] + np.array([[near], [far]]) * axis)

    def _rail(self, k, slide):
        if slide.is_telescope:
            return None
        low, high = slide.reach
        rail = self._line(k, slide, low - 3 * self.size, high + 3 * self.size)
        return Stroke(rail, {"color": _STEEL, "linewidth": 1.2, "linestyle": (0, (6, 2)), "zorder": 2})

    def _slide(self, k, slide):
        """Barrel and rod of a cylinder, or a block on its rail."""
        low, high = slide.reach
        if slide.is_telescope:
            least, most = sorted(map(abs, (low, high)))
            sign = 1.0 if low > 0 else -1.0
            barrel = 0.9 * least
            rod = max(0.96 * least, most - 0.85 * barrel)
            thin = self._line(k, slide, 0.0, -sign * rod, 1)
            thick = self._line(k, slide, 0.0, sign * barrel)
            thick_style = {"color": _STEEL, "linewidth": 6.0, "solid_capstyle": "butt", "zorder": 3}
            return [Stroke(thin, {"color": _DARK, "linewidth": 2.2, "zorder": 2.9}), Stroke(thick, thick_style)]
        middle = self._line(k, slide, -1.6 * self.size, 1.6 * self.size, 1)
        along = middle[1] - middle[0]
        length = np.linalg.norm(along)
        along = along / length if length > 1e-3 * self.size else np.array([1.0, 0.0])
        across = self.size * np.array([-along[1], along[0]])
        ends = middle.mean(axis=0) + 1.6 * self.size * np.stack([-along, along])
        corners = np.stack([ends[0] - across, ends[1] - across, ends[1] + across, ends[0] + across])
        body = self.top.frame_body[slide.joint.frames[1]]
        color = COLORS[body % len(COLORS)] if body >= 0 else _STEEL
        style = {"facecolor": color, "edgecolor": "white", "linewidth": 0.8, "zorder": 3.5}
        return [Stroke(corners, style, True)]

    def _span(self, points, span):
        """A zigzag, a damper's line with its box, a rod."""
        a, b = points[list(span.frames)]
        along = b - a
        length = np.linalg.norm(along)
        across = np.array([-along[1], along[0]]) / (length or 1.0)
        thin = {"color": _DARK, "linewidth": 1.1, "zorder": 2.5}
        if span.kind == "spring":
            share = np.r_[0.0, np.linspace(0.15, 0.85, 21), 1.0]
            swing = np.r_[0.0, 0.0, np.tile([1.0, -1.0], 10)[:19], 0.0, 0.0] * 1.6 * self.size
            return [Stroke(a + share[:, None] * along + swing[:, None] * across, thin | {"color": _STEEL})]
        if span.kind in ("damper", "actuator"):
            box = {"color": _STEEL if span.kind == "damper" else COLORS[1], "linewidth": 5.0, "zorder": 2.6}
            middle = np.stack([a + 0.3 * along, a + 0.65 * along])
            return [Stroke(np.stack([a, b]), thin), Stroke(middle, box | {"solid_capstyle": "butt"})]
        return [Stroke(np.stack([a, b]), thin | {"color": _STEEL, "linewidth": 2.0})]

    def _thing(self, k, thing):
        """Surfaces and wheels, threads over them, and the points where they touch."""
        surface = {"color": _STEEL, "linewidth": 1.2, "zorder": 2.3}
        strokes = [Stroke(self.look(points[k]), surface) for points in thing.lines]
        strokes += [Stroke(self._outline_of_ball(x[k], radius), surface) for x, radius in thing.balls]
        thread = {"color": _DARK, "linewidth": 1.4, "zorder": 2.7}
        strokes += [Stroke(self.look(points[k]), thread) for points in thing.threads]
        mark = {"linestyle": "none", "marker": "o", "markersize": 3.5, "color": COLORS[3], "zorder": 4.2}
        return strokes + ([Stroke(self.look(thing.marks[k]), mark)] if thing.marks.shape[1] else [])

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

    def _torsion(self, k, torsion):
        """A spiral about the joint from the parent to the child, which winds up as it turns; for a damper a drum with
        a
        vane: an arc, and a thick part of it that turns with the child."""
        first, second = torsion.joint.frames
        axis = self.trajectory.axes[torsion.joint.name]
        one = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        one /= np.linalg.norm(one)
        other, R = np.cross(axis, one), self.trajectory.R[k, first]
        moved = R.T @ self.trajectory.R[k, second] @ one
        turn = np.arctan2(moved @ other, moved @ one)

        def around(angles, radii):
            flat = radii[:, None] * (np.cos(angles)[:, None] * one + np.sin(angles)[:, None] * other)
            return self.look(self.trajectory.x[k, first] + flat @ R.T)

        thin = {"color": _STEEL, "linewidth": 1.1, "zorder": 3.8}
        if torsion.kind == "spring":
            share = np.linspace(0.0, 1.0, 81)
            return [Stroke(around(share * (5.0 * np.pi + turn), self.size * (0.8 + 2.0 * share)), thin)]
        drum, vane = np.linspace(0.0, 1.5 * np.pi, 41), turn + np.linspace(-0.35, 0.35, 9)
        wide = thin | {"linewidth": 5.0, "solid_capstyle": "butt"}
        radius = 3.4 * self.size
        return [
            Stroke(around(drum, np.full(41, radius)), thin),
            Stroke(around(vane, np.full(9, radius)), wide),
            Stroke(around(np.full(2, turn), np.array([0.0, radius])), thin),
        ]

    def _marks(self, points):
        """Pins as circles, those of the ground on a triangle."""
        open_ = {"linestyle": "none", "clip_on": False}
        pins = sorted(self.pins)
        ground = [f for f in sorted(self.pins | self.ends) if self.top.frame_body[f] < 0]
        foot = dict(marker=6, color="0.35", markersize=9, zorder=1)
        ring = dict(marker="o", color="white", markeredgecolor=_DARK, markersize=5, zorder=4)
        return [
            Stroke(points[ground].reshape(-1, 2), foot | open_),
            Stroke(points[pins].reshape(-1, 2), ring | open_),
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
