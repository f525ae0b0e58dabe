"""A report is whole: the results' own numbers, escaped names, nothing from a network, no text cut off."""

import html
import re
import shutil
import subprocess
import warnings
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.documents._provenance import digest
from jaxmbs.errors import ModelError

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


def pendulum(name="<arm> & co", stiffness=3.0):
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body(name, mass=2.0, com=(0.4, 0, 0), inertia=mbs.inertia.rod(2.0, 0.8))
    b.joint("pin", mbs.Revolute("y"), "ground", name)
    b.force(
        "spring",
        mbs.SpringDamper(stiffness=stiffness, free_length=0.1),
        between=(("ground", (0, 0, 0.3)), (name, (0.3, 0, 0))),
    )
    return b.build()


@pytest.fixture(scope="module")
def results():
    system = pendulum()
    motion = mbs.simulate(system, mbs.State.at(system, pin=0.4), t1=1.0)
    return system, {"motion": motion, "reactions": mbs.reactions(system, motion), "note": "A <b>swing</b>"}


@pytest.fixture(scope="module")
def page(results, tmp_path_factory):
    system, found = results
    return mbs.report(tmp_path_factory.mktemp("report") / "swing.html", system, title="<Swing>", **found)


def cells(text, title):
    """Rows of the table of a section."""
    section = text.split(f"<h2>{html.escape(title)}</h2>")[1].split("</section>")[0]
    rows = re.findall(r"<tr>(.*?)</tr>", section)
    return [tuple(map(html.unescape, re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row))) for row in rows]


@pytest.mark.parametrize("name", ["motion", "reactions"])
def test_numbers_are_those_of_the_results(results, page, name):
    rows = results[1][name].report().parts(200)[1]
    assert cells(page.read_text(), name.capitalize()) == [tuple(map(str, row)) for row in rows]


def test_the_machine(results, page):
    text, system = page.read_text(), results[0]
    body = cells(text, "Bodies")[1]
    assert body[:2] == ("<arm> & co", "2") and body[2].split(", ")[0] == "0.4"
    assert cells(text, "Forces")[1] == ("spring", "SpringDamper(stiffness=3, damping=0, free_length=0.1, preload=0)")
    assert "mobility: 1" in text and digest(system) in text and mbs.__version__ in text
    assert "Dopri8, steps that adapt, rtol = 1e-09, atol = 1e-09" in text


def test_texts_are_escaped(page):
    text = page.read_text()
    assert "<title>&lt;Swing&gt;</title>" in text and "A &lt;b&gt;swing&lt;/b&gt;" in text
    assert "<arm>" not in text


def test_nothing_comes_from_a_network(page):
    text = page.read_text()
    sources = re.findall(r'(?:src|href|url)\s*[=(]\s*"?([^">)\s]{1,40})', html.unescape(text))
    assert sources and all(source.startswith(("data:", "#")) for source in sources)
    assert "default-src 'none'" in text and len(text) < 5e6


def test_what_failed_stands_first(results, tmp_path):
    system = results[0]
    motion = mbs.simulate(system, mbs.State.at(system, pin=0.4), t1=1.0, max_steps=3, throw=False)
    text = mbs.report(tmp_path / "failed.html", system, motion=motion).read_text()
    assert 0 < text.index(str(motion.status)) < text.index("<section")
    assert "Nothing in this report failed" not in text


def test_a_digest_is_that_of_the_model(results):
    assert digest(results[0]) == digest(pendulum()) != digest(pendulum(stiffness=3.0000001))
    assert digest(pendulum("other")) != digest(pendulum())


def test_a_study(tmp_path):
    data = mbs.sweep(lambda d: {"square": d["x"] ** 2}, mbs.studies.grid(x=np.linspace(0.0, 3.0, 7)))
    text = mbs.report(tmp_path / "study.html", study=data, title="Squares").read_text()
    assert any("square" in row[0] and "9" in row for row in cells(text, "Study"))


