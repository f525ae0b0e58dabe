"""Pictures go into the axes given, hold what they should, and never open a window."""

import re
import shutil
import subprocess

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure
from PIL import Image

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.palette import COLORS
from jaxmbs.viz._canvas import draw_curves, format_axes
from jaxmbs.viz._drawable import body_frames
from jaxmbs.viz._mechanism import frame_positions
from jaxmbs.viz._shape_lines import thing_lines
from jaxmbs.viz._things import things
from jaxmbs.viz.scenes import _trajectory as film_module
from jaxmbs.viz.scenes._trajectory import frame_trajectory
from tests.viz.test_viz_labels import study

from .machines import everything, plate


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


@pytest.mark.long
def test_coordinates(pendulum, ax):
    system, motion, _ = pendulum
    assert viz.plot_coordinates(system, motion, ax=ax) is ax
    assert np.allclose(ax.lines[0].get_ydata(), motion.states.coordinates[:, 0])
    with pytest.raises(ValueError, match="hinge to plot; the names are: pivot"):
        viz.plot_coordinates(system, motion, ["hinge"], ax=ax)


@pytest.mark.slow
@pytest.mark.parametrize("moment", [False, True])
def test_reactions(pendulum, ax, moment):
    _, motion, loads = pendulum
    assert viz.plot_reactions(loads, motion.ts, ["pivot"], moment=moment, ax=ax) is ax
    vector = loads["pivot"].moment if moment else loads["pivot"].force
    assert np.allclose(ax.lines[0].get_ydata(), np.linalg.norm(vector, axis=1))
    assert ("moment" in ax.get_ylabel()) == moment
    with pytest.raises(ValueError, match="no joint hinge to plot"):
        viz.plot_reactions(loads, motion.ts, ["hinge"], ax=ax)


@pytest.mark.long
def test_energy(pendulum, ax):
    motion = pendulum[1]
    assert viz.plot_energy(motion, ax=ax) is ax
    kinetic, potential, total = (line.get_ydata() for line in ax.lines)
    assert np.allclose(kinetic + potential, total)
    assert np.allclose(total, total[0])
    below = ax.figure.axes[1]
    assert np.allclose(below.lines[0].get_ydata(), motion.diagnostics.energy_residual)


@pytest.mark.long
def test_mechanism_at_one_pose_and_several(pendulum, ax):
    system, motion, _ = pendulum
    first = jax.tree.map(lambda x: x[0], motion.states)
    assert viz.plot_mechanism(system, first, plane="xz", ax=ax) is ax
    count = len(ax.lines)
    stick = max(ax.lines, key=lambda line: line.get_linewidth() * (line.get_marker() == "None"))
    assert np.allclose(np.ptp(stick.get_ydata()), np.cos(0.5))
    viz.plot_mechanism(system, motion.states, plane="xz", ax=ax)
    assert len(ax.lines) == count * (1 + len(motion.ts))


@pytest.mark.long
def test_frames_shown(pendulum):
    top = pendulum[0].topology
    tip = top.frame_index["tip"]
    assert tip in body_frames(top)[0]
    assert tip not in body_frames(top, ())[0]
    tips = frame_positions(pendulum[0], pendulum[1].states)[:, tip]
    assert np.allclose(np.linalg.norm(tips, axis=1), 1.0)


@pytest.mark.parametrize("plane", [pytest.param("x", marks=pytest.mark.long), "xx", "xq", "xyz"])
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


def test_curves_over_a_coordinate_in_degrees(pendulum, ax):
    system, motion, _ = pendulum
    viz.plot_coordinates(system, motion, ["pivot"], ax=ax, over="pivot", degrees=True, velocities=True)
    assert ax.get_xlabel() == "angle of pivot [deg]" and ax.get_ylabel() == "rate [deg/s]"
    assert np.allclose(ax.lines[0].get_xdata(), np.degrees(motion.states.coordinates[:, 0]))
    assert np.allclose(ax.lines[0].get_ydata(), np.degrees(motion.states.velocities[:, 0]))


