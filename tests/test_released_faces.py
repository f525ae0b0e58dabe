"""Whoever wrote for the last release is told what changed: its public names are there, or stand in the changelog."""

import re
import warnings
from pathlib import Path

import jaxmbs

from . import faces

ROOT = Path(__file__).parent.parent
RELEASED = (Path(__file__).parent / "released_faces.txt").read_text().splitlines()
CHANGELOG = (ROOT / "CHANGELOG.md").read_text()
VERSIONS = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", CHANGELOG, re.M)


def lost(kept):
    """Names and arguments of kept lines that are there no more, with the words that tell of them."""
    gone = set()
    for row in kept:
        path, _, names = row.partition("(")
        owner, _, own = path.rpartition(".")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            thing = faces.today(path)
        now = faces.arguments(thing) if callable(thing) else None
        if thing is faces.GONE:
            gone.add(path)
            if owner not in gone:  # of a class that is gone, all is
                yield path, {own, owner.rpartition(".")[2]}
        elif now is not None and not any(name.startswith("**") for name in now):
            before = [name for name in names.rstrip(")").split(", ") if name and not name.startswith("*")]
            yield from ((path, {name}) for name in before if name not in now)


def test_names_that_went_since_the_last_release_are_in_the_changelog():
    since = CHANGELOG.partition("## [Unreleased]")[2].partition(f"## [{VERSIONS[0][0]}]")[0]
    told = set(re.findall(r"\w+", since))
    assert [(path, words) for path, words in lost(RELEASED) if not words & told] == []


def test_what_is_lost_is_seen():
    kept = ["jaxmbs.simulate", "jaxmbs.forces.Cable(kinds, slip_speed)", "jaxmbs.linear.LinearSystem.changed()"]
    assert list(lost(kept)) == [
        ("jaxmbs.forces.Cable", {"slip_speed"}),
        ("jaxmbs.linear.LinearSystem.changed", {"changed", "LinearSystem"}),
    ]


def test_versions_fall_with_their_dates_and_the_package_has_the_first():
    numbers = [tuple(map(int, version.split("."))) for version, _ in VERSIONS]
    assert numbers == sorted(numbers, reverse=True) and len(set(numbers)) == len(numbers)
    assert [date for _, date in VERSIONS] == sorted((date for _, date in VERSIONS), reverse=True)
    assert jaxmbs.__version__.split(".dev")[0] == VERSIONS[0][0]
    assert f"version: {VERSIONS[0][0]}\n" in (ROOT / "CITATION.cff").read_text()