def test_a_structure(tmp_path):
    axes = [("box", d) for d in "xyz"]
    system = mbs.LinearSystem(
        mass=np.eye(3), stiffness=np.diag([1e4, 2e4, 3e4]), coordinates=axes, positions={"box": (0.0, 0.0, 0.0)}
    )
    text = mbs.report(tmp_path / "box.html", system, modes=mbs.modes(system)).read_text()
    assert cells(text, "Model")[1][:2] == ("coordinates", "3")
    assert "15.92" in text.split("<h2>Modes</h2>")[1] and digest(system) in text


def test_a_batch_of_motions(results, tmp_path):
    system = results[0]
    motions = mbs.batch(
        lambda q: mbs.simulate(system, mbs.State.at(system, pin=q), t1=0.2), np.array([0.1, 0.2]), progress=False
    )
    text = mbs.report(tmp_path / "batch.html", system, motions=motions).read_text()
    assert "<h2>Motions</h2>" in text


def test_what_has_no_report_is_refused(results, tmp_path):
    with pytest.raises(ModelError, match="Numbers is a list: a report takes results"):
        mbs.report(tmp_path / "a.html", results[0], numbers=[1, 2])
    with pytest.raises(ModelError, match="the system is a int"):
        mbs.report(tmp_path / "a.html", 3)
    with pytest.raises(ModelError, match="traced"):
        jax.jit(lambda x: mbs.report(tmp_path / "a.html", found=x) and x)(1.0)
    assert not list(tmp_path.iterdir())


def test_a_report_that_is_too_long_says_so(tmp_path):
    with pytest.warns(UserWarning, match="5.1 MB"):
        mbs.report(tmp_path / "long.html", note="x" * 5_100_000)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mbs.report(tmp_path / "short.html", note="x")


LOOK = (Path(__file__).parent / "look.html").read_text()


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs a browser")
@pytest.mark.parametrize(("width", "media"), [(375, "print"), (1280, "print"), (718, "all")])
def test_no_text_is_cut_off_or_covered(page, tmp_path, width, media):
    """On a phone, on a screen, and as A4 paper less its margins shows it, 96 points an inch."""
    looked = tmp_path / "looked.html"
    looked.write_text(page.read_text().replace("</body>", LOOK).replace("@media print", f"@media {media}"))
    options = [
        "--headless=new",
        "--no-sandbox",
        f"--window-size={width},900",
        "--virtual-time-budget=4000",
        "--dump-dom",
    ]
    done = subprocess.run([BROWSER, *options, looked.as_uri()], capture_output=True, text=True, timeout=120)
    count, *bad = re.search(r"<title>looked (\d+) (\d+) (\d+) (\w+)</title>", done.stdout).groups()
    assert int(count) > 30 and bad == ["0", "0", "false"]


def test_every_part_of_a_machine_is_in_its_report(tmp_path):
    """Friction, oil, measures and blocks too; `describe` names them."""
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.4, 0.0, 0.0), inertia=0.1)
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.friction("rub", "pin", 0.125, radius=0.02)
    b.hydraulic("tank", mbs.hydraulics.Tank())
    b.hydraulic("bottle", mbs.hydraulics.Volume(1e-3))
    b.hydraulic("throttle", mbs.hydraulics.Orifice(1.25e-6), ports={"a": "tank", "b": "bottle"})
    b.measure("tilt", joint="pin")
    b.block("loop", mbs.blocks.PI(3.5, 0.25), "tilt")
    system = b.build()
    text = mbs.report(tmp_path / "arm.html", system).read_text()
    for part in (
        "rub",
        "radius 0.02 m",
        "0.125",
        "throttle",
        "1.25e-06",
        "a: tank, b: bottle",
        "tilt",
        "PI(kp=3.5, ki=0.25",
    ):
        assert part in text
    told = system.describe()
    for line in ("friction: rub in pin", "hydraulics: tank, bottle, throttle", "measures: tilt", "blocks: loop"):
        assert line in told.splitlines()
