"""A scene in a browser, where one is installed: it loads without complaint, plays, and shows what it should."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from jaxmbs import fem, viz
from tests.viz.machines import made_up_loads, plate, turning_four_bar

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
REFERENCE = Path(__file__).parent / "four_bar_scene.png"
pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs a browser")

_OPTIONS = (
    "--headless=new --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--hide-scrollbars --enable-logging=stderr --no-first-run --disable-background-networking"
).split()


def ask(page, options, size=(640, 420), address="", lasting=2500):
    """What the browser prints of a page after so many ms of its own clock; fails where the page complained."""
    where = f"--window-size={size[0]},{size[1]}"
    command = [BROWSER, *_OPTIONS, where, f"--virtual-time-budget={lasting}", *options, f"{page.as_uri()}{address}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not complaints, complaints
    return done.stdout


def photographed(page, picture, address="", size=(640, 420)):
    """The page as an array (height, width, 3) from 0 to 1."""
    ask(page, [f"--screenshot={picture}"], size, address)
    return imread(picture)[..., :3]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    system, motion = turning_four_bar()
    path = tmp_path_factory.mktemp("browser") / "motion.html"
    viz.scene(system, motion, path, loads=made_up_loads(motion.ts), traces=["C.parent"], title="Four-bar")
    return path


@pytest.mark.slow
def test_it_plays(page):
    """Without a time in the address it runs from the start; a busy machine draws few pictures, and late."""
    for lasting in (2_500, 10_000, 40_000):
        ready = re.search(r'data-ready="([-0-9.e]+)"', ask(page, ["--dump-dom"], lasting=lasting))
        if ready and float(ready.group(1)) > 0.02:
            return
    raise AssertionError(f"it stands at {ready.group(1)} s" if ready else "it is not ready")


@pytest.mark.slow
def test_the_address_sets_the_time(page):
    dom = ask(page, ["--dump-dom"], address="#t=1.5", lasting=10_000)  # a busy machine draws late
    assert 'data-ready="1.5"' in dom and "1.50 s" in dom


@pytest.mark.long
def test_it_shows_the_pose_asked_for(page, tmp_path):
    """The same picture as the one that was looked at, and another one at another time."""
    found = photographed(page, tmp_path / "a.png", "#t=1.5")
    other = photographed(page, tmp_path / "b.png", "#t=4.0")
    reference = imread(REFERENCE)[..., :3]
    assert found.shape == reference.shape
    far = lambda a, b: np.mean(np.max(np.abs(a - b), axis=-1) > 0.1)
    assert far(found, reference) < 0.01
    assert far(found, other) > 0.02
    assert len(np.unique(np.round(found.reshape(-1, 3), 1), axis=0)) > 20  # not blank


@pytest.mark.long
def test_a_mesh_bends(tmp_path):
    structure = plate()
    clamped = fem.assemble(structure)
    shape = np.zeros(clamped.num_rows)
    nodes = structure.positions[structure.index.nodes, 0]
    up = structure.index.directions == 2
    shape[up] = (np.asarray(nodes)[up] / 0.5) ** 2
    viz.scene(clamped, np.array([0.0, 0.08, 0.0])[:, None] * shape, tmp_path / "plate.html", structures=structure)
    flat, bent = (photographed(tmp_path / "plate.html", tmp_path / f"{t}.png", f"#t={t}") for t in (0, 1))
    red = lambda picture: np.mean((picture[..., 0] > 0.5) & (picture[..., 1] < 0.35))
    assert red(bent) > 0.001 > 0.0001 > red(flat)
