"""Plots over time or over a coordinate: coordinates, reactions, energies, histories of searches."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..design._optimum import Optimum
from ..model._system import System
from ..motion._motion import Motion, events_shown
from ..palette import BLUE, GREEN, RED
from ..reaction._result import Reactions
from ..typing import ArrayLike, WordedError
from ._canvas import curve_style, draw_curves, format_axes, get_axes, stack_axes
from ._projection import axes_suffix

#: Quantities of coordinates and of velocities by the unit of the coordinate.
_COORDINATES = {"rad": "angle [rad]", "m": "distance [m]", "": "quaternion", "m kg^1/2": "mode [m kg$^{1/2}$]"}
_RATES = {"rad": "rate [rad/s]", "m": "speed [m/s]", "m kg^1/2": "rate [m kg$^{1/2}$/s]"}


def plot_coordinates(
    system: System,
    motion: WordedError[Motion],
    joints: Sequence[str] | None = None,
    ax: Any = None,
    *,
    over: str | None = None,
    degrees: bool = False,
    velocities: bool = False,
) -> Any:
    """Plot joint coordinates along a motion, in stacked axes, one for each unit.

    Args:
        joints: names (default: all that have coordinates).
        ax: matplotlib axes to draw into (default: new ones); they become the uppermost.
        over: name of a joint of one freedom whose coordinate is the axis, in place of time.
        degrees: angles in degrees.
        velocities: rates in place of coordinates.

    Raises: ValueError for joints without coordinates.
    """
    motion = events_shown(motion)
    values = (system.velocities if velocities else system.coordinates)(motion.states)
    check_joint_names(joints, values)
    x, along = _abscissa(system, motion, over, degrees)
    panels: dict = {}
    for name in joints or [name for name in values if name != over]:
        columns = np.reshape(np.asarray(values[name]), (len(motion.ts), -1)).T
        record = system.topology.joints[system.topology.joint_index[name]]
        labels = record.labels if len(record.labels) == len(columns) else range(len(columns))
        for what, label, column in zip(_units(record, velocities), labels, columns, strict=True):
            if degrees and "[rad" in what:
                what, column = what.replace("rad", "deg"), np.degrees(column)
            panels.setdefault(what, {})[name if len(columns) == 1 else f"{name} {label}"] = column
    several = len(panels) > 1
    ax = get_axes(ax, (8.0, 2.0 + 1.5 * len(panels)) if several else None)
    rooms, number = stack_axes(ax, [1] * len(panels)), 0
    for room, (what, curves) in zip(rooms, panels.items(), strict=True):
        draw_curves(room, x, curves, number)
        number += len(curves)
        format_axes(room, along if room is rooms[-1] else "", what, "beside" if several else "ends")
    return ax


def _abscissa(system, motion, over, degrees):
    """Abscissa (T,) and its label."""
    if over is None:
        return np.asarray(motion.ts), "time [s]"
    values = system.coordinates(motion.states)
    check_joint_names([over], {name: value for name, value in values.items() if np.ndim(value) == 1})
    record = system.topology.joints[system.topology.joint_index[over]]
    what, x = _units(record)[0], np.asarray(values[over])
    if degrees and "[rad" in what:
        what, x = what.replace("rad", "deg"), np.degrees(x)
    return x, f"{what.split()[0]} of {over} {what.split()[-1]}"


def _units(joint, rates=False):
    """Quantity and unit of each coordinate of a joint."""
    if not rates:
        return [_COORDINATES.get(unit, f"coordinate [{unit}]") for unit in joint.units]
    plain = [_RATES.get(unit, f"rate [{unit}/s]") for unit in joint.units if unit]
    return plain + [_RATES["rad"]] * (joint.num_velocities - len(plain))  # of a ball, which is last as in `Free`


def plot_reactions(
    loads: WordedError[Reactions],
    ts: ArrayLike,
    joints: Sequence[str] | None = None,
    moment: bool = False,
    ax: Any = None,
    *,
    component: str | None = None,
    kilo: bool = False,
    limits: Mapping[str, float] | None = None,
) -> Any:
    """Plot the magnitude of the force [N] (or moment [N m]) in joints along a motion.

    Args:
        loads: what `reactions` returned for a motion, ts (T,) its times [s].
        joints: names (default: all).
        moment: plot moments instead of forces.
        ax: matplotlib axes to draw into (default: new ones).
        component: "x", "y" or "z" of the world, or of the joints as the loads are, in place of the size.
        kilo: in kN and kN m.
        limits: allowed load of joints by name [N or N m], drawn as thin lines.

    Raises: ValueError for unknown joints or another component.
    """
    if component not in (None, "x", "y", "z"):
        raise ValueError(f"component must be 'x', 'y' or 'z', not {component!r}")
    ax = get_axes(ax)
    check_joint_names(joints, dict(loads.items()))
    check_joint_names(limits, dict(loads.items()))
    unit, curves = 1e-3 if kilo else 1.0, {}
    for name in joints or loads:
        vector = np.asarray(loads[name].moment if moment else loads[name].force) * unit
        curves[name] = vector[..., "xyz".index(component)] if component else np.linalg.norm(vector, axis=-1)
    lines = dict(zip(curves, draw_curves(ax, ts, curves), strict=True))
    for name, limit in (limits or {}).items():
        if name in lines:
            ax.axhline(unit * limit, color=lines[name].get_color(), linewidth=0.8, linestyle=(0, (1, 2)))
    what = "joint moment" if moment else "joint force"
    what += f" {component}{axes_suffix(loads)}" if component else ""
    return format_axes(ax, "time [s]", f"{what} [{'k' * kilo}N{' m' * moment}]", "ends")


def plot_energy(motion: WordedError[Motion], ax: Any = None) -> Any:
    """Plot kinetic and potential energy and their sum less all work [J]; below, the residual of that balance.

    Args:
        ax: matplotlib axes to draw into (default: new ones); their lower quarter shows the residual.
    """
    ax, below = stack_axes(get_axes(ax), (3, 1))
    motion = events_shown(motion)
    ts, accounts = np.asarray(motion.ts), motion.diagnostics
    kinetic, potential = np.asarray(accounts.kinetic), np.asarray(accounts.potential)
    work = sum((np.asarray(value) for value in accounts.work.values()), np.zeros_like(ts))
    ax.plot(ts, kinetic, label="kinetic", color=BLUE)
    ax.plot(ts, potential, label="potential", color=GREEN)
    ax.plot(ts, kinetic + potential - work, label="sum less work", color="0.2", linestyle="--")
    format_axes(ax, "", "energy [J]", "ends")
    below.plot(ts, accounts.energy_residual, color=RED)
    format_axes(below, "time [s]", "residual [J]")
    return ax


def check_joint_names(joints, known) -> None:
    """Raises: ValueError for joints that are not among the known names."""
    missing = [name for name in joints or () if name not in known]
    if missing:
        raise ValueError(f"there is no joint {', '.join(missing)} to plot; the names are: {', '.join(known)}")


def plot_history(optimum: Optimum, ax: Any = None) -> Any:
    """Plot the objective over the steps of a search and, below, its gradient norm.

    Args: ax: matplotlib axes to draw into (default: new ones); they become the upper ones.
    """
    history, ax = optimum.history, get_axes(ax, (8.0, 4.5))
    rooms, steps = stack_axes(ax, [2, 1]), np.arange(len(optimum.history.values))
    rooms[0].plot(steps, history.values, **curve_style(0))
    format_axes(rooms[0], "", "objective", None)
    rooms[1].semilogy(steps, np.where(history.gradient_norms > 0.0, history.gradient_norms, np.nan), **curve_style(1))
    format_axes(rooms[1], "step", "gradient norm", None)
    return ax
