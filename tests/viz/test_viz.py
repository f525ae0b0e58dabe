"""Pictures go into the axes given, hold what they should, and never open a window."""

import jax
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.viz.mechanism import body_frames, frame_positions


@pytest.fixture(scope="module")
def pendulum():
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.0, 0.0, -1.0))
    b.joint("pivot", mbs.Revolute(axis="y"), parent="ground", child="bob")
    b.frame("tip", on="bob", position=(0.0, 0.0, -1.0))
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, pivot=0.5), ts=np.linspace(0.0, 1.0, 5))
    return system, motion, mbs.reactions(system, motion)


@pytest.fixture
def ax():
    return Figure().add_subplot()


def test_coordinates(pendulum, ax):
    system, motion, _ = pendulum
    assert viz.plot_coordinates(system, motion, ax=ax) is ax
    assert np.allclose(ax.lines[0].get_ydata(), motion.states.coordinates[:, 0])
    with pytest.raises(ValueError, match="hinge; the names are: pivot"):
        viz.plot_coordinates(system, motion, ["hinge"], ax=ax)


@pytest.mark.parametrize("moment", [False, True])
def test_reactions(pendulum, ax, moment):
    _, motion, loads = pendulum
    assert viz.plot_reactions(loads, motion.ts, ["pivot"], moment=moment, ax=ax) is ax
    vector = loads["pivot"].moment if moment else loads["pivot"].force
    assert np.allclose(ax.lines[0].get_ydata(), np.linalg.norm(vector, axis=1))
    assert ("moment" in ax.get_ylabel()) == moment
    with pytest.raises(ValueError, match="nothing to plot for hinge"):
        viz.plot_reactions(loads, motion.ts, ["hinge"], ax=ax)


def test_energy(pendulum, ax):
    motion = pendulum[1]
    assert viz.plot_energy(motion, ax=ax) is ax
    kinetic, potential, total = (line.get_ydata() for line in ax.lines)
    assert np.allclose(kinetic + potential, total)
    assert np.allclose(total, total[0])
    below = ax.figure.axes[1]
    assert np.allclose(below.lines[0].get_ydata(), motion.diagnostics.energy_residual)


def test_mechanism_at_one_pose_and_several(pendulum, ax):
    system, motion, _ = pendulum
    first = jax.tree.map(lambda x: x[0], motion.states)
    assert viz.plot_mechanism(system, first, plane="xz", ax=ax) is ax
    count = len(ax.lines)
    stick = max(ax.lines, key=lambda line: line.get_linewidth() * (line.get_marker() == "None"))
    assert np.allclose(np.ptp(stick.get_ydata()), np.cos(0.5))
    viz.plot_mechanism(system, motion.states, plane="xz", ax=ax)
    assert len(ax.lines) == count * (1 + len(motion.ts))


def test_frames_shown(pendulum):
    top = pendulum[0].topology
    tip = top.frame_index["tip"]
    assert tip in body_frames(top)[0]
    assert tip not in body_frames(top, ())[0]
    tips = frame_positions(pendulum[0], pendulum[1].states)[:, tip]
    assert np.allclose(np.linalg.norm(tips, axis=1), 1.0)


@pytest.mark.parametrize("plane", ["x", "xx", "xq", "xyz"])
def test_unknown_plane(pendulum, ax, plane):
    with pytest.raises(ValueError, match="two different axes"):
        viz.plot_mechanism(pendulum[0], pendulum[1].states, plane=plane, ax=ax)


def test_new_axes_without_ax(pendulum, monkeypatch):
    monkeypatch.setattr(pyplot, "show", lambda *_: pytest.fail("a window was opened"))
    pyplot.switch_backend("agg")
    ax = viz.plot_coordinates(pendulum[0], pendulum[1])
    assert ax.get_xlabel() == "time [s]"
    pyplot.close(ax.figure)


def test_limit_values(ax):
    truth, limits = (
        np.array([1.0, 2.0, 4.0, 5.0]),
        {"absolute": np.array([2.0, 2.0, 4.0, 6.0]), "squares": np.full(4, 3.0)},
    )
    assert viz.plot_limit_values(limits, truth, [0.1, 0.2, 0.3, 0.4], ax=ax) is ax
    assert np.allclose(ax.lines[1].get_ydata(), 3.0 / truth)
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert told == ["absolute: short in 0%, at worst by 0%", "squares: short in 50%, at worst by 40%"]


def test_history(ax):
    best = mbs.minimise(lambda d: (d["x"] - 1.0) ** 4, {"x": 3.0}, progress=False)
    assert viz.plot_history(best, ax=ax) is ax
    (values,) = ax.get_lines()
    np.testing.assert_array_equal(values.get_ydata(), best.history.values)
