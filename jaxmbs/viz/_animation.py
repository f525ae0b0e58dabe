"""`animate`: a motion or a mode as GIF or MP4."""

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..linear._system import LinearSystem
from ..model._system import System
from ..typing import ScalarLike
from ._canvas import get_axes
from ._line_drawing import LineDrawing
from ._mechanism import draw_strokes, format_view, move_strokes
from ._mesh import moving_meshes
from ._projection import read_projection
from ._structure import draw_moving
from .scenes._trajectory import frame_trajectory

_SHORTEST = 2.0  # seconds that an animation lasts at least: shorter ones cannot be followed


def animate(
    system: System | LinearSystem,
    motion: Any,
    path: str | PathLike,
    plane: str | None = None,
    *,
    fps: int = 20,
    speed: ScalarLike | None = None,
    structures: Any = None,
    ax: Any = None,
    dpi: int = 90,
) -> Path:
    """Write an animation of a mechanism, structure or network: ".gif", or ".mp4" if ffmpeg is installed.

    Args:
        motion, structures: as of `scene`.
        plane: as of `plot_mechanism` (default: "xy" of a mechanism, "iso" of meshes).
        fps: pictures in a second of the animation.
        speed: seconds of the motion in one of the animation (default: real time, slower if it lasts less than 2 s).
        ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for another ending or plane; RuntimeError for MP4 without ffmpeg.
    """
    path, look = Path(path), read_projection(plane or ("xy" if isinstance(system, System) else "iso"))
    writer = _writer(path, fps)
    new = ax is None
    ax = get_axes(ax, (5.0, 4.0))
    artist = _mechanism_artist if isinstance(system, System) else _structure_artist
    ts, show = artist(ax, system, motion, look, structures)
    span = ts[-1] - ts[0]
    wanted = span / speed if speed else max(span, _SHORTEST)
    if getattr(motion, "frequency", None) is not None:
        wanted = _SHORTEST
    shares = np.linspace(ts[0], ts[-1], max(2, round(fps * wanted))) if span > 0 else ts[:1]
    text = ax.text(0.01, 0.99, "", transform=ax.transAxes, va="top", fontsize=9, family="monospace")
    with writer.saving(ax.figure, str(path), dpi):
        for t in shares:
            show(int(np.argmin(np.abs(ts - t))))
            text.set_text(
                f"{t:.3f} s" if getattr(motion, "frequency", None) is None else f"{motion.frequency:.4g} Hz"
            )
            writer.grab_frame()
    if new:
        from matplotlib import pyplot

        pyplot.close(ax.figure)
    return path


def _writer(path, fps):
    from matplotlib import animation

    kinds = {".gif": "pillow", ".mp4": "ffmpeg"}
    if path.suffix not in kinds:
        raise ValueError(f"the path must end with .gif or .mp4, not {path.suffix!r}")
    if not animation.writers.is_available(kinds[path.suffix]):
        raise RuntimeError(f"{path.suffix} files are written by {kinds[path.suffix]}, which is not installed")
    return animation.writers[kinds[path.suffix]](fps=fps)


def _mechanism_artist(ax, system, motion, look, structures):
    """Times and a function that shows one of them, in axes whose limits contain all of them."""
    seen = frame_trajectory(system, motion)
    drawing = LineDrawing(system, seen, look)
    drawn = draw_strokes(ax, drawing.at(0))
    joined = sorted({frame for frames in drawing.shown.values() for frame in frames})
    _fix_limits(ax, look(seen.x[:, joined]), look)
    return seen.ts, lambda k: move_strokes(drawn, drawing.at(k))


def _structure_artist(ax, system, motion, look, structures):
    x = np.asarray(getattr(motion, "displacement", motion), float)
    meshes = list(moving_meshes(system, x, structures).values())
    largest = max(float(np.max(np.linalg.norm(u, axis=-1))) for _, u in meshes)
    show = draw_moving(ax, meshes, look, largest)
    _fix_limits(ax, np.concatenate([look(mesh.rest + u).reshape(-1, 2) for mesh, u in meshes]), look)
    return np.asarray(getattr(motion, "ts", np.arange(len(x))), float), show


def _fix_limits(ax, points, look):
    format_view(ax, look)
    flat = points.reshape(-1, 2)
    middle, half = (flat.max(axis=0) + flat.min(axis=0)) / 2, 0.56 * max(np.ptp(flat, axis=0).max(), 1e-9)
    near = np.maximum(0.6 * np.ptp(flat, axis=0), 0.25 * half)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(middle[0] - near[0], middle[0] + near[0])
    ax.set_ylim(middle[1] - near[1], middle[1] + near[1])
