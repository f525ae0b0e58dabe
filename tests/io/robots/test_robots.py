"""Files of robots as others write them: namespaces, encodings, names, inertias, mimics; what stands in them twice."""

import itertools
import time

import jax
import numpy as np
import pinocchio as pin
import pytest

import jaxmbs as mbs
from tests.io.texts import ARM_URDF

INERTIA = '<inertia ixx="{}" iyy="{}" izz="{}" ixy="0" ixz="0" iyz="0"/>'
LINK = '<link name="{}"><inertial><mass value="1"/>' + INERTIA.format(0.1, 0.1, 0.1) + "</inertial></link>"


def read(text, folder, name="a.urdf", **options):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return (mbs.io.read_urdf if name.endswith("urdf") else mbs.io.read_mjcf)(folder / name, **options)


def faults(text, folder, **options):
    with pytest.raises(mbs.ModelFileError) as told:
        read(text, folder, **options)
    return "\n".join(told.value.faults)


def chain(*joints, names=("a", "b", "c", "d")):
    """Links in a row from `base` on joints "1", "2" ... of (type, what stands in the joint)."""
    links = "".join(LINK.format(name) for name in names[: len(joints)])
    made = ""
    for k, (kind, inside) in enumerate(joints):
        parent = names[k - 1] if k else "base"
        made += (
            f'<joint name="{k + 1}" type="{kind}"><parent link="{parent}"/><child link="{names[k]}"/>{inside}</joint>'
        )
    return f'<robot name="r"><link name="base"/>{links}{made}</robot>'


def leaves(robot):
    return jax.tree.leaves(robot.builder.build())


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1", "windows-1252", "gb2312"])
@pytest.mark.parametrize("space", ["", ' xmlns="http://www.ros.org/robot"', ' xmlns:own="urn:x"'])
def test_namespaces_and_encodings(encoding, space, tmp_path):
    word = "\u00dc" if encoding != "gb2312" else "\u673a"
    head = f'<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>\n'
    text = ARM_URDF.replace('<?xml version="1.0"?>\n', head).replace("<robot", f"<!-- {word} --><robot{space}")
    text = text.replace('"fore"', f'"{word}"')
    found = read(text.encode(encoding), tmp_path)
    assert word in found.builder.declared.bodies
    for x, y in zip(leaves(found), leaves(read(ARM_URDF, tmp_path)), strict=True):
        np.testing.assert_array_equal(x, y)


def test_a_namespace_of_mjcf(tmp_path):
    body = "<worldbody><body><joint/><geom size='1'/></body></worldbody>"
    assert len(read(f"<mujoco xmlns='urn:m'>{body}</mujoco>", tmp_path, "a.xml").builder.declared.bodies) == 1


def test_encodings_that_are_refused(tmp_path):
    head = '<?xml version="1.0" encoding="{}"?><robot name="r"/>'
    assert "encoding 'unicode_escape' is not read" in faults(head.format("unicode_escape"), tmp_path)
    assert "is not UTF-8 text" in faults('<robot name="\u00dc"/>'.encode("latin-1"), tmp_path)
    assert "is not ASCII text" in faults(head.format("ascii").replace('"r"', '"\u00dc"'), tmp_path)
    assert "expand them first" in faults(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:macro name="m"/></robot>', tmp_path
    )


def test_names_that_are_taken(tmp_path):
    """A root link called ground, and one that bears the name of a joint's frame, beside Pinocchio's total mass."""
    text = ARM_URDF.replace('"base"', '"ground"').replace('"tool"', '"rail.parent"')
    found = read(text, tmp_path)
    declared = found.builder.declared
    assert declared.frames["ground 2"].body == "ground" and declared.frames["rail.parent 2"].body == "slide"
    assert found.notes == (
        "link 'ground' is called 'ground 2', as its name is taken",
        "link 'rail.parent' is called 'rail.parent 2', as its name is taken",
    )
    free = read(text, tmp_path, base="free").builder.declared
    theirs = pin.buildModelFromUrdf(str(tmp_path / "a.urdf"), pin.JointModelFreeFlyer())
    assert sum(body.mass for body in free.bodies.values()) == pytest.approx(sum(I.mass for I in theirs.inertias))
    found.builder.build()


