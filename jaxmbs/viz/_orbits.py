"""Plot of orbits of a rotor: the ellipses of a station, or of a bearing's force, at some speeds."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import ModelError
from ..rotors._unbalance import Orbit
from ..tables import format_number
from ..typing import ScalarLike, WordedError
from ._canvas import curve_style, format_axes, get_axes

_MOST = 5  # ellipses by default


def plot_orbits(
    orbit: WordedError[Orbit],
    at: Sequence[ScalarLike] | None = None,
    ax: Any = None,
    *,
    label: str | None = None,
    unit: str = "m",
) -> Any:
    """Plot the ellipses of an orbit, seen along the shaft, with arrows in their sense.

    Args:
        orbit: `response.orbit(station)` or `response.bearing_orbit(bearing)`.
        at: speeds [rad/s], each drawn at the nearest one of the orbit's (default: the one of the largest ellipse, and
            four at equal distances).
        ax: matplotlib axes to draw into (default: new ones); label: of both axes, x and y before it; unit: of the
            half axes, "N" for forces.

    Raises: ModelError for what is no orbit, or for speeds beyond its own.
    """
    if not isinstance(orbit, Orbit):
        raise ModelError(["orbit= takes response.orbit(station) or response.bearing_orbit(bearing)"], "the plot")
    ax = get_axes(ax)
    phase = np.linspace(0.0, 2.0 * np.pi, 181)
    for i, k in enumerate(_places(orbit, at)):
        a, b, angle = (float(x[k]) for x in (orbit.major, orbit.minor, orbit.angle))
        if not np.isfinite(a + b + angle):
            continue
        z = np.exp(1j * angle) * (a * np.cos(phase) + 1j * b * np.sin(phase))
        words = f"{format_number(orbit.speeds[k])} rad/s{'' if b > 0.0 else ', backward' if b < 0.0 else ', a line'}"
        style = curve_style(i)
        ax.plot(z.real, z.imag, label=words, **style)
        arrow = {"arrowstyle": "-|>", "color": style["color"], "shrinkA": 0.0, "shrinkB": 0.0}
        ax.annotate("", (z[1].real, z[1].imag), (z[0].real, z[0].imag), arrowprops=arrow)
    ax.set_aspect("equal", adjustable="datalim")
    ax.ticklabel_format(scilimits=(-2, 4))
    ax.locator_params(nbins=5)
    what = label or ("force" if unit == "N" else "deflection")
    return format_axes(ax, f"x {what} [{unit}]", f"y {what} [{unit}]", "beside")


def _places(orbit, at):
    """Places of the speeds to be drawn.  Raises: ModelError."""
    speeds, major = np.asarray(orbit.speeds), np.nan_to_num(np.asarray(orbit.major))
    if at is None:
        few = np.linspace(0, len(speeds) - 1, _MOST - 1).round().astype(int)
        return sorted({*few.tolist(), int(np.argmax(major))})
    wanted = np.atleast_1d(np.asarray(at, float))
    if wanted.ndim != 1 or not np.all((wanted >= speeds.min()) & (wanted <= speeds.max())):
        low, high = format_number(speeds.min()), format_number(speeds.max())
        raise ModelError([f"at={at} must be speeds between {low} and {high} rad/s, those of the orbit"], "the plot")
    return [int(np.argmin(np.abs(speeds - w))) for w in wanted]
