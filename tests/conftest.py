"""Settings of the test run: made here, since importing the library changes none."""

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
    os.environ["XLA_FLAGS"] = (
        f"{os.environ.get('XLA_FLAGS', '')} {_flags} --xla_cpu_use_fusion_emitters=false"
        " --xla_cpu_enable_concurrency_optimized_scheduler=false --xla_backend_optimization_level=0"
    )

import jax
import pytest
from jaxtyping import install_import_hook

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_compilation_cache_dir", str(Path(__file__).parent.parent / ".jax_cache"))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def pytest_configure(config):
    # Types and shapes are checked in the quick tests; the checks make tracing an eighth longer.
    if config.option.markexpr not in ("slow", "long"):
        install_import_hook("jaxmbs", "beartype.beartype")


@pytest.fixture(autouse=True, scope="module")
def _forget_compiled_functions():
    """Free what a module compiled: thousands of executables exhaust a process's memory maps."""
    yield
    jax.clear_caches()
    gc.collect()
