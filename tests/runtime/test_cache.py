"""Programs kept between processes."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import pytest
from jax.experimental.compilation_cache import compilation_cache

import jaxmbs as mbs

PENDULUM = """
import collections, sys
import jax, jax.monitoring
jax.config.update("jax_enable_x64", True)
import jaxmbs as mbs
count = collections.Counter()
jax.monitoring.register_event_listener(lambda event, **_: count.update([event.rsplit("/")[-1]]))
print(mbs.cache(sys.argv[1]))
b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
b.body("bob", mass=float(sys.argv[2]), com=(0.0, -0.8, 0.0))
b.joint("pin", mbs.Revolute("z"), "ground", "bob")
system = b.build()
loads = mbs.reactions(system, mbs.simulate(system, mbs.State.at(system, pin=1.0), t1=0.5))
print(float(abs(loads["pin"].force).max()), count["cache_hits"])
"""


def run(*arguments):
    found = subprocess.run([sys.executable, "-c", PENDULUM, *arguments], capture_output=True, text=True, check=True)
    folder, numbers = found.stdout.splitlines()
    force, hits = numbers.split()
    return Path(folder), float(force), int(hits)


def programs(folder):
    return {path.name for path in folder.iterdir() if path.name.endswith("-cache")}


@pytest.mark.long
def test_a_second_process_compiles_nothing(tmp_path):
    """Every program of it is found, also with another mass: none of them calls back into Python."""
    folder, force, _ = run(str(tmp_path), "2.0")
    kept = programs(folder)
    assert folder.parent == tmp_path and kept
    again, other, hits = run(str(tmp_path), "3.0")
    assert again == folder and hits >= len(kept) and programs(folder) == kept
    assert abs(other / force - 1.5) < 1e-6


def test_old_programs_go_first(tmp_path):
    before = jax.config.jax_compilation_cache_dir
    try:
        folder = mbs.cache(tmp_path)
        for age, name in enumerate("cab"):
            (folder / name).write_bytes(bytes(100))
            os.utime(folder / name, (1000.0 - age, 1000.0 - age))
        mbs.cache(tmp_path, size=250)
    finally:
        jax.config.update("jax_compilation_cache_dir", before)
        compilation_cache.reset_cache()
    assert {file.name for file in folder.iterdir()} == {"c", "a"}


@pytest.mark.long
def test_importing_sets_no_cache():
    code = "import jax, jaxmbs; print(jax.config.jax_compilation_cache_dir)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "None"


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path):
    before = jax.config.jax_compilation_cache_dir
    (tmp_path / "file").write_text("")
    try:
        mbs.cache(tmp_path / "file")
    except OSError as error:
        assert "file" in str(error)
    else:
        raise AssertionError("no error")
    assert jax.config.jax_compilation_cache_dir == before


def test_another_number_is_not_traced_again():
    """Floats and arrays are traced, names are not."""
    seen = []

    @mbs.jit
    def shifted(design, name):
        seen.append(name)
        return design["length"] + len(name)

    assert [float(shifted({"length": x}, "arm")) for x in (1.0, 2.5)] == [4.0, 5.5] and seen == ["arm"]
    assert float(shifted({"length": 1.0}, "leg!")) == 5.0 and seen == ["arm", "leg!"]
    assert float(jax.jit(jax.grad(lambda x: mbs.jit(jax.numpy.square, compile="quick")(x)))(3.0)) == 6.0
