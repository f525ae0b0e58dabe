"""Bearing loads: polar diagrams, and the envelope of many cases."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..palette import BLUE, RED
from ..reaction._result import Reactions
from ..typing import ArrayLike, ScalarLike, WordedError
from ._canvas import curve_style, format_axes, get_axes
from ._plots import check_joint_names
from ._projection import axes_suffix, read_projection


def plot_polar(
    loads: WordedError[Reactions],
    joints: str | Sequence[str],
    plane: str = "xy",
    ax: Any = None,
    *,
    kilo: bool = False,
) -> Any:
    """Polar diagram of a bearing's force: the path of its tip, the start as a dot.

    Args:
        loads: `reactions` along a motion; joints: one name or several.
        plane: axes to the right and up, "xy", "xz", ...: of the world, or of the joints as the loads are.
        ax: matplotlib axes to draw into (default: new ones); kilo: in kN.

    Raises: ValueError for unknown joints or an unknown plane.
    """
    names = [joints] if isinstance(joints, str) else list(joints)
    check_joint_names(names, dict(loads.items()))
    look, ax, unit = read_projection(plane), get_axes(ax, (4.2, 4.2)), 1e-3 if kilo else 1.0
    paths = {name: unit * look(np.asarray(loads[name].force)) for name in names}
    largest = max(float(np.nanmax(np.linalg.norm(path, axis=-1))) for path in paths.values()) or 1.0
    _draw_circles(ax, largest)
    for k, (name, path) in enumerate(paths.items()):
        ax.plot(*path.T, label=name, **curve_style(k))
        ax.plot(*path[0], "o", color=curve_style(k)["color"], markersize=5)
    ax.set_aspect("equal", adjustable="datalim" if ax.get_subplotspec() is None else "box")
    label = "force {}" + axes_suffix(loads) + " [" + "k" * kilo + "N]"
    format_axes(ax, label.format(plane[0]), label.format(plane[1]), "beside" if len(names) > 1 else None)
    ax.grid(False)
    return ax


def _draw_circles(ax, largest):
    """Draw circles at round values of the force."""
    step = 10.0 ** np.floor(np.log10(largest))
    step *= next(k for k in (0.2, 0.5, 1.0, 2.0) if largest / (k * step) <= 5)
    angle = np.linspace(0.0, 2 * np.pi, 121)
    radii = np.arange(step, 1.001 * largest + step, step)
    for radius in radii:
        ax.plot(radius * np.cos(angle), radius * np.sin(angle), color="0.85", linewidth=0.7, zorder=0)
    ax.axhline(0.0, color="0.85", linewidth=0.7, zorder=0)
    ax.axvline(0.0, color="0.85", linewidth=0.7, zorder=0)
    ax.set_xlim(-1.04 * radii[-1], 1.04 * radii[-1])
    ax.set_ylim(-1.04 * radii[-1], 1.04 * radii[-1])


def plot_envelope(
    x: ArrayLike,
    values: ArrayLike,
    label: str = "",
    x_label: str = "time [s]",
    limit: ScalarLike | None = None,
    ax: Any = None,
) -> Any:
    """Plot the range of many cases or designs, their median, and the case with the largest value.

    Args:
        x: (T,) times or whatever the values are over; values: (cases, T), nan where a case failed.
        label: what they are, with the unit; x_label: what x is.
        limit: a line that none should pass.
        ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for other shapes, or no case that is finite.
    """
    x, values = np.asarray(x), np.asarray(values, float)
    if values.ndim != 2 or values.shape[1:] != x.shape:
        raise ValueError(f"values must have the shape (cases, {len(x)}), not {values.shape}")
    kept = np.flatnonzero(np.all(np.isfinite(values), axis=1))
    if len(kept) == 0:
        raise ValueError("no case has finite values")
    ax, shown = get_axes(ax), values[kept]
    worst = int(np.argmax(np.max(np.abs(shown), axis=1)))
    range_ = f"{len(kept)} cases" + (f", {len(values) - len(kept)} failed" if len(kept) < len(values) else "")
    ax.fill_between(x, shown.min(axis=0), shown.max(axis=0), color=BLUE, alpha=0.2, linewidth=0, label=range_)
    ax.plot(x, np.median(shown, axis=0), color=BLUE, label="median")
    ax.plot(x, shown[worst], color=RED, linewidth=1.2, linestyle=(0, (4, 2)), label=f"case {kept[worst]}")
    if limit is not None:
        ax.axhline(limit, color="0.2", linewidth=0.9, linestyle=(0, (1, 2)), label="limit")
    return format_axes(ax, x_label, label, "beside")
