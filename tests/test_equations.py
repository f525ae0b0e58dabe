"""jaxmbs/EQUATIONS.md tells the truth: each function exists, cites its equation and stands in its row, each test
exists and leads to the functions, and no equation is missing."""

import ast
import re

import pytest

from .reach import ROOT, leads_to

NUMBERED = {"S1": 45, "S2": 84}  # equations of each paper
_ROW = re.compile(r"^\|\s*(S[12] \(.*?)\s*\|\s*(.*?)\s*\|\s*(.*?)\s*\|", re.MULTILINE)
_NUMBERS = r"\(\d+[a-z]?\)(?:(?:\s*[-\u2013,]\s*|,?\s+and\s+)\(\d+[a-z]?\))*"
_CITATION = re.compile(rf"\b(S[12])\s+({_NUMBERS})")
TABLE = (ROOT / "jaxmbs" / "EQUATIONS.md").read_text(encoding="utf-8").partition("\n## ")[0]
ROWS = _ROW.findall(TABLE)
EACH_ROW = pytest.mark.parametrize(
    ("equation", "functions", "tests"), ROWS, ids=[f"{row[0]} {row[1]}" for row in ROWS]
)


def cited(text):
    """The (paper, number) cited in a text."""
    found = set()
    for paper, numbers in _CITATION.findall(text or ""):
        for group in re.split(r",|\band\b", numbers):
            ends = [int(n) for n in re.findall(r"\d+", group)]
            found |= {(paper, n) for n in range(ends[0], ends[-1] + 1)} if ends else set()
    return found


def _definition(path, dotted):
    """The function (of overloads the last), class or method of that name in a file, or None."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    found = None
    for name in dotted.split("."):
        found = next((node for node in reversed(body) if getattr(node, "name", None) == name), None)
        if found is None:
            return None
        body = found.body
    return found


def _entries(cell, mark):
    """(file, name) of the entries of a cell."""
    return [tuple(entry.strip().strip("`").split(mark, 1)) for entry in cell.split(",") if entry.strip()]


def test_every_line_of_the_table_is_understood():
    lines = [line for line in TABLE.splitlines() if line.startswith("|")]
    assert len(ROWS) == len(lines) - 2
    assert all(cited(equation) for equation, _, _ in ROWS)


def test_no_equation_is_missing():
    found = set().union(*(cited(equation) for equation, _, _ in ROWS))
    assert found == {(paper, n) for paper, last in NUMBERED.items() for n in range(1, last + 1)}


def test_letters_of_the_papers_have_names_here():
    """Words of four letters and more in the last column of `SYMBOLS.md` occur in the source."""
    letters = (ROOT / "jaxmbs" / "SYMBOLS.md").read_text(encoding="utf-8").partition("## Letters of S2")[2]
    here = [line.rstrip(" |").rpartition("|")[2] for line in letters.splitlines() if line.startswith("| `")]
    source = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "jaxmbs").rglob("*.py"))
    words = {word for cell in here for code in re.findall(r"`([^`]+)`", cell) for word in re.findall(r"\w{4,}", code)}
    assert len(here) > 60
    assert not words - set(re.findall(r"\w+", source))


@EACH_ROW
def test_functions_cite_every_equation_of_their_row(equation, functions, tests):
    of_row, found = cited(equation), set()
    assert functions
    for file, name in _entries(functions, ":"):
        definition = _definition(ROOT / "jaxmbs" / file, name)
        assert definition is not None, f"{file}:{name} does not exist"
        own = cited(ast.get_docstring(definition))
        assert own & of_row, f"the docstring of {file}:{name} does not cite {equation}"
        found |= own
    assert of_row <= found, f"no docstring of this row cites {sorted(of_row - found)}"


@EACH_ROW
def test_tests_lead_to_the_functions_of_their_row(equation, functions, tests):
    """Every function has a test of the row that leads to it, and every test leads to a function of the row."""
    assert tests
    places, silent = [], _entries(functions, ":")
    for file, name in _entries(tests, "::"):
        definition = _definition(ROOT / file, name)
        assert definition is not None and definition.name.startswith("test"), f"{file}::{name} does not exist"
        places.append((file, name))
        seen = [entry for entry in _entries(functions, ":") if leads_to(file, name, f"jaxmbs/{entry[0]}", entry[1])]
        assert seen, f"{file}::{name} leads to no function of its row"
        silent = [entry for entry in silent if entry not in seen]
    assert not silent, f"no test of this row leads to {silent}"


def test_a_test_of_something_else_is_noticed():
    assert not leads_to("tests/math/test_tensor.py", "test_quadratic", "jaxmbs/math/_tensor.py", "plane_mix")
    row = "tests/statics/test_solve.py", "test_four_bar_in_space_has_the_papers_counts"
    assert leads_to(*row, "jaxmbs/statics/_reaction_matrix.py", "reaction_matrix")
    assert not leads_to(*row, "jaxmbs/dynamics/_hamilton.py", "canonical_rate")
    assert not leads_to(*row, "jaxmbs/constraints/_kic_second.py", "kic_second")


def _citing():
    """(file, name, equations) of every function, class and method whose docstring cites an equation."""
    for path in sorted((ROOT / "jaxmbs").rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            within = node.body if isinstance(node, ast.ClassDef) else []
            for owner, found in [("", node), *((f"{node.name}.", method) for method in within)]:
                if isinstance(found, ast.FunctionDef | ast.ClassDef):
                    yield str(path.relative_to(ROOT / "jaxmbs")), owner + found.name, cited(ast.get_docstring(found))


CITING = [c for c in _citing() if c[2]]


def _of_rows(rows, file, name):
    """Equations of the rows that a function stands in."""
    return set().union(
        *(cited(equation) for equation, functions, _ in rows if (file, name) in _entries(functions, ":"))
    )


@pytest.mark.parametrize(("file", "name", "own"), [pytest.param(*c, id=":".join(c[:2])) for c in CITING])
def test_what_cites_an_equation_stands_in_a_row_of_it(file, name, own):
    assert own <= _of_rows(ROWS, file, name), f"{file}:{name} cites {sorted(own - _of_rows(ROWS, file, name))}"


@EACH_ROW
def test_no_row_goes_unnoticed(equation, functions, tests):
    """Without it some function would cite what no row of its own has."""
    rest = [row for row in ROWS if row != (equation, functions, tests)]
    own = [c for c in CITING if c[:2] in _entries(functions, ":")]
    assert any(not cites <= _of_rows(rest, file, name) for file, name, cites in own)
