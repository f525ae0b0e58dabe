"""A scene: one file that asks for nothing outside, whose numbers are those of the motion."""

import base64
import itertools
import json
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs import fem, flexible, viz
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.reaction import JointReaction, Reactions
from jaxmbs.viz._mesh import moving_meshes
from jaxmbs.viz.scenes._geometry import pose_tracks
from jaxmbs.viz.scenes._trajectory import frame_trajectory
from tests.flexible.beams import beam_structure
from tests.viz.machines import everything, four_bar_angles, made_up_loads, plate, turning_four_bar


@pytest.fixture(scope="module")
def four_bar():
    return turning_four_bar()


@pytest.fixture(scope="module")
def shown(four_bar, tmp_path_factory):
    """The scene of a four-bar with all that there is, and its file."""
    system, motion = four_bar
    path = tmp_path_factory.mktemp("scene") / "motion.html"
    made = viz.scene(
        system,
        motion,
        path,
        loads=made_up_loads(motion.ts),
        traces=["C.parent"],
        limits={"B": 500.0},
        title="<A & B>",
    )
    return made, path.read_text("utf-8")


def scene_data(page):
    """What the page plays."""
    return json.loads(re.search(r'id="scene-data">(.*?)</script>', page, re.DOTALL).group(1))


def numbers(text, *shape):
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(shape)


def outside(page):
    """Whatever in a page could ask for something outside of it."""
    asks = (
        r"https?:|//\w+\.\w|\bsrc\s*=|\bhref\s*=|@import|url\(|fetch\(|XMLHttpRequest|WebSocket|import\(|sendBeacon"
    )
    return re.findall(asks, page)


@pytest.mark.long
def test_it_is_one_small_file_that_asks_for_nothing(shown):
    made, page = shown
    assert page == made.html
    assert len(page) < 2e6
    assert not outside(page)
    assert outside('<script src="x.js">') and outside("fetch('a')")  # it would be noticed
    assert "<A & B>" not in page and scene_data(page)["title"] == "<A & B>"


@pytest.mark.long
def test_poses_are_those_of_the_closed_form(shown, four_bar):
    """Crank, coupler and rocker by the crossing of two circles."""
    data, ts = scene_data(shown[1]), four_bar[1].ts
    (stage,) = data["objects"]
    poses = numbers(stage["tracks"], len(ts), 4, 7)
    assert np.allclose(numbers(data["ts"], len(ts)), ts, atol=1e-6)
    assert stage["bodies"][0] == "ground" and np.allclose(poses[:, 0], [0, 0, 0, 0, 0, 0, 1])
    A, B, D = np.stack([four_bar_angles(angle) for angle in ts], axis=1)
    flat = {
        "crank": (0 * A, 0 * A, A),
        "coupler": (0.3 * np.cos(A), 0.3 * np.sin(A), A + B),
        "rocker": (1 + 0 * A, 0 * A, D),
    }
    for name, (x, y, angle) in flat.items():
        pose = poses[:, stage["bodies"].index(name)]
        assert np.allclose(pose[:, :3], np.stack([x, y, 0 * x], axis=1), atol=1e-6)
        turned = Rotation.from_quat(pose[:, 3:]).as_matrix()
        wanted = Rotation.from_rotvec(angle[:, None] * [0.0, 0.0, 1.0]).as_matrix()
        assert np.allclose(turned, wanted, atol=1e-6)


def test_quaternions_turn_the_short_way(four_bar):
    poses = pose_tracks(frame_trajectory(*four_bar), 3)
    assert np.all(np.sum(poses[1:, :, 3:] * poses[:-1, :, 3:], axis=-1) > 0.9)


def test_arrows_are_the_loads_at_their_joints(shown, four_bar):
    data, ts = scene_data(shown[1]), four_bar[1].ts
    arrows = data["objects"][0]["arrows"]
    place, force = (numbers(arrows[key], len(ts), 4, 3) for key in ("place", "force"))
    loads = made_up_loads(ts)
    for k, name in enumerate(arrows["names"]):
        assert np.allclose(force[:, k], loads[name].force, rtol=1e-6, atol=1e-4)
    at_b = 0.3 * np.stack([np.cos(ts), np.sin(ts), 0 * ts], axis=1)
    assert np.allclose(place[:, arrows["names"].index("B")], at_b, atol=1e-6)
    assert arrows["limits"] == [500.0 if name == "B" else None for name in arrows["names"]]
    assert np.isclose(arrows["largest"], max(np.linalg.norm(load.force, axis=1).max() for load in loads.values()))


