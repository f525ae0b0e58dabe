"""A test file bears the name of the file that it tests, or stands in a folder of tests that cross the rooms."""

import re
from pathlib import Path

TESTS = Path(__file__).parent
PACKAGE = TESTS.parent / "jaxmbs"
CROSSING = ("cases", "adversary", "zoo", "misuse")  # published numbers, hostile models, every mechanism, wrong use
ALLOWED = {  # tests of more than one room, or of what is no module
    "test_architecture": "floors, cycles and sizes of the whole package",
    "test_benchmarks": "the folder benchmarks",
    "test_catalogue": "docs/catalogue.md",
    "test_derivatives_of_results": "every field of every result",
    "test_equations": "jaxmbs/EQUATIONS.md",
    "test_released_faces": "names of the last release against those of today",
    "test_warnings": "every warning of the library",
    "design/test_one_trace": "sweeps, batches and searches: how often they run a user's function",
    "test_gradients": "derivatives through assembly, motion and reactions together",
    "test_manual": "the pages of docs",
    "test_mutations": "benchmarks/mutants.toml",
    "test_names_of_tests": "this folder",
    "test_other_devices": "things and questions of every room on accelerators",
    "elements/test_nastran_matrices": "elements of several files beside printed matrices of Nastran",
    "test_conventions": "conventions of all public functions",
    "test_notebook_of_designs": "notebook 13",
    "test_notebooks": "the notebooks",
    "test_program_size": "programs of the main verbs",
    "test_public_faces": "the `__all__` of every room",
    "test_verdicts": "every result with a verdict",
    "test_user_programs": "programs of every kind, compiled without flags",
    "runtime/tape/test_damaged_tapes": "the machine and the checks together, with damaged tapes",
    "runtime/tape/test_wide_products": "the machine with and without wide registers",
    "runtime/test_contract": "every trick of the room, on the JAX at hand",
    "test_wheel": "the built package",
    "test_words": "names and docstrings of the whole package",
    "viz/test_gallery": "the pictures of docs/guide/pictures.md",
}


def files(folder=TESTS):
    return sorted(p.relative_to(folder).with_suffix("") for p in folder.rglob("test_*.py"))


def subject(test):
    """The module, room or room within a room that the test bears the name of, or None."""
    name, room = test.name.removeprefix("test_"), PACKAGE / test.parent
    modules = {path.stem.lstrip("_"): path for path in room.glob("*.py")}
    modules |= {path.parent.name: path for path in room.glob("*/__init__.py")}
    modules |= {room.name: room / "__init__.py"} if test.parent.name and room.is_dir() else {}
    words = name.split("_")
    borne = (modules.get("_".join(words[:k])) for k in range(len(words), 0, -1))
    return next(filter(None, borne), None)


def crosses(test):
    return test.parts[0] in CROSSING


def test_every_file_bears_the_name_of_what_it_tests():
    lost = [str(t) for t in files() if not crosses(t) and str(t) not in ALLOWED and subject(t) is None]
    assert not lost, f"name these after the file they test, or give a reason in ALLOWED: {lost}"


def test_every_exception_is_needed():
    names = {str(t): t for t in files()}
    assert not {name for name in ALLOWED if name not in names or subject(names[name]) is not None}
    assert all((TESTS / folder).is_dir() for folder in CROSSING)


def test_a_lost_name_is_noticed():
    assert subject(Path("motion/test_levels")) is None and subject(Path("dynamics/paper/test_kic")) is None
    assert subject(Path("motion/test_options_forward_mode")).name == "_options.py"


def test_promises_are_held_by_tests_that_exist():
    """Each line of the table of promises in CONTRIBUTING names a folder, a file or a test of a file."""
    table = (TESTS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("<!-- promises -->")[2]
    rows = [line.split("|") for line in table.partition("\n#")[0].splitlines() if line.startswith("|")][2:]
    assert len(rows) > 20
    for row in rows:
        held = re.findall(r"`([^`]+)`", row[3])
        assert held, f"no test holds {row[1]}"
        for place, _, name in (each.partition("::") for each in held):
            assert (TESTS / place).exists(), place
            assert not name or f"def {name}(" in (TESTS / place).read_text(encoding="utf-8"), f"{place}::{name}"
