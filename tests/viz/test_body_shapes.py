"""Shapes of bodies that nobody gave, and a camera that cuts none of them."""

import base64

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.viz._body_shapes import default_shapes
from tests.viz.machines import made_up_loads, plate, turning_four_bar

X, Y, Z = np.eye(3)
LINK = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
TOOL = np.array([[0.5, 0.4, 0.3]])


def volume(solids):
    return sum(ConvexHull(solid.vertices).volume for solid in solids)


def test_named_frames_make_no_slab_of_a_link():
    bar = volume(default_shapes(LINK, np.zeros((0, 3)), Y[None], 0.02, 2))
    assert volume(default_shapes(LINK, TOOL, Y[None], 0.02, 2)) < 1.5 * bar
    one_joint = default_shapes(LINK[:1], np.concatenate([LINK[1:], TOOL]), Y[None], 0.02, 2)
    assert volume(one_joint) < 1.5 * bar


def test_a_link_in_a_plane_is_a_plate():
    corner = np.array([[0.5, 0.4, 0.0]])
    (solid,) = default_shapes(LINK, corner, Z[None], 0.02, 2)
    assert ConvexHull(solid.vertices).volume > 0.5 * 0.2 * 0.04  # the triangle, two radii thick
    assert len(default_shapes(LINK, corner, X[None], 0.02, 2)) == 2  # a bar and a branch
    (solid,) = default_shapes(LINK, np.array([[0.4, 0.0, 0.0]]), X[None], 0.02, 2)  # on the bar
    assert not default_shapes(LINK[:1], np.zeros((0, 3)), Y[None], 0.02, 2)


def test_an_inertia_larger_than_the_machine_is_no_slab():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.5, 0, 0), inertia=0.01)
    b.body("hand", mass=1.0, com=(0.1, 0, 0), inertia=(0.2, 0.2, 0.01))  # a plate of 1.5 m
    b.joint("shoulder", mbs.Revolute("y"), "ground", "arm")
    b.joint("wrist", mbs.Revolute("y"), "arm", "hand", parent_frame=(1.0, 0, 0))
    system = b.build()
    data = viz.scene(system, mbs.State.at(system)).data
    assert max(np.ptp(corners[:, k]) for _, corners in placed(data) for k in range(3)) < 1.2


def placed(data, instant=0):
    """Names and world corners of the solids on bodies, as the player puts them there."""
    numbers = lambda text, kind="<f4": np.frombuffer(base64.b64decode(text), kind)
    for stage in data["objects"]:
        poses = numbers(stage["tracks"]).reshape(-1, len(stage["bodies"]), 7)[instant]
        for item in stage["items"]:
            if "body" not in item:
                continue
            corners = numbers(data["solids"][item["solid"]]["vertices"]).reshape(-1, 3)
            if "local" in item:
                local = np.array(item["local"]).reshape(4, 4).T
                corners = corners @ local[:3, :3].T + local[:3, 3]
            pose = poses[item["body"]]
            yield item["name"], Rotation.from_quat(pose[3:]).apply(corners) + pose[:3] + stage["offset"]


def in_picture(data, points):
    """Points as shares of the picture, -1 to 1 across and up, by the formulas of `look` in the player."""
    up, front, camera = np.array(data["up"]), np.array(data["front"]), data["camera"]
    flat = front * np.cos(camera["azimuth"]) + np.cross(up, front) * np.sin(camera["azimuth"])
    back = flat * np.cos(camera["elevation"]) + up * np.sin(camera["elevation"])
    x = np.cross(up, back) / np.linalg.norm(np.cross(up, back))
    away = points - np.array(data["centre"]) - back * camera["distance"]
    f = 1.0 / np.tan(data["angle"] / 2) / -(away @ back)
    return np.stack([f * (away @ x) / 1.45, f * (away @ np.cross(back, x))], axis=-1)


def tower(count):
    b, last = mbs.SystemBuilder(), "ground"
    for k in range(count):
        name = f"storey {k}"
        b.body(name, mass=1.0, com=(0, 0, 0.5), inertia=mbs.inertia.rod(1.0, 1.0, "z"))
        b.joint(f"pin {k}", mbs.Revolute("xy"[k % 2]), last, name, parent_frame=(0, 0, float(k > 0)))
        last = name
    return b.build()


@pytest.mark.parametrize("count", [1, 2, 6])
def test_the_camera_sees_all_of_a_tower(count):
    system = tower(count)
    made = viz.scene(system, mbs.State.at(system))
    seen = in_picture(made.data, np.concatenate([corners for _, corners in placed(made.data)]))
    assert np.abs(seen).max() < 1.0
    assert np.abs(seen).max() > 0.5  # and is not far away


def test_the_camera_sees_machines_side_by_side_and_their_loads():
    system, motion = turning_four_bar()
    loads = made_up_loads(motion.ts)
    pair = viz.scene({"a": system, "b": system}, {"a": motion, "b": motion}, loads={"a": loads, "b": loads}).data
    seen = in_picture(pair, np.concatenate([c for k in (0, 20, 40) for _, c in placed(pair, k)]))
    assert 0.5 < np.abs(seen).max() < 1.0


@pytest.mark.long
def test_limits_that_are_infinite_are_none(tmp_path):
    system, motion = turning_four_bar()
    loads = made_up_loads(motion.ts)
    page = viz.scene(system, motion, tmp_path / "a.html", loads=loads, limits={"A": np.inf, "B": 200.0})
    assert page.data["objects"][0]["arrows"]["limits"] == [None, 200.0, None, None]
    assert "Infinity" not in page.html and "NaN" not in page.html
    for wrong in (0.0, -3.0, np.nan):
        with pytest.raises(ValueError, match="must be positive"):
            viz.scene(system, motion, loads=loads, limits={"A": wrong})
    structure = plate(2, 1)
    clamped = mbs.fem.assemble(structure)
    with pytest.raises(mbs.ModelError, match="no finite displacement"):
        viz.scene(clamped, np.full(clamped.num_rows, np.nan), structures=structure)
    with pytest.raises(mbs.ModelError, match="scale must be a finite number"):
        viz.scene(clamped, np.zeros(clamped.num_rows), structures=structure, scale=np.inf)


def test_rings_of_a_polar_plot_are_whole():
    plt = pytest.importorskip("matplotlib.pyplot")
    _, motion = turning_four_bar()
    ax = viz.plot_polar(made_up_loads(motion.ts), ["A", "D"])
    furthest = max(np.abs(line.get_xydata()).max() for line in ax.lines if len(line.get_xydata()) > 2)
    assert furthest < min(*np.abs(ax.get_xlim()), *np.abs(ax.get_ylim()))
    plt.close(ax.figure)


@pytest.mark.long
def test_modes_have_a_colour_bar():
    plt = pytest.importorskip("matplotlib.pyplot")
    structure = plate(3, 2)
    system = mbs.fem.assemble(structure)
    ax = viz.plot_modes(system, mbs.modes(system, 2), structures=structure)
    *rooms, bar = ax.figure.axes
    assert len(rooms) == 2 and "share" in bar.get_ylabel() and bar.get_ylim() == (0.0, 1.0)
    plt.close(ax.figure)