def test_components_in_kilonewtons_beside_their_limit(pendulum, ax):
    _, motion, loads = pendulum
    viz.plot_reactions(loads, motion.ts, ["pivot"], ax=ax, component="z", kilo=True, limits={"pivot": 30.0})
    assert ax.get_ylabel() == "joint force z [kN]"
    assert np.allclose(ax.lines[0].get_ydata(), 1e-3 * loads["pivot"].force[:, 2])
    assert np.allclose(ax.lines[1].get_ydata(), 0.03)


def test_curves_that_hide_one_another_are_told_apart(ax):
    x, wave = np.linspace(0.0, 1.0, 50), np.sin(np.linspace(0.0, 6.0, 50))
    lines = draw_curves(ax, x, {"one": wave, "same": wave + 1e-4, "other": -wave, "third": wave})
    styles = [line.get_linestyle() for line in lines]
    assert styles[0] == "-" == styles[2] and styles[1] == "--" == styles[3]
    assert lines[1]._dash_pattern != lines[3]._dash_pattern


def test_names_stand_where_curves_end():
    figure = Figure((6.0, 3.0), layout="constrained")
    room, x = figure.add_subplot(), np.linspace(0.0, 1.0, 5)
    draw_curves(room, x, {"low": 0 * x, "high": 0 * x + 1.0, "higher": 0 * x + 1.01})
    format_axes(room, "x", "y", "ends")
    heights = {note.get_text(): note.xy[1] for note in room.texts}
    assert heights["low"] < heights["high"] < heights["higher"] - 0.05


def test_colours_are_told_apart_without_red_or_green():
    """Colours as two kinds of colour-blind eyes see them (Machado, Oliveira and Fernandes 2009, complete)."""
    eyes = {
        "all": np.eye(3),
        "no red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        "no green": [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
    }
    linear = np.array([[int(c[k : k + 2], 16) / 255 for k in (1, 3, 5)] for c in COLORS]) ** 2.2
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    for eye in eyes.values():
        x, y, z = np.cbrt(np.clip(linear @ np.asarray(eye).T, 1e-4, 1) @ to_xyz.T / [0.9505, 1.0, 1.089]).T
        lab = np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)
        apart = np.linalg.norm(lab[:, None] - lab[None], axis=-1)[np.triu_indices(len(lab), 1)]
        assert apart.min() > 20.0


@pytest.mark.long
def test_a_film_has_its_frames(pendulum, tmp_path):
    system, motion, _ = pendulum
    path = viz.animate(system, motion, tmp_path / "swing.gif", "xz", fps=5, speed=0.5, dpi=40)
    with Image.open(path) as film:
        assert film.n_frames == 10
        pictures = []
        for k in (0, 5):
            film.seek(k)
            pictures.append(np.asarray(film.convert("L"), float))
    assert np.mean(np.abs(pictures[0] - pictures[1]) > 50) > 1e-3
    with pytest.raises(ValueError, match=".gif or .mp4"):
        viz.animate(system, motion, tmp_path / "swing.avi")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_an_mp4_has_its_frames(pendulum, tmp_path):
    system, motion, _ = pendulum
    path = viz.animate(system, motion, tmp_path / "swing.mp4", "xz", fps=5, speed=0.5, dpi=40)
    command = ["ffmpeg", "-i", str(path), "-map", "0:v:0", "-c", "copy", "-f", "null", "-"]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    assert re.findall(r"frame=\s*(\d+)", told)[-1] == "10"


def test_all_poses_are_one_program(pendulum, monkeypatch):
    system, motion, _ = pendulum
    traced, walk = [], film_module.frame_poses
    monkeypatch.setattr(film_module, "frame_poses", lambda *given: traced.append(1) or walk(*given))
    four = jax.tree.map(lambda x: x[:4], motion.states)
    for _ in range(2):
        viz.plot_mechanism(system, four, "xz", ax=Figure().add_subplot())
    assert len(traced) == 1


