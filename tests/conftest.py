"""Settings of the test run: made here, since importing the library changes none."""

import collections
import contextlib
import ctypes
import gc
import os
import runpy
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ.setdefault("JAXMBS_STORE", "off")  # tests put other functions in place of the library's

import jax
import pytest
from jaxtyping import install_import_hook

gc.set_threshold(5_000, 20, 200)  # of what tracing makes hardly a thing is garbage; looking for it took a twentieth

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")
_CACHE = os.environ.get("JAX_COMPILATION_CACHE_DIR") or str(Path(__file__).parent.parent / ".jax_cache")
jax.config.update("jax_compilation_cache_dir", _CACHE)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


KINDS = ("slow", "long", "user")
_SMALL_LOOPS = "xla_cpu_small_while_loop_byte_threshold"


_PACKAGE = Path(__file__).parent.parent / "jaxmbs"
#: With JAXMBS_TYPES=check, as in CI, the quick tests take a quarter longer and check types and shapes: of all but the
#: compiler's room, which has no arrays of the mechanics, and whose many small calls would take more.
_CHECKED = [f"jaxmbs.{path.stem}" for path in _PACKAGE.iterdir() if path.stem not in ("runtime", "lazy", "__init__")]


def pytest_configure(config):
    chosen = config.option.markexpr
    # One tier from begin to end: tapes, which users have first; XLA where programs are to be those that it compiles.
    tier = os.environ.setdefault("JAXMBS_COMPILE", "full" if chosen == "user" else "tape")
    if not hasattr(config, "workerinput"):
        _build_machine_anew()
    if tier == "tape":  # else programs are those of users, without any flag of ours
        _compile_cheaply()
    if os.environ.get("JAXMBS_TYPES") == "check":
        install_import_hook(_CHECKED, "beartype.beartype")


def _build_machine_anew():
    """Build the machine of tapes where its sources are younger, as they are after `git pull`: without it tests run
    many times slower.  An installation that was made without a compiler stays one."""
    build = runpy.run_path(str(_PACKAGE / "runtime" / "tape" / "_build.py"))
    library, sources = build["LIBRARY"], [build["FOLDER"] / name for name in ("machine.c", "opcodes.h")]
    if library.exists() and max(source.stat().st_mtime for source in sources) > library.stat().st_mtime:
        build["build_machine"]()


def _compile_cheaply():
    """Set XLA_FLAGS, which XLA reads at its first program, so that compilation takes half as long."""
    given = os.environ.get("XLA_FLAGS", "")
    if _SMALL_LOOPS in given or jax.__version_info__ >= (0, 12):
        return
    # JAX 0.11.2 does not know the flag any more, and XLA ends the process that gives it one it does not know.
    emitters = " --xla_cpu_use_fusion_emitters=false" if jax.__version_info__ < (0, 11) else ""
    os.environ["XLA_FLAGS"] = (
        # Small loops as one kernel (docs/start/sharp-bits.md); the others halve compilation, and make runs slower.
        f"{given} --xla_backend_extra_options={_SMALL_LOOPS}=100000000,xla_cpu_disable_loop_unrolling"
        f"{emitters} --xla_cpu_enable_concurrency_optimized_scheduler=false"
        " --xla_backend_optimization_level=0"
        # Two workers have two cores: a program is compiled in one piece by one thread.
        " --xla_cpu_parallel_codegen_split_count=1"
    )


def pytest_ignore_collect(collection_path, config):
    """Do not import files without the mark that is asked for: a test has it from its own file, or from the zoo."""
    kind = config.option.markexpr
    if kind in KINDS and collection_path.match("test_*.py"):
        text = collection_path.read_text(encoding="utf-8")
        return True if f"mark.{kind}" not in text and "of_all(" not in text else None
    return None


@pytest.hookimpl(tryfirst=True)  # before pytest chooses by marks
def pytest_collection_modifyitems(items):
    several = [item.nodeid for item in items if sum(item.get_closest_marker(k) is not None for k in KINDS) > 1]
    if several:
        raise pytest.UsageError(f"a test has one of the marks {', '.join(KINDS)}: {', '.join(several)}")


MOST_MAPS = 25_000  # Linux gives a process 65 530 memory maps and ends one that asks for more; a program has 3 to 100
LOOK_EVERY = 50  # programs
MOST_BYTES = 3_000_000_000  # of one worker; what is freed stays with the C library until it is told to give it back
_compiled = collections.Counter()


@jax.monitoring.register_event_duration_secs_listener
def _count(event, seconds, **_):
    _compiled[event] += 1


def _crowded():
    """Whether the programs kept by this process come near to what the operating system gives it."""
    if _resident_bytes() > MOST_BYTES:
        _give_back()
        return _resident_bytes() > MOST_BYTES / 2
    if _compiled["/jax/core/compile/backend_compile_duration"] < LOOK_EVERY:
        return False
    _compiled.clear()
    maps = Path("/proc/self/maps")
    return maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS


def _resident_bytes():
    pages = Path("/proc/self/statm")
    return int(pages.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if pages.exists() else 0


def _give_back():
    """Memory that nothing uses, to the operating system: half of what a worker has after a thousand tests."""
    gc.collect()
    with contextlib.suppress(AttributeError, OSError):  # of glibc alone
        ctypes.CDLL(None).malloc_trim(0)


@pytest.fixture(autouse=True)
def _forget_compiled_functions():
    """Tests share what is compiled, as long as there is room for it."""
    yield
    if _crowded():
        jax.clear_caches()
        _give_back()
