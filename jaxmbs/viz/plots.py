"""Curves over time: coordinates, reactions, energies."""

import numpy as np

from .canvas import BLUE, GREEN, RED, axes, finish


def plot_coordinates(system, motion, joints=None, ax=None):
    """Joint coordinates [rad or m] along a motion.

    Args:
        joints: names (default: all that have coordinates).
        ax: matplotlib axes to draw into (default: new ones).
    """
    ax = axes(ax)
    values = system.coordinates(motion.states)
    _check(joints, values)
    for name in joints or values:
        columns = np.reshape(np.asarray(values[name]), (len(motion.ts), -1))
        for i, column in enumerate(columns.T):
            ax.plot(motion.ts, column, label=name if columns.shape[1] == 1 else f"{name}[{i}]")
    return finish(ax, "time [s]", "coordinate [rad or m]")


def plot_reactions(loads, ts, joints=None, moment=False, ax=None):
    """Size of the force [N] (or moment [N m]) that joints carry along a motion.

    Args:
        loads: what `reactions` returned for a motion, ts (T,) its times [s].
        joints: names (default: all).
        moment: plot moments instead of forces.
        ax: matplotlib axes to draw into (default: new ones).
    """
    ax = axes(ax)
    _check(joints, dict(loads.items()))
    for name in joints or loads:
        vector = loads[name].moment if moment else loads[name].force
        ax.plot(ts, np.linalg.norm(np.asarray(vector), axis=-1), label=name)
    return finish(ax, "time [s]", "joint moment [N m]" if moment else "joint force [N]")


def plot_energy(motion, ax=None):
    """Kinetic and potential energy and their sum less all work [J]; below, the residual of that account.

    Args:
        ax: matplotlib axes to draw into (default: new ones); they give the residual the lower quarter of their room.
    """
    from mpl_toolkits.axes_grid1 import make_axes_locatable

    ax = axes(ax)
    ts, accounts = np.asarray(motion.ts), motion.diagnostics
    kinetic, potential = np.asarray(accounts.kinetic), np.asarray(accounts.potential)
    work = sum((np.asarray(value) for value in accounts.work.values()), np.zeros_like(ts))
    ax.plot(ts, kinetic, label="kinetic", color=BLUE)
    ax.plot(ts, potential, label="potential", color=GREEN)
    ax.plot(ts, kinetic + potential - work, label="sum less work", color="0.2", linestyle="--")
    finish(ax, "", "energy [J]")
    ax.tick_params(labelbottom=False)
    below = make_axes_locatable(ax).append_axes("bottom", size="35%", pad=0.2, sharex=ax)
    below.plot(ts, accounts.energy_residual, color=RED)
    finish(below, "time [s]", "residual [J]")
    return ax


def _check(joints, known):
    missing = [name for name in joints or () if name not in known]
    if missing:
        raise ValueError(f"nothing to plot for {', '.join(missing)}; the names are: {', '.join(known)}")
