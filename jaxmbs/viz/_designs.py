"""Plots of designs: Pareto fronts, limits, and studies of many variables."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..design._optimum import Optimum
from ..design._pareto import ParetoFront
from ..design._polynomial_chaos import PolynomialChaos
from ..design._reliability_result import Reliability
from ..palette import BLUE, COLORS, GREY, RED
from ..status import succeeded
from ..typing import WordedError
from ._canvas import format_axes, get_axes

_ACCOUNTS = ("status", "reason")  # of a study, not of its designs
_MAP = "viridis"


def plot_pareto_front(front: Any, first: str | None = None, second: str | None = None, ax: Any = None) -> Any:
    """Plot a Pareto front, or several by name; designs whose search did not converge are hollow.

    Args:
        front: of `design.pareto`, or the Dataset of `studies.pareto_front` with two objectives; or a dict of fronts
            by name, as of the probabilities with which a load may be passed.
        first, second: labels of the objectives, with their units (default: their names).
        ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for another number of objectives, TypeError for what is no front.
    """
    fronts = front if isinstance(front, dict) else {"": front}
    if not fronts:
        raise ValueError("there is no front to plot: the dict is empty")
    found = [_objectives(one) for one in fronts.values()]
    names = found[0][0]
    ax = get_axes(ax)
    for k, (label, (_, (x, y), ok)) in enumerate(zip(fronts, found, strict=True)):
        color = COLORS[k % len(COLORS)]
        ax.plot(x, y, color=color, linewidth=1.0, zorder=2)
        ax.plot(x[ok], y[ok], "o", color=color, zorder=3, label=label or None)
        ax.plot(x[~ok], y[~ok], "o", color=color, markerfacecolor="white", zorder=3)
    format_axes(ax, names[0] if first is None else first, names[1] if second is None else second, None)
    if isinstance(front, dict):
        ax.legend(frameon=False)
    return ax


def _objectives(front):
    """Names, values (2, points) and verdicts (points,) of a front's two objectives."""
    if isinstance(front, ParetoFront):
        return front.names, (front.first, front.second), np.asarray(front.ok, bool)
    names = getattr(front, "attrs", {}).get("objectives")
    if names is None:
        raise TypeError(
            f"front must be of design.pareto or of studies.pareto_front, not {type(front).__name__}; of a study "
            "take plot_scatter or plot_parallel"
        )
    if len(names) != 2:
        raise ValueError(f"a front of {len(names)} objectives ({', '.join(names)}) is no curve: take plot_parallel")
    values = [np.asarray(front[name], float) for name in names]
    units = [front[name].attrs.get("units", "") for name in names]
    labels = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
    return labels, values, np.ones(len(values[0]), bool)


def plot_limits(optimum: WordedError[Optimum], ax: Any = None) -> Any:
    """Plot the utilisation of each limit, before (line) and after the search; active limits are dark.

    Args: ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for an optimum without limits.
    """
    limits = list(optimum.limits)
    if not limits:
        raise ValueError("the optimum has no limits: give `minimise` limits")
    ax = get_axes(ax, (6.0, 1.1 + 0.5 * len(limits)))
    used = np.array([[_utilisation(limit, limit.before), _utilisation(limit, limit.after)] for limit in limits])
    rows = np.arange(len(limits))[::-1]
    for row, limit, (before, after) in zip(rows, limits, used, strict=True):
        color = RED if not limit.ok else BLUE if limit.active else GREY
        ax.barh(row, 100 * after, 0.5, color=color, alpha=0.9 if limit.active or not limit.ok else 0.45)
        ax.plot([100 * before] * 2, [row - 0.36, row + 0.36], color="0.2", linewidth=1.5)
    ax.axvline(100.0, color="0.2", linewidth=0.9, linestyle=(0, (3, 2)))
    ax.set_yticks(rows, [limit.name for limit in limits])
    ax.set_xlim(min(0.0, 115 * used.min()), max(115.0, 108 * used.max()))
    return format_axes(ax, "used of the limit [%]: bar after, line before", "", None)


def _utilisation(limit, values):
    """Value over bound, one at the bound; one plus the value where the bound is zero."""
    value, bound = float(np.asarray(values)[limit.worst]), float(limit.bound)
    sign = 1.0 if limit.side == "<=" else -1.0
    return 1.0 + sign * (value - bound) / (abs(bound) or 1.0)


def plot_importances(found: WordedError[Reliability | PolynomialChaos], ax: Any = None) -> Any:
    """Plot what each random number contributes, the largest first: importances for a probability of failure, or first
    and total Sobol' shares of a variance, the total ones pale.

    Args: ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for a result without importances.
    """
    shares = found.importances if isinstance(found, Reliability) else found.total
    if not shares:
        raise ValueError("the result has no importances: they belong to design points, which this method has not")
    names = sorted(shares, key=lambda name: -shares[name])
    rows = np.arange(len(names))[::-1]
    ax = get_axes(ax, (6.0, 1.1 + 0.4 * len(names)))
    is_total = not isinstance(found, Reliability)
    ax.barh(rows, [100 * shares[name] for name in names], 0.6, color=BLUE, alpha=0.45 if is_total else 0.9)
    if isinstance(found, PolynomialChaos):
        ax.barh(rows, [100 * found.first[name] for name in names], 0.6, color=BLUE, alpha=0.9)
    ax.set_yticks(rows, names)
    label = "share of the variance [%]: alone, and with others" if is_total else "importance for failure [%]"
    return format_axes(ax, label, "", None)


