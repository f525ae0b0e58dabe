"""Line drawings of a mechanism in one pose or several, in one view or three."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..assembly._state import State
from ..checks import no_such
from ..errors import UnknownNameError
from ..model._system import System
from ..palette import COLORS
from ._canvas import get_axes, split_columns
from ._element_arrows import arrows_along
from ._labels import write_names
from ._line_drawing import LineDrawing
from ._projection import read_projection
from .scenes._trajectory import frame_trajectory

_SLENDER = np.array([0.5, 0.35])  # least width of a picture over its height, and height over width
_MOST_POSES = 8  # more of one machine in a picture are a web


def plot_mechanism(
    system: System,
    states: Any,
    plane: str = "xy",
    frames: Iterable[str] | None = None,
    ax: Any = None,
    *,
    names: bool = False,
    traces: Iterable[str] = (),
    poses: int | None = None,
    loads: bool = False,
) -> Any:
    """Draw a mechanism; of several poses the first is drawn strongest.

    Bodies are lines through their joints and named frames, pins circles, slides blocks on rails, cylinders barrel and
    rod; springs and dampers have their symbols.  Cables run along their tangents and around their wheels;
    contacts show their surfaces and the points that touch.

    Args:
        states: a State, several with one leading axis, a motion, or a mode by `animate_mode`.
        plane: the two world axes to look at, "xy", "xz", "yz", in the order right, up; or "iso", over the corner.
        frames: names of frames to show beside the joints (default: all that the user named).
        ax: matplotlib axes to draw into (default: new ones).
        names: write the names of joints beside them, at the first pose.
        traces: names of frames or bodies whose path over all instants is drawn.
        poses: number of instants that are drawn, evenly spread (default: all, of more than eight so many).
        loads: draw as arrows the forces at points of contact, on the round part, and of cables on the bodies of
            their elements; they need states, not a mode.

    Raises: ValueError for an unknown plane or no pose; UnknownNameError for traces.
    """
    look = read_projection(plane)
    known = system.topology.frame_index
    wrong = [no_such("frame or body", name, known) for name in traces if name not in known]
    if wrong:
        raise UnknownNameError("; ".join(wrong))
    if poses is not None and poses < 1:
        raise ValueError(f"poses = {poses}: at least one is needed")
    ax, seen = get_axes(ax), frame_trajectory(system, states)
    drawing = LineDrawing(system, seen, look, frames, arrows_along(system, states) if loads else None)
    poses = min(len(seen.ts), _MOST_POSES) if poses is None else poses
    instants = np.unique(np.linspace(0, len(seen.ts) - 1, poses).round().astype(int))
    strengths = np.linspace(1.0, 0.25, len(instants)) if len(instants) > 1 else [1.0]
    for k, strength in reversed(list(zip(instants.tolist(), strengths, strict=True))):
        draw_strokes(ax, drawing.at(k), strength)
    for k, name in enumerate(traces):
        path = look(seen.x[:, known[name]])
        ax.plot(*path.T, color=COLORS[k % len(COLORS)], linewidth=1.0, linestyle=":", zorder=1.5)
    format_view(ax, look, 0.18 if names else 0.1)
    if names:
        write_names(ax, drawing.name_places(), drawing.at(0))
    return ax


def plot_views(
    system: System, states: Any, planes: Iterable[str] = ("xz", "yz", "xy"), ax: Any = None, **options: Any
) -> Any:
    """Draw a mechanism in several views beside each other, by `plot_mechanism`.

    Args:
        planes: of each picture, as of `plot_mechanism`, which takes the other options too.
        ax: matplotlib axes to draw into (default: new ones); they become the leftmost.

    Raises: ValueError for an unknown plane or none.
    """
    planes = list(planes)
    if not planes:
        raise ValueError("planes is empty: give at least one")
    ax = get_axes(ax, (3.2 * len(planes), 3.2))
    for room, plane in zip(split_columns(ax, len(planes)), planes, strict=True):
        plot_mechanism(system, states, plane, ax=room, **options)
    return ax


def draw_strokes(ax, strokes, strength=1.0) -> list:
    """Draw strokes; returns the artists, for `move_strokes`."""
    drawn = []
    for points, style, fill in strokes:
        if fill:
            drawn += ax.fill(*points.T, alpha=strength, **style)
        else:
            drawn += ax.plot(*points.T, alpha=strength, **style)
    return drawn


def move_strokes(drawn, strokes) -> None:
    """Move artists to other strokes."""
    for artist, stroke in zip(drawn, strokes, strict=True):
        artist.set_xy(stroke.points) if stroke.fill else artist.set_data(*stroke.points.T)


def format_view(ax, look, margin=0.1):
    """Set equal scales, a margin around what is drawn, and labels if the view is along an axis."""
    ax.set_aspect("equal", adjustable="box")
    ax.margins(margin)
    low, high = ax.dataLim.get_points()
    size, middle = high - low, (low + high) / 2
    if np.all(np.isfinite(size)) and np.max(size) > 0:
        half = np.maximum(size, _SLENDER * np.max(size)) / 2
        ax.update_datalim([middle - half, middle + half])
        across, up = np.maximum(np.round(6 * 2 * half / np.max(size) - 2), (1, 2)).astype(int)
        ax.locator_params(axis="x", nbins=across, min_n_ticks=1)  # in a slender picture numbers would overlap
        ax.locator_params(axis="y", nbins=up)
        ax.autoscale_view()
    if look.labels is None:
        ax.set(xticks=[], yticks=[])
        ax.spines[:].set_visible(False)
        return ax
    ax.set_xlabel(look.labels[0])
    ax.set_ylabel(look.labels[1])
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def frame_positions(system: System, states: State) -> np.ndarray:
    """World positions (poses, frames, 3) [m] of all frames, those of joints included, at a state or several."""
    return frame_trajectory(system, states).x