def test_arrows_ask_for_the_axes_and_the_side(four_bar):
    """The same loads in other axes and on the other side are the same arrows, on the children, in the world."""
    system, motion = four_bar
    top, loads, drawn = system.topology, made_up_loads(motion.ts), {}
    R = {name: frame_trajectory(system, motion).R[:, k] for name, k in top.frame_index.items() if name}
    for frame, side in itertools.product(("world", "joint"), ("child", "parent")):
        named = {}
        for joint in top.joints:
            force = np.asarray(loads[joint.name].force) * (1.0 if side == "child" else -1.0)
            axes = R[top.frame_names[joint.frames[side == "child"]]]
            turned = np.einsum("tba,tb->ta", axes, force) if frame == "joint" else force
            turned, none, every = jnp.asarray(turned), jnp.zeros((len(force), 1)), jnp.ones((len(force), 3), bool)
            named[joint.name] = JointReaction(turned, 0 * turned, none, none, every, every)
        ok = jnp.ones(len(motion.ts), bool)
        given = Reactions(named, jnp.zeros((len(ok), 0)), jnp.zeros(len(ok)), ok, frame=frame, side=side)
        arrows = viz.scene(system, motion, loads=given).data["objects"][0]["arrows"]
        drawn[frame, side] = [numbers(arrows[key], len(ok), 4, 3) for key in ("force", "place")]
    for found in drawn.values():
        np.testing.assert_allclose(found, drawn["world", "child"], atol=1e-4)
    assert np.ptp(drawn["world", "child"][0]) > 100.0
    page = viz.plot_polar(given, "B").get_xlabel(), viz.plot_reactions(given, motion.ts, component="x").get_ylabel()
    assert page == ("force x, joint axes, on the parent [N]", "joint force x, joint axes, on the parent [N]")


def test_designs_stand_side_by_side(four_bar):
    system, motion = four_bar
    both = viz.scene({"before": system, "after": system}, {"before": motion, "after": motion})
    left, right = both.data["objects"]
    assert [left["name"], right["name"]] == ["before", "after"]
    assert left["offset"][0] < -0.9 and right["offset"][0] > 0.9 and left["tracks"] == right["tracks"]
    with pytest.raises(mbs.UnknownNameError, match="atfer"):
        viz.scene({"before": system, "after": system}, {"before": motion, "atfer": motion})


@pytest.mark.long
def test_every_joint_and_law_is_on_stage(tmp_path):
    system, states = everything()
    (stage,) = viz.scene(system, states, shapes={"ram": [viz.Solid.box((0.2, 0.1, 0.1), "#ff0000")]}).data["objects"]
    names = {item["name"] for item in stage["items"]}
    joints = {f"{name} joint" for name in ("mast", "ram", "sleeve", "nut", "ball", "cross", "puck")}
    assert names >= joints | {"cylinder", "strut", "dashpot", "muscle", "mount", "link", "bird", "plate", "ram"}
    assert [item["color"] for item in stage["items"] if item["name"] == "ram"] == [[1.0, 0.0, 0.0, 1.0]]
    spanning = {item["name"] for item in stage["items"] if "ends" in item}
    assert spanning == {
        "strut",
        "dashpot",
        "muscle",
        "mount",
        "link",
    }


