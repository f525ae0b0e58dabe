"""Curves over time: coordinates, reactions, energies."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..design.optimum import Optimum
from ..dynamics.joint_reactions import Reactions
from ..model.system import System
from ..motion.motion import Motion
from ..palette import BLUE, GREEN, RED
from ..typing import ArrayLike, Explained
from .canvas import axes, curve, finish, stacked

_UNITS = {
    "revolute": "angle [rad]",
    "screw": "angle [rad]",
    "prismatic": "distance [m]",
    "ball": "quaternion",
    "Modal": "mode [m kg$^{1/2}$]",
}


def plot_coordinates(
    system: System, motion: Explained[Motion], joints: Sequence[str] | None = None, ax: Any = None
) -> Any:
    """Joint coordinates along a motion, those of each unit in axes of their own, one above the other.

    Args:
        joints: names (default: all that have coordinates).
        ax: matplotlib axes to draw into (default: new ones); they become the uppermost.
    """
    values = system.coordinates(motion.states)
    _check(joints, values)
    panels = {}
    for name in joints or values:
        columns = np.reshape(np.asarray(values[name]), (len(motion.ts), -1)).T
        record = system.topology.joints[system.topology.joint_index[name]]
        for what, label, column in zip(_units(system.topology, record), record.labels, columns, strict=True):
            panels.setdefault(what, []).append((name if len(columns) == 1 else f"{name} {label}", column))
    several = len(panels) > 1
    ax = axes(ax, (8.0, 2.0 + 1.5 * len(panels)) if several else None)
    rooms, number = stacked(ax, [1] * len(panels)), 0
    for room, (what, curves) in zip(rooms, panels.items(), strict=True):
        for label, column in curves:
            room.plot(motion.ts, column, label=label, **curve(number))
            number += 1
        finish(room, "time [s]" if room is rooms[-1] else "", what, "beside" if several else "inside")
    return ax


def _units(topology, joint):
    """What each coordinate of a joint is, with its unit."""
    if joint.kind == "Modal":
        return [_UNITS["Modal"]] * joint.num_coordinates
    kinds = topology.node_kind[joint.velocities]
    plain = [_UNITS[kind] for kind in kinds if kind != "ball"]
    return plain + [_UNITS["ball"]] * (joint.num_coordinates - len(plain))  # a ball is last, as in `Free`


def plot_reactions(
    loads: Explained[Reactions],
    ts: ArrayLike,
    joints: Sequence[str] | None = None,
    moment: bool = False,
    ax: Any = None,
) -> Any:
    """Size of the force [N] (or moment [N m]) that joints carry along a motion.

    Args:
        loads: what `reactions` returned for a motion, ts (T,) its times [s].
        joints: names (default: all).
        moment: plot moments instead of forces.
        ax: matplotlib axes to draw into (default: new ones).
    """
    ax = axes(ax)
    _check(joints, dict(loads.items()))
    for i, name in enumerate(joints or loads):
        vector = loads[name].moment if moment else loads[name].force
        ax.plot(ts, np.linalg.norm(np.asarray(vector), axis=-1), label=name, **curve(i))
    return finish(ax, "time [s]", "joint moment [N m]" if moment else "joint force [N]")


def plot_energy(motion: Explained[Motion], ax: Any = None) -> Any:
    """Kinetic and potential energy and their sum less all work [J]; below, the residual of that account.

    Args:
        ax: matplotlib axes to draw into (default: new ones); they give the residual the lower quarter of their room.
    """
    ax, below = stacked(axes(ax), (3, 1))
    ts, accounts = np.asarray(motion.ts), motion.diagnostics
    kinetic, potential = np.asarray(accounts.kinetic), np.asarray(accounts.potential)
    work = sum((np.asarray(value) for value in accounts.work.values()), np.zeros_like(ts))
    ax.plot(ts, kinetic, label="kinetic", color=BLUE)
    ax.plot(ts, potential, label="potential", color=GREEN)
    ax.plot(ts, kinetic + potential - work, label="sum less work", color="0.2", linestyle="--")
    finish(ax, "", "energy [J]")
    below.plot(ts, accounts.energy_residual, color=RED)
    finish(below, "time [s]", "residual [J]")
    return ax


def _check(joints, known):
    missing = [name for name in joints or () if name not in known]
    if missing:
        raise ValueError(f"nothing to plot for {', '.join(missing)}; the names are: {', '.join(known)}")


def plot_history(optimum: Optimum, ax: Any = None) -> Any:
    """The objective over the steps of a search and, below, how far it was from an optimum.

    Args: ax: matplotlib axes to draw into (default: new ones); they become the upper ones.
    """
    history, ax = optimum.history, axes(ax, (8.0, 4.5))
    rooms, steps = stacked(ax, [2, 1]), np.arange(len(optimum.history.values))
    rooms[0].plot(steps, history.values, **curve(0))
    finish(rooms[0], "", "objective", None)
    rooms[1].semilogy(steps, np.where(history.gradient_norms > 0.0, history.gradient_norms, np.nan), **curve(1))
    finish(rooms[1], "step", "slope left", None)
    return ax
