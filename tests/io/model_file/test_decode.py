"""Model files changed by hand: names, references, numbers and keys that cannot be; large ones end soon."""

import copy
import json
import time

import numpy as np
import pytest

import jaxmbs as mbs


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    b = mbs.SystemBuilder()
    b.body("x", 1.0, inertia=(1, 1, 1))
    b.body("y", 1.0, inertia=(1, 1, 1))
    b.frame("eye", "x", (0, 0, 1.0))
    b.joint("j", mbs.Revolute("z"), "ground", "x")
    b.joint("k", mbs.Revolute("z"), "x", "y", parent_frame=(1.0, 0, 0))
    b.force("f", mbs.SpringDamper(1.0), joint="j")
    b.constraint("c", mbs.Coupler({"j": 1.0, "k": 2.0}))
    path = tmp_path_factory.mktemp("models") / "good.json"
    mbs.save_model(b, path)
    return json.loads(path.read_text())


def load(document, folder):
    (folder / "a.json").write_text(document if isinstance(document, str) else json.dumps(document))
    return mbs.load_model(folder / "a.json")


def law(document, of="c"):
    return document["model"]["constraints" if of == "c" else "forces"][of]["law"]


CHANGES = {
    "there is 'extra' beside the model": lambda d: d.update(extra=1),
    "of version 7; .* a later release reads it": lambda d: d.update({"jaxmbs model": 7}),
    "of version 0; .* no release wrote it": lambda d: d.update({"jaxmbs model": 0}),
    "it has no model": lambda d: d.pop("model"),
    "gravity is missing": lambda d: d["model"].pop("gravity"),
    "no table 'motors'": lambda d: d["model"].update(motors={}),
    "no field 'masss': did you mean 'mass'": lambda d: d["model"]["bodies"]["x"].update(masss=1),
    "bodies.x: it calls itself 'z'": lambda d: d["model"]["bodies"]["x"].update(name="z"),
    "body 'x': mass is nan": lambda d: d["model"]["bodies"]["x"].update(mass="nan"),
    "gravity is not finite": lambda d: d["model"].update(gravity=["nan", 0, 0]),
    "stiffness is not a number": lambda d: law(d, "f").update(stiffness="nan"),
    "force 'f': there is no joint 'q'": lambda d: d["model"]["forces"]["f"].update(joint="q"),
    "joint 'k', parent: there is no body or frame 'q'": lambda d: d["model"]["joints"]["k"].update(parent="q"),
    "frame 'eye': there is no body or frame 'q'": lambda d: d["model"]["frames"]["eye"].update(body="q"),
    "constraint 'c': there is no joint 'q'": lambda d: law(d).update(joints=["j", "q"]),
    "it names a joint twice: j, j": lambda d: law(d).update(joints=["j", "j"]),
    "it has 1 coefficients for 2 joints": lambda d: law(d).update(coefficients=[1.0]),
    "body 'ground': the name is taken": lambda d: d["model"]["bodies"].update(ground=d["model"]["bodies"]["x"]),
    "frame 'x': a body has this name": lambda d: d["model"]["frames"].update(x=d["model"]["frames"]["eye"]),
    "constraint 'j': a joint has": lambda d: d["model"]["constraints"].update(j=d["model"]["constraints"]["c"]),
    "force 'drives'": lambda d: d["model"]["forces"].update(drives=d["model"]["forces"]["f"]),
}


@pytest.mark.parametrize("message", CHANGES)
def test_changed_files(message, good, tmp_path):
    document = copy.deepcopy(good)
    assert load(document, tmp_path).faults() == []
    CHANGES[message](document)
    with pytest.raises(mbs.ModelFileError, match=message):
        load(document, tmp_path)


MANY = {f"k{k}": 1 for k in range(100_000)}
PLACES = {
    "beside": lambda d: d,
    "tables": lambda d: d["model"],
    "bodies": lambda d: d["model"]["bodies"],
    "fields": lambda d: d["model"]["bodies"]["x"],
    "numbers of a law": lambda d: law(d, "f"),
}


@pytest.mark.parametrize("place", PLACES)
def test_a_hundred_thousand_keys(place, good, tmp_path):
    document = copy.deepcopy(good)
    PLACES[place](document).update(MANY)
    start = time.process_time()
    with pytest.raises(mbs.ModelFileError) as told:
        load(document, tmp_path)
    assert time.process_time() - start < 10 and len(str(told.value)) < 20_000


def test_keys_that_are_there_twice(tmp_path):
    """The one that is, behind a hundred thousand that are not."""
    text = "{" + ",".join(f'"k{k}": 1' for k in range(100_000)) + ', "k7": 2}'
    start = time.process_time()
    with pytest.raises(mbs.ModelFileError, match="'k7' is defined twice"):
        load('{"jaxmbs model": 1, "model": ' + text + "}", tmp_path)
    assert time.process_time() - start < 10


def test_numbers_of_declarations_are_exact(good, tmp_path):
    """They stay NumPy's until the system is built."""
    document = copy.deepcopy(good)
    document["model"]["bodies"]["x"]["com"] = [0.1, 1 / 3, 1e-300]
    com = load(document, tmp_path).declared.bodies["x"].com
    np.testing.assert_array_equal(com, [0.1, 1 / 3, 1e-300])


def test_a_built_system_is_not_saved(tmp_path):
    b = mbs.SystemBuilder()
    b.body("x", 1.0, inertia=(1, 1, 1))
    b.joint("j", mbs.Revolute("z"), "ground", "x")
    system = b.build()
    for model, words in ((system, "give save_model the builder"), (mbs.State.at(system), "save the builder")):
        with pytest.raises(mbs.ModelError, match=words):
            mbs.save_model(model, tmp_path / "a.json")
    assert not list(tmp_path.iterdir())
