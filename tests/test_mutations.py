"""The places that `benchmarks/mutations.py` changes still exist, and the tests it runs do; nothing is run here."""

import ast
import importlib.util
from pathlib import Path

import pytest

FILE = Path(__file__).parent.parent / "benchmarks" / "mutations.py"
SPEC = importlib.util.spec_from_file_location("mutations", FILE)
MUTATIONS = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(MUTATIONS)


def test_every_place_is_there_once():
    entries = MUTATIONS.mutants()
    assert len(entries) >= 150
    assert not [fault for entry in entries for fault in MUTATIONS.faults(entry)]
    assert {entry["rule"] for entry in entries} == {"physics", "derivative", "option"}


@pytest.mark.long
def test_every_mutant_is_a_program_and_another_one():
    for entry in MUTATIONS.mutants():
        text = (FILE.parent.parent / "jaxmbs" / entry["file"]).read_text(encoding="utf-8")
        changed = text.replace(entry["old"], entry["new"])
        assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(text)), entry["name"]


def test_places_are_spread_over_the_rooms():
    rooms = {entry["file"].partition("/")[0] for entry in MUTATIONS.mutants()}
    assert {"kinematics", "dynamics", "motion", "math", "blocksparse", "linear", "coupling", "statics"} <= rooms


def test_a_place_that_is_gone_is_named():
    entry = {"name": "x", "file": "status.py", "old": "no such text", "new": "", "tests": "test_nothing.py"}
    assert len(MUTATIONS.faults(entry)) == 2


def test_the_report_names_survivors():
    row = {"file": "a.py", "old": "a - b", "new": "a + b", "tests": "test_a.py", "rule": "physics"}
    text = MUTATIONS.report([row | {"result": "survived"}, row | {"result": "killed"}])
    assert "survived (physics): jaxmbs/a.py" in text and "physics      killed     1" in text
