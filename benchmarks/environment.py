"""Settings made before JAX and NumPy are imported; every benchmark imports `common`, which imports this first."""

import os


def prepare():
    """Settings of the benchmarks, unless JAXMBS_BENCHMARK_ENVIRONMENT=user asks for those of any user: none."""
    if os.environ.get("JAXMBS_BENCHMARK_ENVIRONMENT") != "user":
        tune()


def tune():
    """One BLAS thread and one thread inside XLA's operations, so that two rows of a table do not share the cores."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_cpu_multi_thread_eigen" not in flags:
        flags += " --xla_cpu_multi_thread_eigen=false"
    os.environ["XLA_FLAGS"] = flags.strip()
    os.environ.setdefault("JAX_PLATFORMS", "cpu")


prepare()
