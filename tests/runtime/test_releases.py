"""Releases of JAX that are known to be faulty are excluded, and named where one is there all the same."""

import subprocess
import sys
import tomllib
import warnings
from pathlib import Path

import jax
import pytest
from packaging.requirements import Requirement

from jaxmbs.runtime._releases import FAULTY_RELEASES, release_advice, warn_of_wrong_release

ROOT = Path(__file__).parent.parent.parent


def test_faulty_releases_are_those_that_an_installation_excludes():
    texts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    (jax_itself,) = (r for r in map(Requirement, texts) if r.name == "jax")
    excluded = {part.version for part in jax_itself.specifier if part.operator == "!="}
    assert excluded == FAULTY_RELEASES.keys()
    assert all(release in (ROOT / "docs/start/installation.md").read_text(encoding="utf-8") for release in excluded)


@pytest.mark.parametrize("release", FAULTY_RELEASES)
def test_a_release_that_computes_wrong_numbers_is_told_at_import(monkeypatch, release):
    monkeypatch.setattr(jax, "__version__", release)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_wrong_release()
    assert len(caught) == FAULTY_RELEASES[release].is_wrong
    assert all(
        f"jax {release}" in str(warning.message) and "pip install" in str(warning.message) for warning in caught
    )
    assert len(release_advice(release)) == 1 and not release_advice("0.10.1")


@pytest.mark.long
def test_the_warning_comes_once_and_names_the_import():
    code = "import warnings, jax; jax.__version__ = '0.10.2'; import jaxmbs; import jaxmbs.motion"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.count("RuntimeWarning: jax 0.10.2 computes wrong numbers") == 1 and "<string>:1" in done.stderr
