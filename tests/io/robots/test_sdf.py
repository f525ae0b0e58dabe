"""SDF files beside Drake: poses relative to one another, every joint, loops, models inside models; faults by name."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from tests.io.compared import ours
from tests.io.texts import ARM_SDF

DRAKE = json.loads((Path(__file__).parent / "drake_arm.json").read_text())


def written(folder, text):
    file = folder / "model.sdf"
    file.write_text(text)
    return file


def model(inside, version="1.9", more=""):
    return f'<sdf version="{version}"><model name="m"{more}>{inside}</model></sdf>'


LINKS = '<link name="a"/><link name="b"><pose>1 0 0 0 0 1.5707963267948966</pose></link>'


def joint(inside="", kind="revolute", child="b"):
    return f'<joint name="j" type="{kind}"><parent>a</parent><child>{child}</child>{inside}</joint>'


@pytest.mark.slow
def test_arm_beside_drake(tmp_path):
    read = mbs.io.read_sdf(written(tmp_path, ARM_SDF), gravity=(0, 0, -9.81))
    read.builder.declared.forces.clear()  # dampers are no part of Drake's bias
    system = read.builder.build()
    q, v, columns = {}, {}, []
    turn = np.eye(len(DRAKE["v"]))
    for name, own in DRAKE["joints"].items():
        there, rates = DRAKE["q"][slice(*own["q"])], DRAKE["v"][slice(*own["v"])]
        if own["kind"] == "ball_rpy":  # its velocity is in the parent's axes, ours in the child's
            R = Rotation.from_euler("xyz", there)
            q[name], v[name] = R.as_quat()[[3, 0, 1, 2]], R.as_matrix().T @ rates
            turn[slice(*own["v"]), slice(*own["v"])] = R.as_matrix()
        else:
            names = [name, f"{name}.2"][: len(there)]
            q |= dict(zip(names, there, strict=True))
            v |= dict(zip(names, rates, strict=True))
        columns += [name] if own["kind"] != "universal" else [name, f"{name}.2"]
    M, bias, R, x = map(np.asarray, ours(system, mbs.State.at(system, q, v)))
    order = np.concatenate([np.arange(system.topology.num_velocities)[system.columns(name)] for name in columns])
    np.testing.assert_allclose(M[np.ix_(order, order)], turn.T @ np.array(DRAKE["M"]) @ turn, atol=1e-12)
    np.testing.assert_allclose(bias[order], turn.T @ np.array(DRAKE["bias"]), atol=1e-12)
    for name, (rotation, place) in DRAKE["poses"].items():
        k = system.topology.frame_index[name]
        np.testing.assert_allclose(R[k], rotation, atol=1e-12)
        np.testing.assert_allclose(x[k], place, atol=1e-12)


def test_what_was_read(tmp_path):
    read = mbs.io.read_sdf(written(tmp_path, ARM_SDF))
    declared = read.builder.declared
    assert list(read.builder.declared.gravity) == [0.1, 0.2, -9.7]
    assert declared.forces["shoulder.damper"].law.damping == 0.6
    assert read.limits["shoulder"] == mbs.io.JointLimits(-1.5, 2.0, 3.0, 80.0)
    assert declared.frames["shoulder_frame"].body == "ground" and "base" not in declared.bodies
    assert {"1 plugin", "1 collision shape"} <= set(read.dropped)


def test_axes_of_every_version(tmp_path):
    axis = "<axis><xyz>1 0 0</xyz>{}</axis>"
    own = mbs.io.read_sdf(written(tmp_path, model(LINKS + joint(axis.format("")))))
    np.testing.assert_allclose(own.builder.declared.joints["j"].kind.axis, [1, 0, 0], atol=1e-15)
    turned = axis.format("<use_parent_model_frame>true</use_parent_model_frame>")
    for version, text in (("1.4", axis.format("")), ("1.6", turned)):
        old = mbs.io.read_sdf(written(tmp_path, model(LINKS + joint(text), version)))
        np.testing.assert_allclose(old.builder.declared.joints["j"].kind.axis, [0, -1, 0], atol=1e-15)


def test_bases_statics_and_models_inside(tmp_path):
    inner = '<model name="in"><pose>0 0 2 0 0 0</pose><link name="a"/>'
    inner += '<frame name="f"><pose>0 1 0 0 0 0</pose></frame></model>'
    text = model(LINKS + inner + '<joint name="j" type="fixed"><parent>a</parent><child>in::a</child></joint>')
    read = mbs.io.read_sdf(written(tmp_path, text), fixed="welds")
    assert {j.kind.__class__.__name__ for j in read.builder.declared.joints.values()} == {"Free", "Weld"}
    assert set(read.builder.declared.joints) == {"a.base", "b.base", "j"}
    np.testing.assert_allclose(read.builder.declared.frames["in::f"].pose.position, [0, 1, 0])
    held = mbs.io.read_sdf(written(tmp_path, text), base="fixed")
    assert held.builder.declared.bodies == {} and held.builder.declared.frames["in::a"].body == "ground"
    still = mbs.io.read_sdf(written(tmp_path, model("<static>true</static>" + LINKS + joint())))
    assert still.builder.declared.bodies == {}


def test_a_loop_and_a_mimic(tmp_path):
    links = "".join(
        f'<link name="{n}"><pose>{x} 0 {z} 0 0 0</pose></link>' for n, x, z in ("a00", "b01", "c11", "d10")
    )
    ends = (("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"))
    joints = "".join(
        f'<joint name="{p}{c}" type="revolute"><parent>{p}</parent><child>{c}</child>'
        "<axis><xyz>0 1 0</xyz></axis></joint>"
        for p, c in ends
    )
    held = '<joint name="w" type="fixed"><parent>world</parent><child>a</child></joint>'
    read = mbs.io.read_sdf(written(tmp_path, model(links + joints + held)))
    system = read.builder.build()
    assert system.topology.cut_joints == ("da",) and system.topology.mobility == 1
    numbers = "<multiplier>2</multiplier><offset>0.3</offset><reference>0.1</reference>"
    follows = joint(f'<axis><mimic joint="k">{numbers}</mimic></axis>')
    leads = '<joint name="k" type="revolute"><parent>world</parent><child>a</child></joint>'
    law = (
        mbs.io.read_sdf(written(tmp_path, model(LINKS + follows + leads))).builder.declared.constraints["j.mimic"].law
    )
    np.testing.assert_allclose(law.coefficients, [1, -2])
    np.testing.assert_allclose(law.offset, 0.3 - 2 * 0.1)


FAULTS = {
    "joint 'j': there is no link 'c'": model(LINKS + joint(child="c")),
    "type='gearbox' is none of revolute": model(LINKS + joint(kind="gearbox")),
    "its axis is zero": model(LINKS + joint("<axis><xyz>0 0 0</xyz></axis>")),
    "'1 2 x' is not 3 numbers": model(LINKS + joint("<axis><xyz>1 2 x</xyz></axis>")),
    "<ixx> 'wide' is not a number": model(
        '<link name="a"><inertial><inertia><ixx>wide</ixx></inertia></inertial></link>'
    ),
    "the name 'a' is given twice": model('<link name="a"/><link name="a"/>'),
    "'a' is given relative to itself": model(
        '<link name="a"><pose relative_to="b"/></link><link name="b"><pose relative_to="a"/></link>'
    ),
    "the pose of 'a': there is no frame 'z'": model('<link name="a"><pose relative_to="z"/></link>'),
    "frame='b' of its pose is not supported": model('<link name="a"><pose frame="b">1 0 0 0 0 0</pose></link>'),
    "relative_to='a', which needs version 1.7": model(
        '<link name="a"/><link name="b"><pose relative_to="a">1 0 0 0 0 0</pose></link>', "1.6"
    ),
    "attached to itself": model('<link name="a"/><frame name="f" attached_to="f"/>' + joint(child="f")),
    "it includes other files": model('<include><uri>model://x</uri></include><link name="a"/>'),
    "placement_frame is not supported": model(LINKS, more=' placement_frame="a"'),
    "give its <screw_thread_pitch>": model(LINKS + joint(kind="screw")),
    "to be found from its shapes": model('<link name="a"><inertial auto="true"/></link>'),
    "it has no model": '<sdf version="1.9"/>',
    "its outermost element is <robot>": "<robot/>",
}  # fmt: skip


@pytest.mark.parametrize("message", FAULTS)
def test_faults_by_name(message, tmp_path):
    with pytest.raises(mbs.ModelFileError, match=message):
        mbs.io.read_sdf(written(tmp_path, FAULTS[message]))
