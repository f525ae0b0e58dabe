"""Plot of branches of cycles: a number of each over the parameter, stable ones as full lines."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..assembly._state_report import coordinate_names
from ..checks import place_of
from ..cycles._branch import Branch
from ..cycles._cycle import Cycle
from ..errors import ModelError
from ..joints._coordinate_units import coordinate_units
from ._canvas import curve_style, format_axes, get_axes

#: Marks of the points by kind.
_MARKS = {"fold": "o", "period doubling": "D", "torus": "s", "branch point": "^"}


def plot_branches(
    branches: Branch | Sequence[Branch], of: str | Callable[[Cycle], Any], ax: Any = None, *, label: str | None = None
) -> Any:
    """Plot branches of cycles over their parameter: full lines where they are stable, dashed ones elsewhere.

    Marks are at folds, period doublings, torus points and crossings.

    Args:
        of: name of a coordinate, whose largest size over the cycle is drawn; or a function of a `Cycle` to a number.
        ax: matplotlib axes to draw into (default: new ones); label: of the ordinate.

    Raises: ModelError for what is no branch; UnknownNameError.
    """
    branches = [branches] if isinstance(branches, Branch) else list(branches)
    if not branches or not all(isinstance(branch, Branch) for branch in branches):
        raise ModelError(["branches= takes what cycles_along returned, one or several"], "the plot")
    ax, marked = get_axes(ax), set()
    for k, branch in enumerate(branches):
        x, y, stable = np.asarray(branch.values), _numbers(branch, of), np.asarray(branch.stable)
        color = curve_style(k)["color"]
        for kind, shown in (("-", stable), ((0, (3, 2)), ~stable)):
            both = shown[:-1] & shown[1:] | _neighbours(branch, shown)
            for run in _runs(both):  # one line each: dashes that begin anew at every cycle look like a full line
                ax.plot(x[run], y[run], color=color, linestyle=kind, linewidth=1.4)
        for point in branch.points:
            words = None if point.kind in marked else point.kind
            marked.add(point.kind)
            style = {"color": color, "markerfacecolor": "white", "linestyle": "none", "zorder": 3}
            ax.plot(x[point.place], y[point.place], marker=_MARKS[point.kind], label=words, **style)
    words = label or (f"largest |{of}| [{_unit(branches[0], of)}]" if isinstance(of, str) else "")
    return format_axes(ax, branches[0].name, words, "beside" if marked else None)


def _neighbours(branch, shown):
    """True (K - 1,) for intervals between a point of the branch, of either kind of stability, and such a cycle."""
    marked = np.zeros(len(shown), bool)
    marked[[point.place for point in branch.points]] = True
    return (marked[:-1] & shown[1:]) | (shown[:-1] & marked[1:])


def _runs(shown):
    """Places of the cycles of intervals (K - 1,) that are shown and follow each other."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(int)))
    return [slice(first, last + 1) for first, last in edges.reshape(-1, 2)]


def _unit(branch, of):
    """Unit of a coordinate."""
    states, count = branch.cycles.states, branch.cycles.states.coordinates.shape[-1]
    names, layout = coordinate_names(states.structure, count), states.structure or (("", "", count, 0, ()),)
    units = [unit for _, kind, size, _, _ in layout for unit in coordinate_units(kind, size)]
    return units[place_of("coordinate", of, names)]


def _numbers(branch, of):
    """Numbers (K,) of all cycles."""
    if callable(of):
        return np.array([float(np.asarray(of(branch[k]))) for k in range(len(branch))])
    states = branch.cycles.states
    names = coordinate_names(states.structure, states.coordinates.shape[-1])
    place = place_of("coordinate", of, names)
    return np.max(np.abs(np.asarray(states.coordinates[..., place])), axis=-1)