@pytest.mark.long
@pytest.mark.parametrize("kind", ["spring", "damper"])
def test_what_turns_with_a_joint_has_a_part_on_either_body(kind):
    """A spiral at the ground and a finger of the arm at its outer end, which the arm takes along; drum and vane."""
    b = mbs.SystemBuilder()
    b.body("arm", 1.0, (0.5, 0.0, 0.0), 0.1)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm", parent_frame=(0.3, 0.2, 0.0), child_frame=(-0.1, 0.0, 0.4))
    b.frame("tip", "arm", (1.0, 0.0, 0.0))
    b.force("law", mbs.SpringDamper(3.0) if kind == "spring" else mbs.SpringDamper(0.0, 2.0), joint="pin")
    system = b.build()
    states = jax.vmap(lambda angle: mbs.State.at(system, pin=angle))(jnp.array([0.3, 1.4]))
    data = viz.scene(system, states).data
    (stage,) = data["objects"]
    still, moving = (item for item in stage["items"] if item["name"] == "law")
    assert (still["body"], moving["body"]) == (0, 1)
    own, taken = (numbers(data["solids"][item["solid"]]["vertices"], -1, 3) for item in (still, moving))
    places = numbers(stage["tracks"], 2, 2, 7)[:, 1]
    pin, seen = np.array([0.3, 0.2]), []
    for place in places:
        world = Rotation.from_quat(place[3:]).apply(taken) + place[:3]
        seen.append(world.mean(axis=0)[:2] - pin)
    reach = np.linalg.norm(own[:, :2] - pin, axis=1).max()
    angles = [np.arctan2(y, x) for x, y in seen]
    np.testing.assert_allclose(np.mod(angles[1] - angles[0], 2 * np.pi), 1.1, atol=1e-5)
    assert own[:, 2].min() > 0.0
    if kind == "spring":  # the finger is at the outer end in the first pose
        assert np.min(np.linalg.norm(own[:, :2] - pin - seen[0], axis=1)) < 0.1 * reach
    assert np.linalg.norm(seen[0]) < reach


def test_cables_have_their_spans_and_wheels():
    b = mbs.SystemBuilder()
    b.body("load", 1.0)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(0.1, 0, -1))
    path = [mbs.forces.Attachment(("ground", (-0.1, 0, -1))), mbs.forces.Sheave("ground", 0.1, axis="y")]
    b.cable("rope", [*path, mbs.forces.Attachment("load")], stiffness=1e4)
    system = b.build()
    states = jax.tree.map(lambda *x: np.stack(x), *(mbs.State.at(system, lift=z) for z in (0.0, -0.5)))
    (stage,) = viz.scene(system, states).data["objects"]
    rope = [item for item in stage["items"] if item["name"] == "rope"]
    assert sum("ends" in item and item["part"] == (0.0, 1.0) for item in rope) == 2
    assert len(rope) == 2 + 1 + 1  # spans, the wheel, a ball at the end on the ground
    number = len(stage["bodies"])
    poses = np.frombuffer(base64.b64decode(stage["tracks"]), "<f4").reshape(-1, number, 7)
    ends = np.stack([poses[:, end["body"], :3] for item in rope if "ends" in item for end in item["ends"]], axis=1)
    up = [(-0.1, 0, z) for z in (-1.0, 0.0)] + [(0.1, 0, 0.0)]
    np.testing.assert_allclose(ends[:, :3], [up, up], atol=1e-6)  # vertical on both sides of the wheel
    np.testing.assert_allclose(ends[:, 3], [(0.1, 0, -1.0), (0.1, 0, -1.5)], atol=1e-6)


def test_wrong_names_are_told(four_bar):
    system, motion = four_bar
    with pytest.raises(mbs.UnknownNameError, match="crnak"):
        viz.scene(system, motion, traces=["crnak"])
    with pytest.raises(mbs.UnknownNameError, match="Z"):
        viz.scene(system, motion, loads=made_up_loads(motion.ts), limits={"Z": 1.0})


def test_a_notebook_shows_it(shown):
    inline = shown[0]._repr_html_()
    assert inline.startswith("<iframe srcdoc=") and "<canvas" not in inline  # escaped
    assert "<A & B>" in repr(shown[0])


@pytest.mark.long
def test_a_mode_of_a_structure_swings():
    structure = plate()
    clamped = fem.assemble(structure)
    mode = viz.animate_mode(clamped, mbs.modes(clamped, num=2), 1)
    assert np.allclose(mode.displacement[0], mode.displacement[-1]) and np.isclose(mode.ts[-1], 1 / mode.frequency)
    data = viz.scene(clamped, mode, structures=structure).data
    (mesh,) = data["objects"][0]["meshes"]
    m = len(base64.b64decode(mesh["amplitudes"])) // 4 // len(mode.ts)
    basis = numbers(mesh["basis"], m, structure.num_nodes, 3)
    moved = np.einsum("tm,mvc->tvc", numbers(mesh["amplitudes"], len(mode.ts), m), basis)
    assert m == 1  # a natural mode is one shape
    for k in (0, 7):
        wanted = np.asarray(fem.scatter_rows(structure, mode.displacement[k]))[:, :3]
        assert np.allclose(moved[k], wanted, atol=1e-6)
    assert np.isclose(mesh["largest"], 0.08 * 0.5, rtol=1e-6)  # 8 % of the length
    assert data["clock"].endswith(" Hz")


