"""The manual: its pages' Python runs from top to bottom, every public face has a page, and the site builds."""

import ast
import importlib
import importlib.util
import linecache
import re
import shutil
from pathlib import Path

import jax
import pytest

import jaxmbs
from tests import sources
from tests.test_public_faces import FACES

DOCS = Path(__file__).parent.parent / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
# One page is quick, those of more than six seconds long, all others slow.
QUICK = ("start/first-mechanism",)
LONG = """
    coming-from cookbook extend/element extend/formulation extend/friction extend/joint extend/law
    extend/reduction extend/tyre gallery guide/blocks guide/cables guide/components guide/contact guide/control
    guide/cycles guide/design guide/diffrax guide/elastic guide/fatigue guide/fmi guide/friction guide/hydraulics
    guide/identification guide/loops guide/performance guide/pictures guide/qualification guide/reliability
    guide/rotors guide/scatter
    guide/solvers guide/states guide/structures guide/studies guide/test-data guide/vehicles inside start/closed-loop
    start/first-design start/first-structure start/from-files start/sharp-bits tasks/box tasks/decks
    tasks/engine tasks/everyday tasks/excavator tasks/linkages tasks/plate-arm tasks/shaper tasks/wishbone
    theory/misprints theory/papers
""".split()

_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page):
    """Pairs of line and code of a page's Python."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, found.start(1)), found.group(1)) for found in _BLOCK.finditer(text)]


def _marked(page):
    name = str(page.relative_to(DOCS).with_suffix(""))
    mark = () if name in QUICK else pytest.mark.long if name in LONG else pytest.mark.slow
    return pytest.param(page, marks=mark, id=name)


@pytest.mark.parametrize("page", [_marked(page) for page in PAGES if blocks(page)])
def test_page_runs(page, monkeypatch, tmp_path):
    plt = pytest.importorskip("matplotlib.pyplot")
    plt.switch_backend("Agg")
    monkeypatch.chdir(tmp_path)
    linecache.checkcache()
    names = {"__name__": "__manual__"}
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):  # as a user has them
        for line, code in blocks(page):
            exec(compile("\n" * line + code, str(page), "exec"), names)
    plt.close("all")


def test_marked_pages_exist():
    assert {str(page.relative_to(DOCS).with_suffix("")) for page in PAGES} >= {*QUICK, *LONG}


def test_every_face_has_a_page():
    rooms = {face.removeprefix("jaxmbs.") for face in FACES} - {"jaxmbs"}
    assert rooms == {page.stem for page in (DOCS / "api").glob("*.rst")} - {"index"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_says_where_to_go_next(page):
    assert page.name == "index.md" or "\n## Next\n" in page.read_text(encoding="utf-8")


_ROOMS = {face.removeprefix("jaxmbs.") for face in FACES} - {
    *("jaxmbs", "motion"),  # pages call a Motion `motion`
    *("ode", "runtime"),  # not for users; pyYeti has an `ode` too
}
_NAMED = re.compile(r"`(?:jaxmbs\.|mbs\.)?(\w+)\.(\w+)[`(]|`mbs\.(\w+)[`(]")
_LINK = re.compile(r"(?:\]\(|src=\")(?!http)([^)\"#]+)")


@pytest.mark.parametrize("page", [*PAGES, DOCS.parent / "README.md"], ids=lambda page: page.stem)
def test_what_a_page_names_exists(page):
    text = page.read_text(encoding="utf-8")
    for room, name, plain in _NAMED.findall(text):
        if room in _ROOMS:
            assert hasattr(importlib.import_module(f"jaxmbs.{room}"), name), f"{room}.{name}"
        assert not plain or hasattr(jaxmbs, plain), plain
    for target in _LINK.findall(text):
        assert (page.parent / target).exists(), target


def test_readme_leads_to_every_guide_in_at_most_160_lines():
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    wanted = {
        f"docs/{page.relative_to(DOCS)}" for room in ("guide", "tasks", "extend") for page in (DOCS / room).iterdir()
    }
    assert wanted <= set(_LINK.findall(text))
    assert text.count("\n") <= 160


#: What somebody with an everyday task looks for.
WORDS = {
    "motor and spring": "torque, spring, peak, worst, minimise, gradient, limit, bounds, kink, rms",
    "wishbone": "McPherson, wheel rate, roll centre, anti-dive, camber, toe, hardpoint, bushing, tie rod, kingpin",
    "crane": "crane, hoist, winch, rope, drum, sheave, trapezoid, jerk, sway, tension",
    "press": "press, toggle, dead centre, friction circle, efficiency, self-lock, screw, crank, redundant, stiff",
    "excavator": "excavator, valve, servo valve, pressure control, force control, lift table, pump, relief, "
    "spool, boom",
    "box": "isolator, rattle space, GEVS, NASA, random vibration, PSD, fatigue, Dirlik, notch, electronics",
    "robot": "UR5, robot, URDF, trajectory, payload, torque limit, inverse_dynamics, Pareto, tolerance, sweep",
    "identification": "identif, parameter estimation, calibration, free decay, standard error, prior, chi squared, "
    "excitation, model updating, measured",
    "four-bar": "four-bar, coupler, elastic, stress, strain, envelope, thickness, Craig-Bampton, Rodas5P, mode",
    "other tools": "FMU, FMI, OpenMDAO, Tesseract, Simulink, Modelica, Dymola, component, co-simulation, export",
    "results": "report, PDF, to_excel, spreadsheet, video, movie, GIF, HTML, to_pandas, colleague",
    "mistakes": "mistake, misspelt, did you mean, degrees, unit, traced, np.sin, precision, millimetres, warning",
}


@pytest.mark.parametrize("task", WORDS)
def test_words_of_everyday_tasks_are_found(task):
    pages = [page for page in PAGES if page.name not in ("bibliography.md", "catalogue.md", "index.md")]
    text = " ".join(" ".join(page.read_text(encoding="utf-8") for page in pages).split()).lower()
    words = WORDS[task].split(", ")
    assert len(words) == 10 and [word for word in words if word.lower() not in text] == []


_YEAR, _BEFORE = re.compile(r"\(?((?:19|20)\d\d)\)"), re.compile(r"[^()]{1,150}\Z")
_SOURCE = re.compile(r"Source: ([^(]{1,150}?)\b((?:19|20)\d\d)\b")


def _citations(text):
    """What stands before each year in parentheses, without others between, and the year."""
    found = ((_BEFORE.search(text[max(m.start() - 150, 0) : m.start()]), m[1]) for m in _YEAR.finditer(text))
    return [(before[0], year) for before, year in found if before]


def test_cited_papers_are_in_the_bibliography():
    """An entry of the year and a name, for every year in parentheses, or of a source, after "Name"."""
    entries = (DOCS / "bibliography.md").read_text(encoding="utf-8").split("\n- ")
    texts = [path.read_text(encoding="utf-8") for path in (DOCS.parent / "jaxmbs").rglob("*.py")]
    pairs = [pair for text in texts for pair in (*_citations(text), *_SOURCE.findall(text))]
    cited = [(names, year) for before, year in pairs if (names := re.findall(r"\b[A-Z]\w{2,}", before))]
    assert len(cited) > 15
    known = [
        any(year in entry and any(name in entry for name in names) for entry in entries) for names, year in cited
    ]
    assert all(known), [found for found, is_known in zip(cited, known, strict=True) if not is_known]


def _glossary():
    """Rows of word, meaning and words not to be used, of every section."""
    text = (DOCS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8").split("<!-- glossary -->")[1]
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in text.splitlines() if row.startswith("| ")]
    return [row for row in rows if row[0] != "word"]


def test_words_of_the_glossary_are_defined_once():
    words = [word.strip() for row in _glossary() for word in row[0].split(",")]
    assert len(words) >= 60 and len(set(words)) == len(words)
    assert all(len(row) == 3 and row[1] for row in _glossary())


@pytest.mark.long
def test_names_that_the_glossary_refuses_are_gone():
    refused = {name for row in _glossary() for name in re.findall(r"`(\w+)`", row[2])}
    assert refused
    definitions = ast.FunctionDef | ast.ClassDef
    for path in sources.files():
        names = {node.name for node in sources.nodes(path) if isinstance(node, definitions)}
        assert not refused & names, f"{path}: see the glossary of CONTRIBUTING.md"


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of Sphinx and its extensions to one another
@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="needs the extra `docs`")
def test_site_builds_without_warnings(tmp_path):
    from sphinx.cmd.build import build_main

    copy = shutil.copytree(DOCS, tmp_path / "docs", ignore=shutil.ignore_patterns("_build"))
    for name in ("jaxmbs", "notebooks", "README.md", "CHANGELOG.md", "CONTRIBUTING.md"):
        (tmp_path / name).symlink_to(DOCS.parent / name)
    assert build_main(["-q", "-W", "--keep-going", str(copy), str(tmp_path / "site")]) == 0
    assert (tmp_path / "site" / "api" / "joints.html").exists()
