"""jaxmbs/EQUATIONS.md tells the truth: each function exists and cites its equation, and each test exists."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
_ROW = re.compile(r"^\|\s*(S[12] \(.*?)\s*\|\s*(.*?)\s*\|\s*(.*?)\s*\|", re.MULTILINE)
_NUMBERS = r"\(\d+[a-z]?\)(?:(?:\s*[-\u2013,]\s*|,?\s+and\s+)\(\d+[a-z]?\))*"
_CITATION = re.compile(rf"\b(S[12])\s+({_NUMBERS})")
ROWS = _ROW.findall((ROOT / "jaxmbs" / "EQUATIONS.md").read_text(encoding="utf-8"))


def _citations(text):
    """The groups cited in a text: sets of (paper, number), a range being one set."""
    groups = []
    for paper, numbers in _CITATION.findall(text):
        for group in re.split(r",|\band\b", numbers):
            ends = [int(n) for n in re.findall(r"\d+", group)]
            groups += [{(paper, n) for n in range(ends[0], ends[-1] + 1)}] if ends else []
    return groups


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


def _entries(cell):
    return [entry.strip().strip("`") for entry in cell.split(",") if entry.strip()]


def test_every_line_of_the_table_is_understood():
    text = (ROOT / "jaxmbs" / "EQUATIONS.md").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.startswith("|")]
    assert len(ROWS) == len(lines) - 2
    assert ROWS
    assert all(_citations(equation) for equation, _, _ in ROWS)


@pytest.mark.parametrize(("equation", "functions", "tests"), ROWS, ids=[f"{row[0]} {row[1]}" for row in ROWS])
def test_row(equation, functions, tests):
    groups = _citations(equation)
    cited = set()
    assert _entries(functions)
    assert _entries(tests)
    for entry in _entries(functions):
        file, _, name = entry.partition(":")
        definition = _definition(ROOT / "jaxmbs" / file, name)
        assert definition is not None, f"{entry} does not exist"
        own = set().union(*_citations(ast.get_docstring(definition) or ""))
        assert own & set().union(*groups), f"the docstring of {entry} does not cite {equation}"
        cited |= own
    for group in groups:
        assert group & cited, f"no docstring of this row cites {sorted(group)}"
    for entry in _entries(tests):
        file, _, name = entry.partition("::")
        definition = _definition(ROOT / file, name.replace("::", "."))
        assert definition is not None and definition.name.startswith("test"), f"{entry} does not exist"