def plot_parallel(study: Any, names: Sequence[str] | None = None, color: str | None = None, ax: Any = None) -> Any:
    """Plot every design of a study as a line over its variables and answers, each on a scale of its own.

    Args:
        study: the `xarray.Dataset` of `sweep`; designs that failed are left out.
        names: variables and answers in their order (default: all that are one number).
        color: the one that colours the lines (default: the last).
        ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for names that are not there, or no design that is ok.
    """
    table, units = _read_table(study, names)
    color = list(table)[-1] if color is None else color
    if color not in table:
        raise ValueError(f"there is no column {color} to plot; the names are: {', '.join(table)}")
    ax = get_axes(ax, (1.0 + 1.4 * len(table), 3.4))
    columns = np.stack(list(table.values()), axis=1)
    low, high = columns.min(axis=0), columns.max(axis=0)
    scaled = (columns - low) / np.where(high > low, high - low, 1.0)
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection

    numbers, x = table[color], np.arange(len(table))
    order = np.argsort(numbers)
    lines = LineCollection(
        [np.stack([x, row], axis=1) for row in scaled[order]],
        array=numbers[order],
        cmap=_MAP,
        linewidths=0.9,
        alpha=0.7,
    )
    ax.add_collection(lines)
    for k in range(len(table)):
        ax.axvline(k, color="0.3", linewidth=0.8)
        for height, value in ((-0.02, low[k]), (1.02, high[k])):
            ax.text(k, height, f"{value:.4g}", ha="center", va="top" if height < 0 else "bottom", fontsize="small")
    ax.set_xticks(x, [f"{name}\n{units[name]}" for name in table])
    ax.tick_params(axis="x", length=0, pad=12)
    ax.set_yticks([])
    ax.set_xlim(-0.3, len(table) - 0.7)
    ax.set_ylim(-0.03, 1.1)
    ax.spines[:].set_visible(False)
    ax.figure.colorbar(ScalarMappable(lines.norm, _MAP), ax=ax, pad=0.02, label=f"{color} {units[color]}".strip())
    return ax


def plot_scatter(study: Any, names: Sequence[str] | None = None, ax: Any = None) -> Any:
    """Plot every pair of variables and answers of a study as points, histograms on the diagonal.

    Args: as of `plot_parallel`; ax becomes the one at the upper left.

    Raises: ValueError for names that are not there, or no design that is ok.
    """
    table, units = _read_table(study, names)
    n = len(table)
    ax = get_axes(ax, (1.6 * n + 0.8, 1.6 * n + 0.4))
    for (i, below), (j, beside), room in _axes_grid(ax, list(table)):
        if i == j:
            room.hist(table[beside], bins=16, color=BLUE, alpha=0.7)
            room.set_yticks([])
        else:
            room.plot(table[beside], table[below], ".", color=BLUE, markersize=3, alpha=0.6)
            room.locator_params(nbins=3)
        room.spines[["top", "right"]].set_visible(False)
        room.tick_params(labelsize="x-small", labelleft=j == 0 and i > 0, labelbottom=i == n - 1)
        room.set_xlabel(f"{beside} {units[beside]}".strip() if i == n - 1 else "", fontsize="small")
        room.set_ylabel(f"{below} {units[below]}".strip() if j == 0 else "", fontsize="small")
    return ax


def _axes_grid(ax, names):
    """Axes for every pair, in the place of `ax`."""
    place, n, figure = ax.get_subplotspec(), len(names), ax.figure
    grid = None if place is None else place.subgridspec(n, n, wspace=0.12, hspace=0.12)
    left, bottom, width, height = ax.get_position().bounds
    for i, below in enumerate(names):
        for j, beside in enumerate(names):
            box = (left + j * width / n, bottom + (n - 1 - i) * height / n, 0.88 * width / n, 0.88 * height / n)
            if i == j == 0:
                room = ax
                room.set_subplotspec(grid[0, 0]) if grid is not None else room.set_position(box)
            else:
                room = figure.add_subplot(grid[i, j]) if grid is not None else figure.add_axes(box)
            yield (i, below), (j, beside), room


def _read_table(study, names):
    """Numbers (designs,) by name of the successful designs, and their units."""
    dims = study["status"].dims
    numeric = [name for name in study.data_vars if study[name].dtype.kind in "fiu" and study[name].dims == dims]
    known = [*(dim for dim in dims if dim in study.coords and dim != "design"), *numeric]
    wanted = [name for name in known if name not in _ACCOUNTS] if names is None else list(names)
    missing = [name for name in wanted if name not in known]
    if missing or not wanted:
        raise ValueError(f"there is no column {', '.join(missing)} to plot; the names are: {', '.join(known)}")
    columns = {name: (study[name] + 0.0 * study["status"]).transpose(*dims).values.ravel() for name in wanted}
    ok = np.all([np.isfinite(column) for column in columns.values()], axis=0)
    ok = ok & succeeded(study["status"].values.ravel())
    if not np.any(ok):
        raise ValueError("no design of the study succeeded")
    units = {name: f"[{study[name].attrs['units']}]" if "units" in study[name].attrs else "" for name in wanted}
    return {name: np.asarray(column[ok], float) for name, column in columns.items()}, units