def test_sides_traces_and_names(pendulum):
    system, motion, _ = pendulum
    ax = Figure((9.0, 3.0), layout="constrained").add_subplot()
    viz.plot_views(system, motion, ("xz", "yz", "iso"), ax=ax, traces=["tip"], names=True)
    rooms = ax.figure.axes
    assert [room.get_xlabel() for room in rooms] == ["x [m]", "y [m]", ""]
    path = next(line for line in rooms[0].lines if line.get_linestyle() == ":")
    q = np.asarray(motion.states.coordinates[:, 0])
    assert np.allclose(path.get_xydata(), np.stack([-np.sin(q), -np.cos(q)], axis=1), atol=1e-9)
    assert [note.get_text() for note in rooms[0].texts] == ["pivot"]
    count = len(viz.plot_mechanism(system, motion, "xz", ax=Figure().add_subplot()).lines)
    assert len(viz.plot_mechanism(system, motion, "xz", poses=2, ax=Figure().add_subplot()).lines) == 2 * count // 5
    with pytest.raises(mbs.UnknownNameError, match="tpi"):
        viz.plot_mechanism(system, motion, traces=["tpi"], ax=ax)


@pytest.mark.long
def test_everything_is_drawn_as_what_it_is():
    system, states = everything()
    ax = viz.plot_mechanism(system, jax.tree.map(lambda x: x[:1], states), "iso", ax=Figure().add_subplot())
    assert len(ax.patches) == 5  # blocks of ram and sleeve, the plate of the puck, the muscle, the mount
    sizes = [len(line.get_xydata()) for line in ax.lines if line.get_marker() == "None"]
    assert sizes.count(23) == 1 and sizes.count(97) == 1  # the zigzag of the strut, the thread of the nut
    barrel = [line for line in ax.lines if line.get_linewidth() == 6.0]
    assert len(barrel) == 1