def test_names_that_are_taken_in_mjcf(tmp_path):
    text = (
        "<mujoco><worldbody><body name='ground'><joint name='j' damping='1'/><geom size='1'/><site name='j.child'/>"
    )
    text += "</body></worldbody><actuator><motor name='j.damper' joint='j'/></actuator></mujoco>"
    found = read(text, tmp_path, "a.xml", controls={"j.damper": 2.0})
    assert "ground 2" in found.builder.declared.bodies and set(found.builder.declared.forces) == {
        "j.damper",
        "j.damper 2",
    }
    assert len(found.notes) == 2 and any("j.damper 2" in line for line in found.dropped)
    found.builder.build()


def body(inertia, folder, **options):
    text = '<robot name="r"><link name="x"><inertial><mass value="2"/>' + INERTIA.format(*inertia)
    return read(text + "</inertial></link></robot>", folder, base="free", **options)


def test_inertias_that_no_body_can_have(tmp_path):
    """2.5 % short: refused, repaired to the nearest second moment, or taken; always said."""
    short = (1.0, 0.95, 2.0)
    with pytest.raises(mbs.ModelFileError, match=r"break A \+ B >= C by 2.5 %: inertias='repair'"):
        body(short, tmp_path)
    repaired = body(short, tmp_path, inertias="repair")
    values = np.asarray(repaired.builder.declared.bodies["x"].inertia)
    np.testing.assert_allclose(values, np.diag([1.025, 0.975, 2.0]), rtol=1e-12)
    assert "nearest" in repaired.notes[0]
    taken = body(short, tmp_path, inertias="accept")
    np.testing.assert_array_equal(taken.builder.declared.bodies["x"].inertia, np.diag(short))
    assert "as they are" in taken.notes[0] and "note: link 'x'" in str(taken)
    mbs.save_model(taken.builder, tmp_path / "a.json")
    built = [leaves(taken), jax.tree.leaves(mbs.load_model(tmp_path / "a.json").build())]
    for x, y in zip(*built, strict=True):
        np.testing.assert_array_equal(x, y)
    for mode in ("repair", "accept"):
        with pytest.raises(mbs.ModelError, match="negative principal value"):
            body((1.0, -0.5, 2.0), tmp_path, inertias=mode).builder.build()
    with pytest.raises(ValueError, match="one of 'refuse', 'repair', 'accept'"):
        body(short, tmp_path, inertias="mend")


def test_inertias_of_four_printed_digits(tmp_path):
    """Plates, whose rule is an equation, printed with four digits: read with a note, in turned axes as well."""
    random = np.random.default_rng(0)
    noted = 0
    for a, b in random.uniform(0.1, 10.0, (30, 2)):
        found = body([f"{x:.4g}" for x in (a, b, a + b)], tmp_path)
        noted += len(found.notes)
        values = np.linalg.eigvalsh(np.asarray(found.builder.declared.bodies["x"].inertia))
        np.testing.assert_allclose(values, np.sort([a, b, a + b]), rtol=2e-3)
        assert not found.builder.faults()
    assert 5 < noted < 30


MIMIC = '<mimic joint="{}" multiplier="{}" offset="{}"/>'.format
WRONG_MIMICS = {
    "joint '1' mimics itself": [("revolute", MIMIC("1", 1, 0))],
    "there is no joint 'elbow'": [("revolute", MIMIC("elbow", 1, 0))],
    "there is no joint ''": [("revolute", MIMIC("", 1, 0))],
    "joints '1', '2' mimic one another in a cycle": [
        ("revolute", MIMIC("2", 2, 0)),
        ("revolute", MIMIC("1", 0.5, 0)),
    ],
    "joints '2', '3' mimic one another": [
        ("revolute", MIMIC("2", 2, 0)),
        ("revolute", MIMIC("3", 0.5, 0)),
        ("revolute", MIMIC("2", 0.5, 0)),
    ],
    "'2' has several coordinates": [("revolute", MIMIC("2", 1, 0)), ("planar", "")],
    "joint '1': it mimics '2', but '1' has several": [("floating", MIMIC("2", 1, 0)), ("revolute", "")],
    "multiplier='inf' is not finite": [("revolute", MIMIC("2", "inf", 0)), ("revolute", "")],
    "offset='1_0' is not a number": [("revolute", MIMIC("2", 1, "1_0")), ("revolute", "")],
    "joint '1' has 2 <mimic>": [("revolute", 2 * MIMIC("2", 1, 0)), ("revolute", "")],
    "joint '1' has 2 <axis>": [("revolute", '<axis xyz="1 0 0"/><axis xyz="0 1 0"/>')],
}


