"""MJCF files beside MuJoCo: every kind of joint, offset, spring and actuator; loops beside a hard constraint."""

import mujoco
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.io.robots._servo import ServoActuator
from tests.io.compared import against_hard_constraint, against_mujoco
from tests.io.texts import BENCH_MJCF, DRIVES_MJCF, LOOPS_MJCF

# what has no name in the file is called by its body here
NAMED = BENCH_MJCF.replace('<joint axis="1 0 1"', '<joint name="ear.hinge" axis="1 0 1"')


def written(folder, text, name="model.xml"):
    file = folder / name
    file.write_text(text)
    return file


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return mbs.io.read_mjcf(written(tmp_path_factory.mktemp("mjcf"), BENCH_MJCF))


@pytest.mark.long
def test_bench_against_mujoco(bench):
    errors = against_mujoco(bench, mujoco.MjModel.from_xml_string(NAMED))
    assert max(errors.values()) < 1e-10, errors


@pytest.mark.long
def test_drives_against_mujoco(tmp_path):
    model = mujoco.MjModel.from_xml_string(DRIVES_MJCF)
    random = np.random.default_rng(3)
    controls = {model.actuator(a).name: random.normal() for a in range(model.nu)}
    found = mbs.io.read_mjcf(written(tmp_path, DRIVES_MJCF), controls=controls)
    errors = against_mujoco(found, model, seeds=range(4), controls=controls, spread=0.2)
    assert max(errors.values()) < 1e-10, errors
    system = found.builder.build()
    state = mbs.State.at(system, found.start, {"hinge": 0.3, "elbow": -0.2})
    assert state.ok and system.velocities(state)["sum"] == pytest.approx(0.7 * 0.3 + 1.2 * 0.2)


def test_drives_that_were_read(tmp_path):
    text = DRIVES_MJCF.replace('frictionloss="0.3"', 'frictionloss="0.3" actuatorfrcrange="-8 6"')
    text = text.replace("</actuator>", '<motor name="last" site="tip" refsite="roof"/></actuator>').replace(
        "</tendon>",
        '<spatial name="tackle"><site site="roof"/><site site="mid"/><pulley divisor="2"/><site site="roof"/>'
        '<site site="tip"/></spatial></tendon><equality><tendon name="tied" tendon1="sum" polycoef="0.1 0 0 0 0"/>'
        '<tendon name="taut" tendon1="over"/></equality>',
    )
    found = mbs.io.read_mjcf(written(tmp_path, text), friction="ignore", stops=50.0)
    declared = found.builder.declared
    assert set(declared.constraints) == {"hinge.gear", "sum.coupler", "tied", "taut"}
    assert "sum.stop" in declared.forces and found.limits["sum"].upper == 2.0
    assert {"rope.spring", "muscle.spring", "sum.spring", "arm.gravcomp"} <= set(declared.forces)
    assert not any(name.endswith(".friction") for name in declared.forces)
    left = str(found)
    for part in (
        "friction losses of the joints 'hinge'",
        "friction losses of the tendon 'rope'",
        "the tendon 'tackle': it has pulleys",
        "the actuator 'last': it acts on no joint, tendon or site alone (site)",
        "the limit of the sum of actuators on 'hinge'",
        "'muscle', 'over' go round their bodies",
        "2 equalities hold exactly: solref and solimp are ignored",
    ):
        assert part in left, left


SWITCHED = """<worldbody><body name="b"><joint name="j" frictionloss="2"/><geom size=".1"/></body></worldbody>
<actuator><motor name="m" joint="j"/><motor name="n" joint="j" group="3"/></actuator>"""


@pytest.mark.parametrize(
    ("option", "forces"),
    [
        ("<option/>", {"j.friction", "m", "n"}),
        ('<option actuatorgroupdisable="3"/>', {"j.friction", "m"}),
        ('<option><flag actuation="disable"/></option>', {"j.friction"}),
        ('<option><flag frictionloss="disable"/></option>', {"m", "n"}),
    ],
)
def test_what_the_file_switches_off(option, forces, tmp_path):
    found = mbs.io.read_mjcf(written(tmp_path, f"<mujoco>{option}{SWITCHED}</mujoco>"))
    assert set(found.builder.declared.forces) == forces
    assert sum("the file switches it off" in part for part in found.dropped) == 2 - len(forces & {"m", "n"})


