"""Public robots beside Pinocchio and MuJoCo: mass matrix, bias efforts and poses at random states."""

import mujoco
import pytest

import jaxmbs as mbs
from tests.io.compared import (
    against_hard_constraint,
    against_mujoco,
    against_pinocchio,
    mujoco_of_urdf,
    mujoco_without_meshes,
)
from tests.io.public_models import LOOPS, MJCF, URDF, looped_text, public_models

SLOW_URDF, SLOW_MJCF = ("panda", "double_pendulum_simple"), ("acrobot", "hopper")
#: Files whose inertias no body can have, and what is said of them.
UNPHYSICAL = {
    "allegro_hand": "link 'link_3.0': principal inertias .* break A",
    "anymal": "link 'base': principal inertias .* break A",
    "hyq": "link 'base_link': principal inertias .* break A",
    "romeo": "link 'RShoulderYawLink': principal inertias .* break A",
}


def _installed(name):
    found = public_models()
    if name not in found:
        pytest.skip("example-robot-data or dm_control is not installed")
    return found[name]


def _marked(names, slow):
    return [pytest.param(name, marks=pytest.mark.slow if name in slow else pytest.mark.long) for name in names]


@pytest.mark.parametrize("name", _marked(URDF, SLOW_URDF))
def test_urdf(name):
    path = _installed(name)
    if name in UNPHYSICAL:
        with pytest.raises(mbs.ModelFileError, match=UNPHYSICAL[name]):
            mbs.io.read_urdf(path)
    read = mbs.io.read_urdf(path, inertias="accept" if name in UNPHYSICAL else "refuse")
    model = None if name in UNPHYSICAL else mujoco_of_urdf(path)
    if model is not None:
        errors = against_mujoco(read, model)
        assert max(errors.values()) < 1e-9, errors
    read.builder.declared.forces.clear()  # dampers are no part of Pinocchio's bias
    errors = against_pinocchio(read, path)
    assert max(errors.values()) < 1e-9, errors


@pytest.mark.parametrize("name", _marked(MJCF, SLOW_MJCF))
def test_mjcf(name):
    path = _installed(name)
    errors = against_mujoco(mbs.io.read_mjcf(path), mujoco.MjModel.from_xml_path(str(path)))
    assert max(errors.values()) < 1e-9, errors


@pytest.mark.long
@pytest.mark.parametrize("name", LOOPS)
def test_loops(name, tmp_path):
    text = looped_text(name)
    if text is None:
        pytest.skip("mujoco_playground or MJX is not installed")
    file = tmp_path / "model.xml"
    file.write_text(text)
    *_, q, v, _ = LOOPS[name]
    read = mbs.io.read_mjcf(file)
    errors = against_hard_constraint(read, mujoco_without_meshes(text), q, v, {})
    assert max(errors.values()) < 1e-8, errors
