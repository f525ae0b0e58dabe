"""Options of XLA's compiler for the library's programs, by their kind, and what XLA_FLAGS sets beside them."""

import functools
import os

import jax

from ._tricks import OFF

#: What XLA's CPU compiler is told.  Its emitters of fused loops and its higher levels take half of the time of
#: compilation, and gain a tenth in trees and nothing in loops; 32 parts of a program are too many.  Sums that go to
#: its library of kernels keep the loop around them from being one kernel.  Without optimisation a program compiles in
#: half the time and runs slower.  What runs for hundreds of designs and is no motion gains by the
#: highest level: a tree's gradient is 1.4 times as fast, for a fifth more to compile.
_FULL = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_cpu_experimental_ynn_fusion_type": "",
    "xla_cpu_parallel_codegen_split_count": 8,
    "xla_backend_optimization_level": 1,
}
_QUICK = {**_FULL, "xla_backend_optimization_level": 0}
_OFTEN = {**_FULL, "xla_backend_optimization_level": 3}
#: The option that each of these tricks sets.
OPTIONS = dict(zip(("fusion_emitters", "ynn_fusion", "codegen_split", "optimization_level"), _FULL, strict=True))
#: Releases of JAX from which on XLA has an option no more.
GONE = {"xla_cpu_use_fusion_emitters": (0, 11)}
#: Kinds of programs: by a tape first and then compiled, by a tape alone, compiled without optimisation, and with it.
KINDS = ("auto", "tape", "quick", "full")
#: The option of XLA_FLAGS for loops that become one kernel, in bytes of what a loop carries.
SMALL_LOOPS = "xla_cpu_small_while_loop_byte_threshold"
_SMALL_LOOPS_SINCE = (0, 12)  # releases of JAX that make all small loops one kernel by themselves
_SMALL_LOOPS_FLAG = f"--xla_backend_extra_options={SMALL_LOOPS}=100000000"


def compiler_options(compile: str, backend: str, often: bool = False) -> dict:
    """Options of the compiler for programs of a kind.

    Those that this version of JAX does not know are left out, those that the user sets in XLA_FLAGS, and those of
    tricks that are off.

    Args: often: True for an optimised program, no motion, that is to run for hundreds of designs.

    Raises: ValueError for another `compile`.
    """
    check_kind(compile)
    return _chosen(compile, backend, often, OFF.value)


@functools.cache
def _chosen(compile, backend, often, off):
    is_full = compile in ("auto", "full")
    wanted = _OFTEN if often and is_full else _FULL if is_full else _QUICK
    known = set(known_options(backend)) - {OPTIONS[trick] for trick in off & OPTIONS.keys()}
    return {name: value for name, value in wanted.items() if name in known and not is_given(name)}


def check_kind(compile: str) -> None:
    """Raises: ValueError for another kind of program than "auto", "tape", "quick" and "full"."""
    if compile not in KINDS:
        raise ValueError(f"compile must be 'auto', 'tape', 'quick' or 'full', got {compile!r}")


@functools.cache
def known_options(backend: str) -> tuple[str, ...]:
    """Names of the options that the compiler takes: tried all at once, and one by one where that fails."""
    if backend != "cpu":
        return ()
    return tuple(_QUICK) if _is_known(_QUICK) else tuple(name for name in _QUICK if _is_known({name: _QUICK[name]}))


def _is_known(some):
    try:
        jax.jit(lambda x: x, compiler_options=some).lower(0.0).compile()
    except jax.errors.JaxRuntimeError:
        return False
    return True


# ---------------------------------------------------------------------------------------------------------- XLA_FLAGS
def is_given(option: str) -> bool:
    """True if the user sets an option of XLA for the whole process."""
    return option in os.environ.get("XLA_FLAGS", "")


def makes_kernels_itself(version: str) -> bool:
    """True for releases of JAX that compile every small loop on the CPU as one kernel."""
    return tuple(int(part) for part in version.split(".")[:2]) >= _SMALL_LOOPS_SINCE


def flag_advice(version: str, marks: bool) -> list[str]:
    """Lines of advice on XLA_FLAGS for a release of JAX; marks: whether the library marks its loops on it."""
    if makes_kernels_itself(version) or jax.default_backend() != "cpu" or is_given(SMALL_LOOPS):
        return []
    gain = "gradients and trees run up to six times" if marks else "motions, gradients and trees run several times"
    return [f'jax {version} on CPU: set XLA_FLAGS="{_SMALL_LOOPS_FLAG}"', f"  before Python starts; {gain} faster."]


def set_quick_flags() -> None:
    """Set XLA_FLAGS of this process for programs that run once, before its first compilation: no optimisation, and on
    JAX before 0.12 the flag for small loops, which compiles a tenth faster than the library's marks."""
    flags = [os.environ["XLA_FLAGS"]] if os.environ.get("XLA_FLAGS") else []
    if not is_given("xla_backend_optimization_level"):
        flags.append("--xla_backend_optimization_level=0")
    if not makes_kernels_itself(jax.__version__) and not is_given(SMALL_LOOPS):
        flags.append(_SMALL_LOOPS_FLAG)
    os.environ["XLA_FLAGS"] = " ".join(flags)
