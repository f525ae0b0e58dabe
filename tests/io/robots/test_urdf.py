"""URDF files beside Pinocchio and MuJoCo, options, and every fault by name."""

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

import jaxmbs as mbs
from tests.io.compared import against_pinocchio, state_of
from tests.io.texts import ARM_URDF


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("urdf") / "arm.urdf"
    file.write_text(ARM_URDF)
    return file


@pytest.fixture(scope="module")
def arm(path):
    return mbs.io.read_urdf(path)


def test_arm_against_pinocchio(arm, path):
    declared = arm.builder.declared
    bare = mbs.SystemBuilder()
    bare.declared.bodies.update(declared.bodies)
    bare.declared.frames.update(declared.frames)
    bare.declared.joints.update(declared.joints)
    bare.declared.constraints.update(declared.constraints)
    errors = against_pinocchio(mbs.io.Imported(bare), path)
    assert max(errors.values()) < 1e-12, errors


def test_what_was_read(arm):
    declared = arm.builder.declared
    assert set(declared.bodies) == {"upper", "fore", "slide", "finger"}
    assert {name: frame.body for name, frame in declared.frames.items()} == {
        "base": "ground",
        "flange": "slide",
        "tool": "slide",
    }
    assert set(declared.joints) == {"shoulder", "elbow", "rail", "squeeze"}
    assert declared.forces["shoulder.damper"].law.damping == 0.6
    assert float(declared.forces["shoulder.friction"].law.friction.dynamic) == 0.2
    mimic = declared.constraints["squeeze.mimic"].law
    assert mimic.joints == ("squeeze", "elbow") and mimic.offset == 0.1
    np.testing.assert_array_equal(mimic.coefficients, [1.0, 0.5])
    assert arm.limits["shoulder"] == mbs.io.JointLimits(-1.5, 2.0, 3.0, 80.0)
    assert arm.limits["elbow"] == mbs.io.JointLimits(velocity=4.0, effort=30.0)
    left = str(arm)
    for part in ("1 collision shape", "<transmission>", "limits of 3 joints"):
        assert part in left


def test_stops_welds_and_a_free_base(path):
    read = mbs.io.read_urdf(path, stops=1e4, fixed="welds", base="free", friction="ignore")
    held = read.builder.declared
    assert "friction of the joints 'shoulder'" in str(read) and "shoulder.friction" not in held.forces
    stop = held.forces["rail.stop"].law
    assert (stop.stiffness, stop.lower, stop.upper) == (1e4, 0.0, 0.2) and "elbow.stop" not in held.forces
    assert isinstance(held.joints["bolts"].kind, mbs.Weld) and "flange" in held.bodies
    assert isinstance(held.joints["base"].kind, mbs.Free)
    assert np.sum([body.mass for body in held.bodies.values()]) == pytest.approx(7.7)
    for option in ({"base": "loose"}, {"fixed": "glued"}):
        with pytest.raises(ValueError, match="one of"):
            mbs.io.read_urdf(path, **option)


@pytest.mark.slow
def test_gradient_by_the_payload(arm, path):
    """Of the torque at the shoulder, beside differences of Pinocchio's."""
    builder = arm.builder
    q = {"shoulder": [0.3], "elbow": [-0.7], "rail": [0.1], "squeeze": [0.45]}
    v = {name: [0.4] for name in q}
    system = builder.build()
    state, k = state_of(system, q, v), list(system.topology.body_names).index("slide")

    def torque(mass):
        import equinox as eqx

        heavy = eqx.tree_at(lambda s: s.mass, system, system.mass.at[k].add(mass))
        return mbs.inverse_dynamics(heavy, state, jnp.ones(4))[0]

    model = pin.buildModelFromUrdf(str(path))
    rail = model.getJointId("rail")

    def theirs(mass):
        other = model.copy()
        com = other.inertias[rail].lever
        other.inertias[rail] = other.inertias[rail] + pin.Inertia(mass, com, np.zeros((3, 3)))
        psi = np.array([0.3, np.cos(-0.7), np.sin(-0.7), 0.1, 0.45])
        order = [model.getJointId(name) for name in q]
        assert order == [1, 2, 3, 4]
        return pin.rnea(other, other.createData(), psi, 0.4 * np.ones(4), np.ones(4))[0]

    slope, h = jax.grad(torque)(0.5), 0.5
    np.testing.assert_allclose(slope, (theirs(0.5 + h) - theirs(0.5 - h)) / (2 * h), rtol=1e-9)


FAULTS = {
    "no link 'uper': did you mean 'upper'": ('link="upper"/><child link="fore"', 'link="uper"/><child link="fore"'),
    "joint 'rail': type='slider' is none of": ('name="rail" type="prismatic"', 'name="rail" type="slider"'),
    "joint 'elbow': its axis is zero": ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'),
    "link 'fore', mass: value='heavy' is not a number": ('<mass value="1.5"/>', '<mass value="heavy"/>'),
    "xyz='0 0' is not three numbers": ('<origin xyz="0 0 0.12"/>', '<origin xyz="0 0"/>'),
    "xyz='0 0 nan' is not three numbers": ('<origin xyz="0 0 0.12"/>', '<origin xyz="0 0 nan"/>'),
    "link 'fore' is defined twice": ('<link name="tool"/>', '<link name="tool"/><link name="fore"/>'),
    "no joint 'elbw': did you mean 'elbow'": ('mimic joint="elbow"', 'mimic joint="elbw"'),
    "2 links that no joint carries, 'base', 'spare'": (
        '<link name="tool"/>',
        '<link name="tool"/><link name="spare"/>',
    ),
    "its lower limit lies above": ('lower="-1.5"', 'lower="2.5"'),
    "is the child of two joints": ('<child link="tool"/>', '<child link="finger"/>'),
    "it declares a document type": ("<robot", "<!DOCTYPE robot><robot"),
    "it is not well-formed XML": ("</robot>", ""),
    "its outermost element is <model>": ('<robot name="arm">', "<model>"),
}


@pytest.mark.parametrize("message", FAULTS)
def test_faults_by_name(message, tmp_path):
    old, new = FAULTS[message]
    assert old in ARM_URDF
    text = ARM_URDF.replace(old, new)
    file = tmp_path / "bad.urdf"
    file.write_text(text.replace("</robot>", "</model>") if new == "<model>" else text)
    with pytest.raises(mbs.ModelFileError) as caught:
        mbs.io.read_urdf(file)
    assert any(message in fault for fault in caught.value.faults), caught.value.faults
    assert caught.value.path == str(file)


def test_all_faults_in_one_report(tmp_path):
    file = tmp_path / "bad.urdf"
    file.write_text(ARM_URDF.replace('value="3"', 'value="x"').replace('value="2"', 'value="y"'))
    with pytest.raises(mbs.ModelFileError) as caught:
        mbs.io.read_urdf(file)
    assert len(caught.value.faults) == 2
    with pytest.raises(mbs.ModelFileError, match="it cannot be read: No such file"):
        mbs.io.read_urdf(tmp_path / "none.urdf")