def test_an_actuator_saturates_and_lags():
    servo = ServoActuator(2.0, (3.0, 0.5, 0.0), (0.1, -1.0, -0.2), 2.0, (-1.0, 1.0), (-2.5, 2.5))
    np.testing.assert_allclose(servo.effort(0.4, 0.1, 0.0), 2 * min(2.5, 3.0 + 0.5 * 0.8 + 0.1 - 0.8 - 0.04))
    np.testing.assert_allclose(servo.effort(1.0, 0.1, 0.0), 2 * (3.0 + 0.5 * 2.0 + 0.1 - 2.0 - 0.04))
    lag = ServoActuator(2.0, activation="filter", time_constant=0.5)
    assert float(lag.rate(0.0, 0.0, {"activation": 0.4}, 0.0)["activation"]) == pytest.approx(1.6 / 0.5)
    held = ServoActuator(2.0, activation="integrator", activation_range=(-1.0, 1.0))
    rates = [float(held.rate(0.0, 0.0, {"activation": a}, 0.0)["activation"]) for a in (0.5, 1.0)]
    assert rates == [2.0, 0.0] and float(held.effort(0.0, 0.0, {"activation": 1.7}, 0.0)) == 1.0
    assert ServoActuator(0.0, activation="filter").faults() == ["a filter, and nothing else, takes a time_constant"]


def test_what_was_read_and_left_out(bench):
    declared = bench.builder.declared
    assert {"turret", "head", "ear", "ball", "turret.yaw", "lift.rotor"} <= set(declared.bodies)
    assert {declared.frames[name].body for name in ("stand", "mark")} == {"ground"}
    assert declared.frames["body4"].body == "head" and declared.frames["nose"].body == "head"
    assert bench.start["yaw"] == pytest.approx(np.radians(20)) and bench.start["lift"] == 0.1
    np.testing.assert_array_equal(bench.start["float"], [1, 0, 2, 1, 0, 0, 0])
    assert bench.poses["up"]["lift"] == 0.2 and "neck" not in bench.poses["up"]
    assert bench.limits["yaw"].upper == pytest.approx(np.pi / 2)
    left = str(bench)
    for part in (
        "1 camera",
        "1 light",
        "1 sensor",
        "contacts of 7 shapes",
        "limits of 1 joint",
    ):
        assert part in left, left
    assert declared.forces["lag"].law.activation == "filter"
    np.testing.assert_array_equal(declared.forces["push"].law.control_range, [-1.0, 1.0])


def test_options(tmp_path):
    file = written(tmp_path, BENCH_MJCF)
    other = mbs.io.read_mjcf(file, fixed="welds", stops=5.0, armature="drop", controls={"aim": 0.4})
    declared = other.builder.declared
    assert "stand" in declared.bodies and declared.forces["yaw.stop"].law.stiffness == 5.0
    assert "lift.rotor" not in declared.bodies
    assert any("armature of the joints 'lift', 'ear.hinge'" in sentence for sentence in other.dropped)
    # gear (kp u - kp gear x - kv gear v)
    effort = declared.forces["aim"].law.effort(np.float64(0.1), np.float64(0.3), np.float64(0.0))
    np.testing.assert_allclose(effort, 2 * (7 * 0.4 - 7 * 2 * 0.1 - 0.5 * 2 * 0.3), rtol=1e-14)
    with pytest.raises(mbs.UnknownNameError, match="no actuator 'aims': did you mean 'aim'"):
        mbs.io.read_mjcf(file, controls={"aims": 0.4})
    with pytest.raises(ValueError, match="tendons = 'cut': one of"):
        mbs.io.read_mjcf(file, tendons="cut")