@pytest.mark.long
def test_stresses_colour_an_elastic_body():
    """Shares of the largest stress at every instant and node, and its size in the legend."""
    structure = beam_structure(1.0, 2)
    frame = flexible.floating_frame(structure, ("0",), num_modes=1)
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm.0")
    system = b.build()
    states = jax.tree.map(lambda x: jnp.stack([x] * 3), mbs.State.at(system))
    values, bodies = 1e6 * np.arange(9.0).reshape(3, 3) - 4e6, {"arm": (structure, frame)}
    data = viz.scene(system, states, structures=bodies, stresses={"arm": values}).data
    (mesh,) = data["objects"][0]["meshes"]
    np.testing.assert_allclose(numbers(mesh["shares"], 3, 3), np.abs(values) / 4e6, rtol=1e-6)
    assert data["scale"] == "stress: 0 to 4 MPa"
    with pytest.raises(mbs.ModelError, match=r"stresses of 'arm' have the shape \(3, 2\), not \(3, 3\)"):
        viz.scene(system, states, structures=bodies, stresses={"arm": values[:, :2]})
    with pytest.raises(mbs.UnknownNameError, match="no elastic body with a structure 'leg'"):
        viz.scene(system, states, structures=bodies, stresses={"leg": values})


def test_what_has_no_positions_is_told():
    bare = mbs.LinearSystem(mass=np.eye(2), stiffness=np.eye(2))
    with pytest.raises(mbs.ModelError, match="without node positions"):
        viz.scene(bare, np.zeros((3, 2)))
    with pytest.raises(ValueError, match="there are 2 modes"):
        viz.animate_mode(bare, mbs.modes(bare), 2)


def test_a_mode_of_a_mechanism_keeps_its_loops_to_first_order(four_bar):
    system, motion = four_bar
    state = jax.tree.map(lambda x: x[7], motion.states)
    roots = jnp.array([2j, -2j])
    made = mbs.vibration.Modes(jnp.ones(2), jnp.array([[1.0 + 0j, 1.0], [2j, -2j]]), roots == 0, roots)
    gaps = []
    for amplitude in (1e-2, 1e-3):
        seen = frame_trajectory(system, viz.animate_mode(system, made, 0, state, amplitude, frames=5))
        index = system.topology.frame_index
        gaps.append(np.linalg.norm(seen.x[0, index["C.parent"]] - seen.x[0, index["C.child"]]))
        moved = np.linalg.norm(seen.x[0, index["C.parent"]] - seen.x[2, index["C.parent"]])
        assert moved > 0.1 * amplitude
    assert gaps[1] < 0.02 * gaps[0] < 0.02 * 1e-3
    with pytest.raises(mbs.ModelError, match="state they belong to"):
        viz.animate_mode(system, made, 0)


def chain(start):
    """Three masses in a row on springs, 1 m apart."""
    K = 1e3 * np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    places = {f"n{k}": (start + k, 0.0, 0.0) for k in range(3)}
    labels = [(name, "x") for name in places]
    return mbs.LinearSystem(mass=np.eye(3), stiffness=K, coordinates=labels, positions=places, interface=["n0", "n2"])


def test_a_mode_of_a_network_swings():
    """Five masses in a row, free: the shapes are cosines, both components move alike where they meet."""
    net = connect({"left": chain(0.0), "right": chain(2.0)}, {"weld": rigid_bond("left.n2", "right.n0")})
    mode = viz.animate_mode(net, mbs.modes(net), 1)
    left, right = moving_meshes(net, mode.displacement).values()
    assert [len(mesh.bars) for mesh, _ in (left, right)] == [2, 2]
    np.testing.assert_allclose(left[1][:, 2], right[1][:, 0], atol=1e-9)
    assert np.isclose(max(np.abs(u).max() for _, u in (left, right)), 0.08 * 2.0)
    names = [mesh["name"] for mesh in viz.scene(net, mode).data["objects"][0]["meshes"]]
    assert names == ["left", "right"]
    with pytest.raises(mbs.UnknownNameError, match="rigth"):
        viz.scene(net, mode, structures={"rigth": plate()})
