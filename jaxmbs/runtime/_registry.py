"""Table of the tricks: which are on, and which do not work on this JAX and why."""

from typing import NamedTuple

import jax

from ._compiler_options import OPTIONS, SMALL_LOOPS, is_given, known_options
from ._small_call import sets_marks
from ._tricks import TRICKS, is_on, needed_tricks
from .tape import ASKED, machine_kind

_NO_MACHINE = "made without a C compiler; with one, install again"


class TrickState(NamedTuple):
    """A trick on the JAX at hand: its name, "on", "off", "needed" or "not available", why, and what it gains."""

    name: str
    state: str
    reason: str
    gain: str


def trick_states() -> list[TrickState]:
    """The state of every trick on this JAX, with its backend and XLA_FLAGS."""
    return [_trick_state(name, gain) for name, gain in TRICKS.items()]


def _trick_state(name, gain):
    state, reason = _state(name)
    return TrickState(name, state, reason, gain)


def _state(name):
    obstacle = _obstacle(name)
    if obstacle:
        return "not available", obstacle
    if name in needed_tricks():
        return "needed", needed_tricks()[name]
    return ("on", _remark(name)) if is_on(name) else ("off", "JAXMBS_TRICKS switches it off")


def _remark(name):
    """The machine that runs tapes."""
    if name != "tape":
        return ""
    if machine_kind() == "c":
        return "by the machine in C"
    reason = _NO_MACHINE if ASKED == "auto" else "JAXMBS_TAPE chooses it"
    return f"by the machine in NumPy, a hundred times slower: {reason}"


def _obstacle(name):
    """The reason why a trick does nothing here, or an empty text."""
    backend = jax.default_backend()
    if (
        name
        in (*OPTIONS, "small_call", "small_products", "chunked_maps", "sequential_lapack", "library_calls", "tape")
        and backend != "cpu"
    ):
        return f"for the CPU alone, not for {backend}"
    if name == "tape" and machine_kind() is None:
        return f"JAXMBS_TAPE chooses the machine in C: {_NO_MACHINE}"
    option = OPTIONS.get(name, "")
    if option and option not in known_options(backend):
        return f"the XLA of jax {jax.__version__} does not know {option}"
    if option and is_given(option):
        return f"XLA_FLAGS sets {option}"
    if name == "small_call" and not sets_marks(jax.__version__):
        return f"jax {jax.__version__}: XLA makes kernels of small loops itself, or takes no marks"
    if name == "small_call" and is_given(SMALL_LOOPS):
        return f"XLA_FLAGS sets {SMALL_LOOPS}"
    needs = ("fusion_emitters", "ynn_fusion")
    if name == "small_call" and not all(is_on(need) and not _obstacle(need) for need in needs):
        return f"needs {' and '.join(needs)}"
    return ""