@pytest.mark.long
def test_loops_against_a_hard_constraint(tmp_path):
    found = mbs.io.read_mjcf(written(tmp_path, LOOPS_MJCF))
    system = found.builder.build()
    assert system.topology.mobility == 1 and "C1" in system.topology.cut_joints
    model = mujoco.MjModel.from_xml_string(LOOPS_MJCF)
    errors = against_hard_constraint(found, model, {"A": 0.4}, {"A": 1.3}, {"B": -0.1, "D": 0.3})
    assert errors["closing"] < 1e-9 and errors["accelerations"] < 1e-8, errors


def test_includes_and_meshes_inside_the_folder(tmp_path):
    (tmp_path / "parts").mkdir()
    written(
        tmp_path,
        '<mujocoinclude><body name="bob"><joint name="pin"/><include file="shape.xml"/></body></mujocoinclude>',
        "parts/bob.xml",
    )
    tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    (tmp_path / "parts" / "tetra.obj").write_text(tetrahedron)
    written(
        tmp_path, '<mujocoinclude><geom type="mesh" mesh="tetra" density="60"/></mujocoinclude>', "parts/shape.xml"
    )
    main = (
        '<mujoco><compiler meshdir="parts"/><asset><mesh file="tetra.obj"/></asset><worldbody>%s</worldbody></mujoco>'
    )
    file = written(tmp_path, main % '<include file="parts/bob.xml"/>')
    assert float(mbs.io.read_mjcf(file).builder.declared.bodies["bob"].mass) == pytest.approx(10.0)
    light = '<body name="bob"><joint/><inertial mass="2" pos="0 0 0" diaginertia="1 1 1"/><geom mesh="gone"/></body>'
    asset = '<mujoco><asset><mesh name="gone" file="gone.stl"/></asset><worldbody>%s</worldbody></mujoco>'
    found = mbs.io.read_mjcf(written(tmp_path, asset % light))
    assert float(found.builder.declared.bodies["bob"].mass) == 2.0 and "the shapes of 1 mesh" in found.dropped
    heavy = '<body name="bob"><joint/><geom type="mesh" mesh="gone"/></body>'
    with pytest.raises(mbs.ModelFileError, match="body 'bob' takes its mass from the mesh 'gone.stl'") as told:
        mbs.io.read_mjcf(written(tmp_path, asset % heavy))
    assert len(told.value.faults) == 1


BODY = '<body name="b"><joint name="j"/><geom size=".1"/></body>'
REFUSED = {
    "it has tendons, 'rope'": f"<worldbody>{BODY}</worldbody>"
    '<tendon><fixed name="rope"><joint joint="j" coef="1"/></fixed></tendon>',
    "plugins .<plugin>., which are not supported": '<extension><plugin plugin="mujoco.pid"/></extension>',
    "MuJoCo refuses it": f"<worldbody>{BODY}{BODY}</worldbody>",
    "no such file inside": '<include file="../../etc/passwd"/>',
    "makes more than 10000 copies": f'<worldbody><replicate count="1e9">{BODY}</replicate></worldbody>',
    "its outermost element is <robot>": None,
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused_by_name(message, tmp_path):
    text = REFUSED[message]
    file = written(tmp_path, "<robot/>" if text is None else f"<mujoco>{text}</mujoco>")
    with pytest.raises(mbs.ModelFileError, match=message):
        mbs.io.read_mjcf(file, tendons="refuse")


def test_warnings_go_to_the_report_and_to_no_file(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    file = written(tmp_path, f'<mujoco><compiler settotalmass="3"/><worldbody>{BODY}</worldbody></mujoco>')
    found = mbs.io.read_mjcf(file)
    assert any("MuJoCo warns" in sentence and "settotalmass" in sentence for sentence in found.dropped)
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.xml"] and capfd.readouterr() == ("", "")


def test_tendons_can_be_dropped(tmp_path):
    text = REFUSED["it has tendons, 'rope'"] + '<actuator><motor tendon="rope"/></actuator>'
    found = mbs.io.read_mjcf(written(tmp_path, f"<mujoco>{text}</mujoco>"), tendons="drop")
    assert found.dropped[0] == "the tendons 'rope', with actuators and equalities of tendons"
