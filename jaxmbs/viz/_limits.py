"""Plot of limit values against peaks of the full transient."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..coupling._limit_loads import truncation_shortfall
from ..palette import COLORS
from ..typing import ArrayLike
from ._canvas import format_axes, get_axes


def plot_limit_values(limits: Any, truth: Any, cases: Sequence | ArrayLike | None = None, ax: Any = None) -> Any:
    """Plot quotients limit / truth over cases; the legend gives the share of cases below one, and the worst.

    Args:
        limits: limit values (cases,) by name of the sum.
        truth: peaks of the full transient (cases,).
        cases: abscissa (cases,), default their number.
        ax: matplotlib axes to draw into (default: new ones).
    """
    ax = get_axes(ax)
    x = np.arange(len(truth)) if cases is None else np.asarray(cases)
    for (name, values), color in zip(limits.items(), COLORS, strict=False):
        found = truncation_shortfall(values, truth)
        label = f"{name}: short in {float(found.share):.0%}, at worst by {float(found.worst):.0%}"
        ax.plot(x, np.asarray(found.quotient), ".-", color=color, label=label)
    ax.axhline(1.0, color="0.6", linewidth=0.8)
    ax.set_yscale("log")
    if cases is None:
        ax.xaxis.get_major_locator().set_params(integer=True)
    return format_axes(ax, "case", "limit value / peak of the transient")
