"""Axes to draw into, in the look of the house."""

BLUE, ORANGE, GREEN, VIOLET, RED, GREY = COLORS = ("#1f5f8b", "#c7752b", "#3f8f5b", "#7a4d8f", "#b0413e", "#5b6770")


def axes(ax=None):
    """The axes given, or new ones; matplotlib is loaded here and not before.

    Raises: ModuleNotFoundError without matplotlib; it is in the extra `viz`.
    """
    if ax is None:
        from matplotlib import pyplot

        _, ax = pyplot.subplots(layout="constrained")
    return ax


def finish(ax, x_label, y_label, legend=True):
    """Labels, a light grid, a legend where there is something to tell apart; returns the axes."""
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    if legend and ax.get_legend_handles_labels()[0]:
        ax.legend(frameon=False)
    return ax