@pytest.mark.parametrize("message", WRONG_MIMICS)
def test_wrong_mimics(message, tmp_path):
    assert message in faults(chain(*WRONG_MIMICS[message]), tmp_path)


@pytest.mark.slow
def test_mimics_that_hold_a_joint_are_said(tmp_path):
    found = read(chain(("revolute", MIMIC("2", 3, 0.4)), ("fixed", ""), ("revolute", MIMIC("1", 0, 0.1))), tmp_path)
    assert found.notes == (
        "joint '1' is fixed at 0.4, the offset of its mimic: its leader '2' is fixed",
        "joint '3' is fixed at 0.1, the offset of its mimic: its multiplier is zero",
    )
    q = mbs.State.at(found.builder.build()).coordinates
    np.testing.assert_allclose(np.sort(q), [0.1, 0.4], rtol=1e-9)
    chained = read(chain(("revolute", ""), ("revolute", MIMIC("1", 2, 0)), ("revolute", MIMIC("2", 3, 1))), tmp_path)
    system = chained.builder.build()
    found = system.coordinates(mbs.State.at(system, {"1": 0.1}))
    np.testing.assert_allclose([found["2"], found["3"]], [0.2, 1.6], rtol=1e-9)


def test_what_is_not_known_is_listed(tmp_path):
    """Attributes that a reader of another spelling would use, damping of several coordinates, unknown elements."""
    strange = '<limit uper="1"/><origin quat_xyzw="0 0 0 1"/><safety_controller k_velocity="1"/>'
    text = chain(("revolute", strange), ("planar", '<dynamics damping="2"/>')).replace(
        "</robot>", "<gazebo/></robot>"
    )
    left = "\n".join(read(text, tmp_path).dropped)
    for part in (
        *("uper= of <limit>", "quat_xyzw= of <origin>", "<safety_controller> of a joint"),
        *("damping of the joints '2'", "1 <gazebo> element"),
    ):
        assert part in left


def test_two_megabytes_of_unknown_elements(tmp_path):
    """Each element of a kind of its own: a quarter of a second, not minutes; the list is short."""
    text = chain(("revolute", ""))
    names = ("".join(letters) for letters in itertools.product("abcdefgh", repeat=6))
    odd = "".join(f"<{name}/>" for name in itertools.islice(names, 60_000))
    start = time.process_time()
    found = read(text.replace("</robot>", odd + "</robot>"), tmp_path)
    assert time.process_time() - start < 10 and len(found.dropped) < 30
    assert found.dropped[-1].startswith("and 59980 kinds")


@pytest.mark.slow
def test_many_faults_end(tmp_path):
    """Thousands of joints on links that are not there."""
    joints = "".join(
        f'<joint name="j{k}" type="fixed"><parent link="p{k}"/><child link="link{k}"/></joint>' for k in range(4000)
    )
    links = "".join(f'<link name="link{k}"/>' for k in range(4000))
    start = time.process_time()
    assert len(faults(f'<robot name="r">{links}{joints}</robot>', tmp_path).splitlines()) <= 51
    assert time.process_time() - start < 10


def test_a_frame_as_an_end_of_a_joint(tmp_path):
    """Links on fixed joints become frames; joints to them are joints there."""
    by_frame, by_body = (read(ARM_URDF, tmp_path).builder for _ in range(2))
    for builder in (by_frame, by_body):
        builder.body("camera", 0.2, inertia=(1e-4, 1e-4, 1e-4))
    by_frame.joint("tilt", mbs.Revolute("x"), "tool", "camera")
    by_body.joint("tilt", mbs.Revolute("x"), "slide", "camera", parent_frame="tool")
    for x, y in zip(*(jax.tree.leaves(b.build()) for b in (by_frame, by_body)), strict=True):
        np.testing.assert_array_equal(x, y)
