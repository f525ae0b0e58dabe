"""Plots of vibrations: frequency responses, Campbell diagrams, modal assurance criteria."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..linear._transfer import TransferFunctions
from ..typing import ArrayLike
from ..vibration._modes import Modes
from ._canvas import curve_style, draw_curves, format_axes, get_axes, stack_axes

_PER_FORCE = {"receptance": "m/N", "mobility": "m/(N s)", "accelerance": "m/(N s$^2$)"}


def plot_bode(functions: TransferFunctions, ax: Any = None, *, unit: str | None = None) -> Any:
    """Bode diagram: magnitude and phase of transfer functions over frequency [Hz], a curve for every pair.

    Args:
        ax: matplotlib axes to draw into (default: new ones); they become the upper ones.
        unit: of the values (default: by kind, of displacements by forces).
    """
    rooms, curves = stack_axes(get_axes(ax, (7.0, 4.8)), (3, 2)), _channels(functions)
    hertz = np.asarray(functions.omega) / (2 * np.pi)
    for k, (name, values) in enumerate(curves.items()):
        rooms[0].loglog(hertz, np.abs(values), label=name, **curve_style(k))
        rooms[1].plot(hertz, np.degrees(np.angle(values)), **curve_style(k))
    unit = _PER_FORCE[functions.kind] if unit is None else unit
    format_axes(rooms[0], "", f"{functions.kind} [{unit}]", "beside" if len(curves) > 1 else None)
    format_axes(rooms[1], "frequency [Hz]", "phase [deg]", None)
    rooms[1].set_yticks(range(-180, 181, 90))
    rooms[1].set_ylim(-195, 195)
    return rooms[0]


def plot_nyquist(functions: TransferFunctions, ax: Any = None, *, unit: str | None = None) -> Any:
    """Nyquist diagram: transfer functions in the complex plane; resonances are circles.

    Args: as of `plot_bode`.
    """
    ax, curves = get_axes(ax, (4.6, 4.2)), _channels(functions)
    unit = _PER_FORCE[functions.kind] if unit is None else unit
    for k, (name, values) in enumerate(curves.items()):
        ax.plot(values.real, values.imag, label=name, **curve_style(k))
    ax.axhline(0.0, color="0.7", linewidth=0.7, zorder=0)
    ax.axvline(0.0, color="0.7", linewidth=0.7, zorder=0)
    ax.ticklabel_format(style="sci", scilimits=(-2, 3))
    ax.set_aspect("equal", adjustable="datalim")
    return format_axes(ax, f"real part [{unit}]", f"imaginary part [{unit}]", "beside" if len(curves) > 1 else None)


def _channels(functions):
    """Values (frequencies,) by "output / input"."""
    values = np.asarray(functions.values)
    pairs = [(i, j) for i in range(values.shape[1]) for j in range(values.shape[2])]
    return {f"{functions.outputs[i]} / {functions.inputs[j]}": values[:, i, j] for i, j in pairs}


def plot_campbell(
    speeds: ArrayLike, modes: ArrayLike | Sequence[Modes], orders: Iterable[float | int] = (1.0, 2.0), ax: Any = None
) -> Any:
    """Campbell diagram: frequencies [Hz] over a speed of rotation [rad/s], and lines of its orders.

    Args:
        speeds: (S,); modes: frequencies (S, m) [Hz], or the `Modes` at every speed, as many at each (`track_modes`
            keeps their order).
        orders: excitations in a turn.
        ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for frequencies of another shape.
    """
    speeds = np.asarray(speeds, float)
    given = modes if isinstance(modes, list | tuple) else list(np.asarray(modes))
    hertz = np.array([np.asarray(one.frequencies if isinstance(one, Modes) else one) for one in given], float)
    if hertz.ndim != 2 or len(hertz) != len(speeds):
        raise ValueError(f"frequencies must have the shape ({len(speeds)}, modes), not {hertz.shape}")
    ax = get_axes(ax)
    for order in orders:
        line = order * speeds / (2 * np.pi)
        ax.plot(speeds, line, color="0.6", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    top = 1.08 * np.max(hertz)
    ax.set_ylim(0.0, top)
    for order in orders:
        _order_label(ax, speeds, order, top, hertz)
    draw_curves(ax, speeds, {f"mode {k + 1}": hertz[:, k] for k in range(hertz.shape[1])})
    return format_axes(ax, "speed [rad/s]", "frequency [Hz]", "beside")


def _order_label(ax, speeds, order, top, hertz):
    """Write "2×" into the line of an order, where it is furthest from the curves (S, m)."""
    end = min(speeds[-1], 2 * np.pi * 0.95 * top / order) if order > 0 else speeds[-1]
    along = np.linspace(speeds[0] + 0.3 * (end - speeds[0]), end, 40)
    own = order * along / (2 * np.pi)
    apart = [np.abs(own - np.interp(along, speeds, curve)) for curve in hertz.T]
    best = int(np.argmax(np.min(apart, axis=0))) if apart else -1
    style = {"ha": "center", "va": "center", "fontsize": "small", "color": "0.4"}
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    ax.text(along[best], own[best], f"{order:g}×", bbox=box, zorder=1.5, **style)


def plot_mac(values: ArrayLike, ax: Any = None, *, rows: str = "mode", columns: str = "mode") -> Any:
    """Plot modal assurance criteria (m, k) of `mac` as coloured squares, with numbers if there is room.

    Args: ax: matplotlib axes to draw into (default: new ones); rows, columns: what the two sets are called.

    Raises: ValueError for another shape.
    """
    values = np.asarray(values, float)
    if values.ndim != 2:
        raise ValueError(f"criteria must have the shape (modes, modes), not {values.shape}")
    ax = get_axes(ax, (4.6, 3.8))
    m, k = values.shape
    shown = ax.imshow(values, cmap="Blues", vmin=0.0, vmax=1.0, origin="lower", extent=(0.5, k + 0.5, 0.5, m + 0.5))
    if max(m, k) <= 8:
        for (i, j), value in np.ndenumerate(values):
            color = "white" if value > 0.6 else "0.3"
            ax.text(j + 1, i + 1, f"{value:.2f}", ha="center", va="center", fontsize="x-small", color=color)
    ax.set_xticks(range(1, k + 1))
    ax.set_yticks(range(1, m + 1))
    ax.figure.colorbar(shown, ax=ax, label="MAC")
    ax.set_xlabel(columns)
    ax.set_ylabel(rows)
    return ax
