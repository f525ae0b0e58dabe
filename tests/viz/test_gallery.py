"""The pictures of the manual are those that its pages make, all there and small."""

import json
import re

from jaxmbs.viz import Scene

from .gallery import IMAGES, saved, shown


def test_the_pages_make_what_they_show():
    assert shown() == saved() and len(shown()) > 8


def test_pictures_are_there_and_small():
    sizes = {name: (IMAGES / name).stat().st_size for name in shown()}
    assert max(sizes.values()) < 150e3
    assert not {path.name for path in IMAGES.iterdir() if path.is_file()} - shown()


def test_the_recorder_of_the_manual_finds_a_scene():
    """`docs/_ext/scenes.py` reads what a page of a scene plays."""
    source = (IMAGES.parent / "_ext" / "scenes.py").read_text("utf-8")
    pattern = re.search(r"_DATA = re.compile\(r'(.*)', re.DOTALL\)", source).group(1)
    data = {"title": "a scene"}
    assert json.loads(re.search(pattern, Scene(data).html, re.DOTALL).group(1)) == data
