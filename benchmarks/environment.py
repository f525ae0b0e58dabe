"""Settings made before JAX and NumPy are imported; every benchmark imports `common`, which imports this first."""

import importlib.metadata
import os

SMALL_LOOPS = "xla_cpu_small_while_loop_byte_threshold"


def prepare():
    """Settings of the benchmarks, unless JAXMBS_BENCHMARK_ENVIRONMENT=user asks for those of any user: none."""
    os.environ.setdefault("JAXMBS_COMPILE", "full")  # runs are measured, and compilation apart
    if os.environ.get("JAXMBS_BENCHMARK_ENVIRONMENT") != "user":
        tune()


def tune():
    """One BLAS thread, one thread inside XLA's operations, and one kernel per small loop on JAX before 0.12."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_cpu_multi_thread_eigen" not in flags:
        flags += " --xla_cpu_multi_thread_eigen=false"
    version = tuple(int(part) for part in importlib.metadata.version("jax").split(".")[:2])
    if version < (0, 12) and SMALL_LOOPS not in flags:
        flags += f" --xla_backend_extra_options={SMALL_LOOPS}=100000000"
    os.environ["XLA_FLAGS"] = flags.strip()
    os.environ.setdefault("JAX_PLATFORMS", "cpu")


prepare()
