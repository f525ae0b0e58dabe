"""The plots of the demo."""

from pathlib import Path

import jax
import numpy as np

from ..atomic_write import atomic_path
from ..palette import BLUE, GREY, RED
from ..viz import plot_energy, plot_mechanism
from ..viz._canvas import format_axes
from ..viz._mechanism import frame_positions
from ._loads import crank_angle

_SIZES = {"loads.png": (10.0, 5.8), "energy.png": (7.0, 4.6)}  # [inch]
_NAMES = ("before", "after")
_CURVES = {"shaking": "shaking force [N]", "main": "main bearing load [N]", "torque": "driving torque [N m]"}


def draw(folder: Path, results: dict) -> list[Path]:
    """Write the plots; returns their paths.  Raises: ModuleNotFoundError without matplotlib."""
    from matplotlib.figure import Figure

    figures = {name: Figure(size, layout="constrained") for name, size in _SIZES.items()}
    _loads(figures["loads.png"], results)
    plot_energy(results["free"], ax=figures["energy.png"].add_subplot())
    for name, figure in figures.items():
        with atomic_path(folder / name) as part:
            figure.savefig(part, dpi=150)
    return [folder / name for name in figures]


def _loads(figure, results):
    """Mechanism before and after on top, loads over a turn below."""
    top, bottom = figure.subfigures(2, 1, height_ratios=(0.8, 1.0))
    axes = top.subplots(1, 2, sharex=True, sharey=True)
    designs = (results["optimum"].initial_design, results["optimum"].design)
    for ax, *pair, name in zip(axes, results["systems"], results["motions"], designs, _NAMES, strict=True):
        _poses(ax, *pair)
        ax.set_title(name, fontsize=10)
    for ax, (quantity, label) in zip(bottom.subplots(1, 3), _CURVES.items(), strict=True):
        for loads, color, name in zip(results["loads"], (RED, BLUE), _NAMES, strict=True):
            _over_a_turn(ax, loads, np.asarray(getattr(loads, quantity)), color, name)
        format_axes(ax, "crank angle [deg]", label, legend=None)
        ax.set_xticks(range(0, 361, 90))
        if quantity != "torque":
            ax.set_ylim(bottom=0.0)
    bottom.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)


def _poses(ax, system, motion, design):
    """The mechanism at four poses, its balance masses as discs of matching area at the first."""
    rows = np.linspace(0, len(motion.ts), 5)[:4].astype(int)
    states = jax.tree.map(lambda x: x[rows], motion.states)
    masses = {"counterweight": design["counterweight_mass"], "rod_tail": design["rod_tail_mass"]}
    masses = {name: float(mass) for name, mass in masses.items() if mass > 0}
    plot_mechanism(system, states, frames=masses, ax=ax)
    for name, mass in masses.items():
        point = frame_positions(system, states)[0, system.topology.frame_index[name]]
        ax.scatter(*point[:2], s=60.0 * mass, color=GREY, zorder=5)
        above = dict(xytext=(0, 6 + 2.5 * mass**0.5), textcoords="offset points", ha="center", fontsize=8)
        ax.annotate(f"{mass:.1f} kg", point[:2], **above)


def _over_a_turn(ax, loads, values, color, name):
    """The size of a force, or a torque, over the crank angle."""
    values = values[:, 0] if values.shape[1] == 1 else np.linalg.norm(values, axis=1)
    angle = np.degrees(crank_angle(loads.t)) % 360.0
    order = np.argsort(angle)
    angle, values = angle[order], values[order]
    closed = np.r_[angle[-1] - 360.0, angle, angle[0] + 360.0], np.r_[values[-1], values, values[0]]
    ax.plot(*closed, color=color, label=name)
    ax.set_xlim(0.0, 360.0)
