"""Axes to draw into, in the look of the house."""

from ..palette import COLORS

_DASHES = ("-", "--", ":", "-.")
_FEW = 6  # names that a legend within the axes may hold


def axes(ax=None, size=None):
    """The axes given, or new ones in a figure of this size [inch]; matplotlib is loaded here and not before.

    Raises: ModuleNotFoundError without matplotlib; it is in the extra `viz`.
    """
    if ax is None:
        from matplotlib import pyplot

        _, ax = pyplot.subplots(figsize=size, layout="constrained")
    return ax


def stacked(ax, heights) -> list:
    """Axes of these relative heights one above the other, with one time axis, in the room of `ax`, the first."""
    place, figure = ax.get_subplotspec(), ax.figure
    if place is not None:
        rooms = place.subgridspec(len(heights), 1, height_ratios=heights)
        ax.set_subplotspec(rooms[0])
        panels = [ax, *(figure.add_subplot(rooms[i], sharex=ax) for i in range(1, len(heights)))]
    else:  # placed by hand
        left, bottom, width, height = ax.get_position().bounds
        unit, panels = 0.9 * height / sum(heights), [ax]
        gap = 0.1 * height / max(len(heights) - 1, 1)
        top = bottom + height
        ax.set_position((left, top - unit * heights[0], width, unit * heights[0]))
        for i in range(1, len(heights)):
            low = top - unit * sum(heights[: i + 1]) - gap * i
            panels.append(figure.add_axes((left, low, width, unit * heights[i]), sharex=ax))
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    return panels


def curve(i: int) -> dict:
    """Colour and dashes of curve number i; they repeat after 24."""
    return {"color": COLORS[i % len(COLORS)], "linestyle": _DASHES[i // len(COLORS) % len(_DASHES)]}


def finish(ax, x_label, y_label, legend="inside"):
    """Labels, a light grid, a legend where there is something to tell apart; returns the axes.

    Args:
        legend: "inside" the axes, unless there are many names, "beside" them, or None.
    """
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    if legend:
        _name_curves(ax, legend)
    return ax


def _name_curves(ax, where):
    """A legend; one beside the axes needs a figure that makes room for it, by a layout."""
    count = len(ax.get_legend_handles_labels()[0])
    if count and (where == "beside" or count > _FEW) and ax.figure.get_layout_engine() is not None:
        beside = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.02), "borderaxespad": 0.0}
        rows = 8 if where == "beside" else 20
        ax.legend(frameon=False, fontsize="small", ncols=1 + (count - 1) // rows, **beside)
    elif count:
        size = "small" if where == "beside" or count > _FEW else None
        ax.legend(framealpha=0.6, edgecolor="none", fontsize=size, ncols=1 + (count - 1) // _FEW)
