"""Every notebook runs in its fast mode (13: `test_notebook_of_designs`), its copy is of its script, and a cell that
runs again compiles nothing."""

import ast
import json
import linecache
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from tests.compilations import compiled

FOLDER = Path(__file__).parent.parent / "notebooks"
SCRIPTS = sorted(FOLDER.glob("*.py"))


@pytest.mark.long
@pytest.mark.parametrize("script", [s for s in SCRIPTS if s.name[:2] != "13"], ids=lambda path: path.stem)
def test_notebook_runs(script, monkeypatch):
    plt.switch_backend("Agg")
    monkeypatch.setenv("JAXMBS_FAST", "1")
    runpy.run_path(str(script))
    plt.close("all")


def _code(script):
    """Code cells of a script in the percent format."""
    cells = script.read_text(encoding="utf-8").split("# %%")[1:]
    return [cell.partition("\n")[2].strip() for cell in cells if not cell.startswith(" [markdown]")]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_executed_copy_is_of_this_script(script):
    cells = json.loads(script.with_suffix(".ipynb").read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert ["".join(cell["source"]).strip() for cell in code] == _code(script)
    assert all(cell["execution_count"] for cell in code)
    assert not any(output.get("output_type") == "error" for cell in code for output in cell["outputs"])


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_it_imports_from_faces_only(script):
    tree = ast.parse(script.read_text(encoding="utf-8"))
    names = [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert not [name for name in names if name.startswith("jaxmbs.") and name.count(".") > 1]


@pytest.mark.slow
@pytest.mark.parametrize("number", ["01", "02", "03", "12"])
def test_a_cell_run_again_compiles_nothing(number, monkeypatch):
    """Each cell twice, one after the other, as a person does who changes a label: all is built and asked anew."""
    plt.switch_backend("Agg")
    monkeypatch.setenv("JAXMBS_FAST", "1")
    (script,) = (script for script in SCRIPTS if script.name.startswith(number))
    names = {"__name__": "__main__", "__file__": str(script)}
    for number, cell in enumerate(_code(script)):
        for turn in (0, 1):
            source = f"<cell {number}, {turn}>"
            linecache.cache[source] = len(cell), None, cell.splitlines(True), source  # as a notebook does
            code = compile(cell, source, "exec")
            found = compiled(lambda code=code: exec(code, names))
        assert not found, f"cell {number}: {found}"
        plt.close("all")
