"""The catalogue has every kind of thing that models are made of, and is made from the docstrings."""

import importlib
import importlib.util
import inspect
import sys
from pathlib import Path

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks, contact, elements, forces, friction, hydraulics, joints, ode, reductions
from jaxmbs.math._rotation import rotation_vector

EXTENSIONS = Path(__file__).parent.parent / "docs" / "_ext"
ROOMS = (joints, forces, friction, contact, hydraulics, blocks, elements, reductions, ode)


@pytest.fixture(scope="module")
def catalogue():
    before = list(sys.path)
    spec = importlib.util.spec_from_file_location("catalogue", EXTENSIONS / "catalogue.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    sys.path[:] = before


def test_every_public_class_is_in_it(catalogue):
    found = [f"{room}.{name}" for kinds in catalogue.sections().values() for name, (room, _) in kinds.items()]
    names = {(room, name) for room in ROOMS for name in room.__all__ if inspect.isclass(getattr(room, name))}
    wanted = {f"{room.__name__}.{n}" for room, n in names if not n.startswith("Abstract")}
    wanted = {name for name in wanted if name.split(".")[-1] not in catalogue.LEFT_OUT}
    wanted |= {"jaxmbs.motion.Event"}
    assert sorted(name for name in found if name.split(".")[1] not in ("drawings", "vehicles")) == sorted(wanted)
    assert {f"jaxmbs.vehicles.{name}" for name in ("Tyre", "BrushTyre", "CleatRoad", "PathFollower")} <= set(found)
    assert "jaxmbs.drawings.Plane" in found
    assert set(catalogue.DRAWINGS) <= {name.split(".")[-1] for name in found}


def test_each_thing_is_where_the_page_says(catalogue):
    text = catalogue.PAGE.read_text(encoding="utf-8")
    for kinds in catalogue.sections().values():
        for name, (room, kind) in kinds.items():
            assert getattr(importlib.import_module(room), name) is kind
            assert f"`{room}.{name}(" in text


def test_page_and_pictures_are_those_of_the_docstrings(catalogue):
    advice = "out of date: run `python docs/_ext/catalogue.py`"
    assert catalogue.PAGE.read_text(encoding="utf-8") == catalogue.page(), advice
    for name in catalogue.DRAWINGS:
        text = (catalogue.PICTURES / f"{name}.svg").read_text(encoding="utf-8")
        assert text == catalogue.drawn(name) and len(text) <= 8000, f"{name}: {advice}"
    assert {path.stem for path in catalogue.PICTURES.iterdir()} == set(catalogue.DRAWINGS)


UNITS = {"revolute": "[rad", "screw": "[rad", "prismatic": "[m", "ball": "quaternion (w, x, y, z)"}


@pytest.mark.parametrize("kind", joints.ALL, ids=lambda kind: kind.__name__)
def test_docstring_of_a_joint_has_order_units_and_signs(kind):
    text = " ".join(inspect.getdoc(kind).split())
    assert "Coordinate" in text and all(UNITS[node.kind] in text for node in kind.nodes)
    places = [text.find(label, text.index("Coordinate")) for label in kind.labels if not label.startswith("q")]
    assert -1 not in places and places == sorted(places)
    if kind.nodes:
        assert "right-handed" in text or "positive" in text
        assert "Velocit" in text and "Effort" in text and "frames agree" in text or "they agree" in text


@pytest.mark.parametrize("kind", [elements.AbstractElement, *elements.ALL], ids=lambda t: t.__name__)
def test_docstring_of_an_element_says_signs_and_units_of_its_forces(kind):
    text = inspect.getdoc(kind)
    if kind.force_labels:
        assert "[N" in text or "[Pa]" in text
        assert "positive" in text or "in tension" in text


TURN = 0.3
MOVES = {  # kind, coordinate: where the child's origin goes [m], about what it turns [rad], as the docstrings say
    "revolute": (mbs.Revolute("-y"), 0, (0, 0, 0), (0, -TURN, 0)),
    "prismatic": (mbs.Prismatic("-x"), 0, (-TURN, 0, 0), (0, 0, 0)),
    "cylindrical, distance": (mbs.Cylindrical("y"), 0, (0, TURN, 0), (0, 0, 0)),
    "cylindrical, angle": (mbs.Cylindrical("y"), 1, (0, 0, 0), (0, TURN, 0)),
    "screw": (mbs.Screw("x", pitch=0.5), 0, (0.5 * TURN, 0, 0), (TURN, 0, 0)),
    "universal, first": (mbs.Universal(("z", "x")), 0, (0, 0, 0), (0, 0, TURN)),
    "universal, second": (mbs.Universal(("z", "x")), 1, (0, 0, 0), (TURN, 0, 0)),
    "planar z, x": (mbs.Planar("z"), 0, (TURN, 0, 0), (0, 0, 0)),
    "planar z, y": (mbs.Planar("z"), 1, (0, TURN, 0), (0, 0, 0)),
    "planar x, x": (mbs.Planar("x"), 0, (0, TURN, 0), (0, 0, 0)),
    "planar x, y": (mbs.Planar("x"), 1, (0, 0, TURN), (0, 0, 0)),
    "planar y, x": (mbs.Planar("y"), 0, (0, 0, TURN), (0, 0, 0)),
    "planar y, y": (mbs.Planar("y"), 1, (TURN, 0, 0), (0, 0, 0)),
    "planar y, angle": (mbs.Planar("y"), 2, (0, 0, 0), (0, TURN, 0)),
    "free, y": (mbs.Free(), 1, (0, TURN, 0), (0, 0, 0)),
}


def _system(kind):
    b = mbs.SystemBuilder()
    b.body("child", mass=1.0, inertia=1.0)
    b.joint("joint", kind, "ground", "child")
    return b.build()


@pytest.mark.long
def test_coordinates_are_what_docstrings_say():
    for name, (kind, number, place, turn) in MOVES.items():
        system = _system(kind)
        zero = mbs.State.at(system)
        moved = TURN * (np.arange(zero.coordinates.size) == number)
        state = mbs.State.at(system, joint=np.asarray(zero.coordinates) + moved)
        np.testing.assert_allclose(mbs.position(system, state, "child"), place, atol=1e-12, err_msg=name)
        vector = rotation_vector(mbs.rotation(system, state, "child"))
        np.testing.assert_allclose(vector, turn, atol=1e-12, err_msg=name)