@pytest.mark.slow
@pytest.mark.parametrize("angle", [-0.8, 0.0, 1.1])
def test_a_torsion_spring_winds_up_and_a_damper_turns_with_its_body(angle):
    """Figs 5 and 6 of the paper: a spiral whose outer end turns with the child, a vane in the drum of a damper."""
    b = mbs.SystemBuilder()
    b.body("arm", 1.0, (0.5, 0.0, 0.0), 0.1)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm", parent_frame=(0.3, 0.2, 0.0))
    b.frame("tip", "arm", (1.0, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(3.0), joint="pin")
    b.force("damper", mbs.SpringDamper(0.0, 2.0), joint="pin")
    system = b.build()
    ax = viz.plot_mechanism(system, mbs.State.at(system, pin=angle), "xy", ax=Figure().add_subplot())
    lines = {len(line.get_xdata()): line.get_xydata() - [0.3, 0.2] for line in ax.lines}
    spiral, vane = lines[81], lines[9]
    radius = np.linalg.norm(spiral, axis=1)
    assert np.all(np.diff(radius) > 0) and radius[-1] < 0.1
    wound = np.sum(np.diff(np.unwrap(np.arctan2(spiral[:, 1], spiral[:, 0]))))
    np.testing.assert_allclose(wound, 5 * np.pi + angle, rtol=1e-9)
    middle = vane[4] / np.linalg.norm(vane[4])
    ends = spiral[0] / radius[0]  # where the parent's end is
    seen = np.arctan2(ends[0] * middle[1] - ends[1] * middle[0], ends @ middle)
    np.testing.assert_allclose(seen, angle, atol=1e-9)


def test_mesh_pictures():
    structure = plate()
    ax = viz.plot_structure(structure, ax=Figure().add_subplot())
    faces, edges, bars = ax.collections
    assert len(faces.get_paths()) == 18 and len(edges.get_paths()) == 45 and len(bars.get_paths()) == 3
    u = np.zeros((structure.num_nodes, 3))
    u[:, 2] = np.asarray(structure.positions[:, 0]) ** 2
    ax = viz.plot_structure(structure, u, "xz", ax=Figure().add_subplot(), scale=2.0)
    top = max(path.vertices[:, 1].max() for path in ax.collections[-1].get_paths())
    assert np.isclose(top, 2.0 * 0.25)
    with pytest.raises(ValueError, match="28, 3 or 6"):
        viz.plot_structure(structure, np.zeros(7), ax=ax)


def test_only_designs_that_are_ok_are_compared(ax):
    table = study()
    viz.plot_parallel(table, ["crank", "peak"], ax=ax)
    (lines,) = [c for c in ax.collections if len(c.get_paths()) > 1]
    assert len(lines.get_paths()) == 39
    with pytest.raises(ValueError, match="craank to plot; the names are: crank, rod, offset, peak"):
        viz.plot_scatter(table, ["craank"])


def test_the_case_that_reaches_furthest_is_named(ax):
    x, values = np.linspace(0.0, 1.0, 4), np.outer([1.0, 3.0, np.nan, 2.0], np.ones(4))
    viz.plot_envelope(x, values, limit=2.5, ax=ax)
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert told == ["3 cases, 1 failed", "median", "case 1", "limit"]
    assert np.allclose(ax.lines[0].get_ydata(), 2.0)


def test_a_film_of_a_mesh(tmp_path):
    structure = plate(3, 1)
    x = np.zeros((3, len(structure.labels)))
    x[1, [label == ("3.1", "z") for label in structure.labels]] = 0.1
    whole = mbs.LinearSystem(
        mass=np.eye(x.shape[1]),
        stiffness=np.eye(x.shape[1]),
        coordinates=structure.labels,
        positions=dict(zip(structure.names, np.asarray(structure.positions), strict=True)),
    )
    path = viz.animate(whole, x, tmp_path / "bend.gif", fps=2, dpi=30, structures=structure)
    with Image.open(path) as film:
        assert film.n_frames == 4
        pictures = []
        for k in (0, 2):
            film.seek(k)
            pictures.append(np.asarray(film.convert("L"), float))
    assert np.mean(np.abs(pictures[0] - pictures[1]) > 30) > 1e-3


def test_logarithmic_axes_have_plain_numbers(ax):
    ax.loglog([20.0, 2000.0], [1e-6, 10.0])
    format_axes(ax, "frequency [Hz]", "receptance [m/N]")
    ax.figure.draw_without_rendering()
    shown = [text.get_text() for text in ax.get_xticklabels()]
    assert {"20", "50", "100", "1000", "2000"} <= set(shown)
    assert not any(text.get_text() for text in ax.get_xticklabels(minor=True))
    powers = {text.get_text() for text in ax.get_yticklabels()}
    assert "$10^{-5}$" in powers and "0.1" in powers


def test_orders_are_named_beside_the_modes(ax):
    speeds = np.linspace(0.0, 160.0, 5)
    hertz = np.outer(np.ones(5), [40.0, 42.0]) + 0.07 * speeds[:, None]
    viz.plot_campbell(speeds, hertz, orders=(1, 2), ax=ax)
    for text, order in zip(ax.texts, (1, 2), strict=True):
        x, y = text.get_position()
        np.testing.assert_allclose(y, order * x / (2 * np.pi))  # in its line
        assert np.min(np.abs(y - [np.interp(x, speeds, curve) for curve in hertz.T])) > 5.0


def test_a_front_names_its_objectives(ax):
    def peak_force(x):
        return x**2

    front = mbs.design.pareto(peak_force, lambda x: (x - 2.0) ** 2, 1.0, progress=False, points=3)
    viz.plot_pareto_front(front, ax=ax)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("peak force", "second objective")
    viz.plot_pareto_front(front, "force [N]", ax=ax)
    assert ax.get_xlabel() == "force [N]"
    ax.clear()
    viz.plot_pareto_front({"1 in 100": front, "1 in 1000": front}, ax=ax)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["1 in 100", "1 in 1000"]
    assert len({line.get_color() for line in ax.lines}) == 2
    with pytest.raises(ValueError, match="no front to plot"):
        viz.plot_pareto_front({}, ax=ax)


@pytest.mark.slow
def test_importances_are_bars_the_largest_first(ax):
    numbers = {"a": mbs.probability.Normal(0.0, 1.0), "b": mbs.probability.Normal(0.0, 2.0)}
    failing = mbs.design.reliability(lambda x: 5.0 - x["a"] - x["b"], numbers)
    viz.plot_importances(failing, ax=ax)
    np.testing.assert_allclose([bar.get_width() for bar in ax.patches], [80.0, 20.0], rtol=1e-9)
    assert [label.get_text() for label in ax.get_yticklabels()] == ["b", "a"]
    with pytest.raises(ValueError, match="has no importances"):
        viz.plot_importances(mbs.design.reliability(lambda x: 1.0 - x["a"], numbers, "samples", samples=500))


def test_the_front_of_a_stored_study_is_drawn(ax):
    import xarray

    numbers = {"mass": [3.0, 1.0, 2.0, 4.0], "peak": [1.0, 3.0, 2.0, 2.5], "status": [0, 0, 0, 0]}
    study = xarray.Dataset({name: ("design", values) for name, values in numbers.items()})
    study["mass"].attrs["units"] = "kg"
    viz.plot_pareto_front(mbs.studies.pareto_front(study, ["peak", "mass"]), ax=ax)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("peak", "mass [kg]")
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), [[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]])
    with pytest.raises(TypeError, match="take plot_scatter or plot_parallel"):
        viz.plot_pareto_front(study, ax=ax)
    with pytest.raises(ValueError, match="a front of 1 objectives"):
        viz.plot_pareto_front(mbs.studies.pareto_front(study, ["peak"]), ax=ax)


