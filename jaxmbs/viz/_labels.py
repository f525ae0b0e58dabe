"""Names beside points of a line drawing, where the fewest lines and no other names are."""

import numpy as np

from ._joint_strokes import FOOT

_SIZE = 8.0  # of letters [points]
_DISTANCES = (5.0, 13.0)  # of a name from its point, the second where there is no room [points]
_FAR = 3.0  # points of lines that a name further away is as bad as
_FOOT = np.array([(0, 0), (0, -0.5), (0, -1), (-0.5, -1), (0.5, -1)])  # of its size, below its point
_DISC = np.array([(0, 0), (0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5)])
_STEP = 2.5  # between points of a line that count [points]
# To the right and up of the point, the best first.
_PLACES = ((1, 1), (-1, 1), (1, -1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
_ALIGN = {1: "left", 0: "center", -1: "right"}, {1: "bottom", 0: "center", -1: "top"}
_OUTSIDE = 6.0  # points of lines that a name outside of the axes is as bad as
_ON_A_NAME = 1e3


def write_names(ax, names, strokes) -> None:
    """Write names at points (2,) of the picture; those at one place as one text."""
    root = ax.get_figure(root=True)
    if root.get_layout_engine() is not None:  # which would move the axes when the picture is saved
        root.draw_without_rendering()
    ax.apply_aspect()
    to_points = lambda places: ax.transData.transform(np.reshape(places, (-1, 2))) * 72.0 / root.dpi
    lines = np.concatenate([np.zeros((0, 2)), *(_covered(to_points(stroke.points), stroke) for stroke in strokes)])
    lines, taken, together = lines[np.all(np.isfinite(lines), axis=1)], [], {}
    for name, place in names:
        together.setdefault(tuple(np.round(to_points(place)[0] / 2.0)), (place, []))[1].append(name)
    frame = ax.bbox.get_points() * 72.0 / root.dpi
    for place, group in together.values():
        text, at = ", ".join(group), to_points(place)[0]
        places = [(side, away) for away in _DISTANCES for side in _PLACES]
        boxes = [_box(at, text, *place) for place in places]
        costs = [_cost(box, lines, taken, frame) for box in boxes]
        best = int(np.argmin(np.add(costs, [_FAR * (away > _DISTANCES[0]) for _, away in places])))
        taken.append(boxes[best])
        ((x, y), away), (across, up) = places[best], _ALIGN
        options = {"textcoords": "offset points", "fontsize": _SIZE, "zorder": 5, "ha": across[x], "va": up[y]}
        ax.annotate(text, place, (away * x, away * y), **options)


def _covered(points, stroke):
    """Points on a line, of markers, and within an area."""
    if "marker" in stroke.style:
        shape = _FOOT if stroke.style["marker"] == FOOT else _DISC
        return (points[:, None] + stroke.style["markersize"] * shape).reshape(-1, 2)
    if not stroke.fill:
        return _dense(points)
    closed, middle = np.concatenate([points, points[:1]]), points.mean(axis=0)
    return np.concatenate([_dense(middle + share * (closed - middle)) for share in (1.0, 0.6, 0.2)])


def _dense(points):
    """Points of a line no further apart than a step, those of one point as they are."""
    pieces = [points]
    for a, b in zip(points[:-1], points[1:], strict=True):
        length = np.linalg.norm(b - a)
        if np.isfinite(length) and length > _STEP:
            pieces.append(a + np.linspace(0.0, 1.0, int(length / _STEP) + 1)[:, None] * (b - a))
    return np.concatenate(pieces)


def _box(at, text, side, away):
    """Corners (2, 2) of a text beside a point [points]."""
    from matplotlib.textpath import TextPath

    width = TextPath((0.0, 0.0), text, size=_SIZE).get_extents().width
    size, side = np.array([width, _SIZE]), np.array(side)
    low = at + away * side + size * (side - 1.0) / 2.0
    return np.stack([low, low + size])


def _cost(box, lines, taken, frame):
    """Points of lines that a text would cover, and what else is against a place."""
    low, high = box[0] - 1.0, box[1] + 1.0
    covered = float(np.sum(np.all((lines > low) & (lines < high), axis=1)))
    on_names = sum(bool(np.all((other[0] < high) & (other[1] > low))) for other in taken)
    outside = bool(np.any(low < frame[0]) or np.any(high > frame[1]))
    return covered + _ON_A_NAME * on_names + _OUTSIDE * outside
