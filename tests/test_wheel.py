"""A built wheel holds all that the demo needs."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MACHINE = "jaxmbs/runtime/tape/machine.so"


@pytest.mark.long
@pytest.mark.parametrize("compiler", ["", "false"])
def test_a_wheel_has_the_tape_machine_where_there_is_a_c_compiler(tmp_path, compiler):
    """Without one it is made all the same, for any platform."""
    copy = tmp_path / "copy"
    shutil.copytree(ROOT / "jaxmbs", copy / "jaxmbs", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    environment = {**os.environ, "CC": compiler} if compiler else os.environ
    build = [sys.executable, "-m", "pip", "wheel", str(copy), "--no-deps", "--quiet", "--wheel-dir", str(tmp_path)]
    subprocess.run(build, check=True, timeout=600, env=environment)
    (wheel,) = tmp_path.glob("jaxmbs-*.whl")
    assert (MACHINE in zipfile.ZipFile(wheel).namelist()) == (compiler != "false")
    assert wheel.name.endswith("none-any.whl") == (compiler == "false")


@pytest.mark.long
def test_a_wheel_outside_the_checkout_runs_the_demo(tmp_path):
    build = [sys.executable, "-m", "pip", "wheel", str(ROOT), "--no-deps", "--quiet", "--wheel-dir", str(tmp_path)]
    subprocess.run(build, check=True, timeout=600)
    site = tmp_path / "site"
    zipfile.ZipFile(next(tmp_path.glob("jaxmbs-*.whl"))).extractall(site)

    def run(*command):
        environment = os.environ | {"PYTHONPATH": str(site)}
        options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True, "timeout": 900}
        done = subprocess.run([sys.executable, *command], **options)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert run("-c", "import jaxmbs; print(jaxmbs.__file__)").startswith(str(site))
    assert "reference" in run("-m", "jaxmbs", "demo", "--quick", "--output", "demo")
    assert (tmp_path / "demo" / "loads.csv").exists()
    assert (tmp_path / "demo" / "scene.html").stat().st_size > 1e5  # with the player that it plays in