def test_a_wire_and_a_blade_are_drawn():
    """A wire is as long as its bead moves along it, a blade lies along itself."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("bead", mass=1.0, inertia=1.0)
    b.joint("float", mbs.Free(), "ground", "bead")
    b.constraint("wire", mbs.joints.PointOnLine(), between=("ground", "bead"))
    b.body("sled", mass=1.0, inertia=1.0)
    b.joint("plane", mbs.Planar(), "ground", "sled")
    b.constraint("blade", mbs.joints.KnifeEdge("y"), between=("ground", "sled"))
    system = b.build()
    high = [mbs.State.at(system, float=(0, 0, z, 1, 0, 0, 0), plane=(2.0, 0.0, np.pi / 2)) for z in (0.5, 1.5)]
    film = frame_trajectory(system, jax.tree.map(lambda *x: jnp.stack(x), *high))
    drawn = {one.name: one.lines for one in thing_lines(things(system), film)}
    (wire,), (_, blade) = drawn["wire"], drawn["blade"]
    np.testing.assert_allclose(wire[0][:, :2], 0.0, atol=1e-12)
    assert wire[0][0, 2] < 0.5 and 1.5 < wire[0][1, 2] < 2.5
    np.testing.assert_allclose(blade[0].mean(axis=0), [2.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose((blade[0][1] - blade[0][0])[1:], 0.0, atol=1e-12)  # its y axis points along -x


def test_of_a_long_motion_a_few_poses_are_drawn(pendulum, ax):
    system, motion, _ = pendulum
    many = jax.tree.map(lambda x: jnp.concatenate([x] * 20), motion.states)
    whole = len(viz.plot_mechanism(system, motion, "xz", ax=Figure().add_subplot()).lines)
    assert len(viz.plot_mechanism(system, many, "xz", ax=ax).lines) == 8 * whole // len(motion)
