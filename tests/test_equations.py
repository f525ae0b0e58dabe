"""jaxmbs/EQUATIONS.md tells the truth: each function exists, cites its equation and stands in its row, each test
exists and leads to the functions, and no equation is missing."""

import ast
import collections
import functools
import re

from .reach import ROOT, leads_to
from .sources import PACKAGE, files, tree

NUMBERED = {"S1": 45, "S2": 84}  # equations of each paper
_ROW = re.compile(r"^\|\s*(S[12] \(.*?)\s*\|\s*(.*?)\s*\|\s*(.*?)\s*\|", re.MULTILINE)
_NUMBERS = r"\(\d+[a-z]?\)(?:(?:\s*[-\u2013,]\s*|,?\s+and\s+)\(\d+[a-z]?\))*"
_CITATION = re.compile(rf"\b(S[12])\s+({_NUMBERS})")
TABLE = (ROOT / "jaxmbs" / "EQUATIONS.md").read_text(encoding="utf-8").partition("\n## ")[0]
ROWS = _ROW.findall(TABLE)


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
    body = tree(path).body
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


def _faults(check):
    """What a check of one row says of all of them, a line each."""
    return [f"{row[0]} {row[1]}: {fault}" for row in ROWS for fault in check(*row)]


def test_functions_cite_every_equation_of_their_row():
    assert not _faults(_uncited)


def _uncited(equation, functions, tests):
    of_row, found = cited(equation), set()
    if not functions:
        yield "no function"
    for file, name in _entries(functions, ":"):
        definition = _definition(PACKAGE / file, name)
        if definition is None:
            yield f"{file}:{name} does not exist"
            continue
        own = cited(ast.get_docstring(definition))
        if not own & of_row:
            yield f"the docstring of {file}:{name} does not cite {equation}"
        found |= own
    if not of_row <= found:
        yield f"no docstring of this row cites {sorted(of_row - found)}"


def test_tests_lead_to_the_functions_of_their_row():
    """Every function has a test of the row that leads to it, and every test leads to a function of the row."""
    assert not _faults(_untested)


def _untested(equation, functions, tests):
    if not tests:
        yield "no test"
    silent = _entries(functions, ":")
    for file, name in _entries(tests, "::"):
        definition = _definition(ROOT / file, name)
        if definition is None or not definition.name.startswith("test"):
            yield f"{file}::{name} does not exist"
            continue
        seen = [entry for entry in _entries(functions, ":") if leads_to(file, name, f"jaxmbs/{entry[0]}", entry[1])]
        if not seen:
            yield f"{file}::{name} leads to no function of its row"
        silent = [entry for entry in silent if entry not in seen]
    if silent:
        yield f"no test of this row leads to {silent}"


def test_a_test_of_something_else_is_noticed():
    assert not leads_to("tests/math/test_tensor.py", "test_quadratic", "jaxmbs/math/_tensor.py", "plane_mix")
    row = "tests/statics/test_solve.py", "test_four_bar_in_space_has_the_papers_counts"
    assert leads_to(*row, "jaxmbs/statics/_reaction_matrix.py", "reaction_matrix")
    assert not leads_to(*row, "jaxmbs/dynamics/_hamilton.py", "canonical_rate")
    assert not leads_to(*row, "jaxmbs/constraints/_kic_second.py", "kic_second")


@functools.cache
def _citing():
    """(file, name, equations) of every function, class and method whose docstring cites an equation."""
    return [citation for path in files() for citation in _citations(path) if citation[2]]


def _citations(path):
    for node in tree(path).body:
        within = node.body if isinstance(node, ast.ClassDef) else []
        for owner, found in [("", node), *((f"{node.name}.", method) for method in within)]:
            if isinstance(found, ast.FunctionDef | ast.ClassDef):
                yield str(path.relative_to(PACKAGE)), owner + found.name, cited(ast.get_docstring(found))


@functools.cache
def _places():
    """Numbers of the rows that a function stands in, by its (file, name)."""
    places = collections.defaultdict(set)
    for k, (_, functions, _) in enumerate(ROWS):
        for place in _entries(functions, ":"):
            places[place].add(k)
    return places


def _of_rows(rows):
    """Equations of rows by their numbers."""
    return set().union(*(cited(ROWS[k][0]) for k in rows))


def test_what_cites_an_equation_stands_in_a_row_of_it():
    missing = [(file, name, own - _of_rows(_places()[file, name])) for file, name, own in _citing()]
    assert not [f"{file}:{name} cites {sorted(rest)}" for file, name, rest in missing if rest]


def test_no_row_goes_unnoticed():
    """Without it some function would cite what no row of its own has."""
    noticed = {
        k
        for file, name, own in _citing()
        for k in _places()[file, name]
        if not own <= _of_rows(_places()[file, name] - {k})
    }
    assert not [ROWS[k][:2] for k in range(len(ROWS)) if k not in noticed]
