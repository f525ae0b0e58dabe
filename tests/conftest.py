"""Settings of the test run: made here, since importing the library changes none."""

import collections
import gc
import importlib.metadata
import os
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"
_SMALL_LOOPS = "xla_cpu_small_while_loop_byte_threshold"
_JAX_VERSION = tuple(int(part) for part in importlib.metadata.version("jax").split(".")[:2])
if _JAX_VERSION < (0, 12) and _SMALL_LOOPS not in os.environ.get("XLA_FLAGS", ""):
    # Small loops as one kernel (docs/start/sharp-bits.md); the others make compilation half as long, and runs slower.
    _flags = f"--xla_backend_extra_options={_SMALL_LOOPS}=100000000,xla_cpu_disable_loop_unrolling"
    # Two workers have two cores: a program is compiled in one piece by one thread.
    os.environ["XLA_FLAGS"] = (
        f"{os.environ.get('XLA_FLAGS', '')} {_flags} --xla_cpu_use_fusion_emitters=false"
        " --xla_cpu_enable_concurrency_optimized_scheduler=false --xla_backend_optimization_level=0"
        " --xla_cpu_parallel_codegen_split_count=1"
    )

import jax
import pytest
from jaxtyping import install_import_hook

gc.set_threshold(5_000, 20, 200)  # of what tracing makes hardly a thing is garbage; looking for it took a twentieth

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_compilation_cache_dir", str(Path(__file__).parent.parent / ".jax_cache"))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def pytest_configure(config):
    # Types and shapes are checked in the quick tests; the checks make tracing an eighth longer.
    if config.option.markexpr not in ("slow", "long"):
        install_import_hook("jaxmbs", "beartype.beartype")


def pytest_collection_modifyitems(items):
    both = [item.nodeid for item in items if item.get_closest_marker("slow") and item.get_closest_marker("long")]
    if both:
        raise pytest.UsageError(f"a long test is never also slow: {', '.join(both)}")


MOST_MAPS = 25_000  # Linux gives a process 65 530 memory maps and ends one that asks for more; a program has 3 to 100
LOOK_EVERY = 50  # programs
_compiled = collections.Counter()


@jax.monitoring.register_event_duration_secs_listener
def _count(event, seconds, **_):
    _compiled[event] += 1


def _crowded():
    """Whether the programs kept by this process come near to what the operating system gives it."""
    if _compiled["/jax/core/compile/backend_compile_duration"] < LOOK_EVERY:
        return False
    _compiled.clear()
    maps = Path("/proc/self/maps")
    return maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS


@pytest.fixture(autouse=True)
def _forget_compiled_functions():
    """Tests share what is compiled, as long as there is room for it."""
    yield
    if _crowded():
        jax.clear_caches()
        gc.collect()
