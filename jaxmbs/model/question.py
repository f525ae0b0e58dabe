"""`question`: what every public function of a system and a state shares: the state must fit, and it runs compiled."""

import functools
from collections.abc import Callable
from typing import TypeVar

from ..errors import ModelError
from ..math.jit import jit

Function = TypeVar("Function", bound=Callable)


def question(function: Function) -> Function:
    """A compiled function f(system, state, ...) that refuses the state of another system before it is traced."""
    compiled = jit(function)

    @functools.wraps(function)
    def ask(system, state, *args, **kwargs):
        check_fits(system, state)
        return compiled(system, state, *args, **kwargs)

    return ask  # type: ignore[return-value]


def check_fits(system, state) -> None:
    """ModelError unless a state (or states with leading axes) has the coordinates of the system.

    States that were made for a system remember its joints; of one written down by hand only the sizes are known.
    """
    top = system.topology
    if state.structure is not None and state.structure != top.structure:
        raise ModelError([f"the state belongs to another system: it has {_list(state)}, this one {_list(top)}"])
    for part, size in (("coordinates", top.num_coordinates), ("velocities", top.num_velocities)):
        shape = getattr(state, part).shape
        if not shape or shape[-1] != size:
            raise ModelError([f"the state has {part} of shape {shape}; this system has {size}, of {_list(top)}"])


def _list(owner) -> str:
    """The joints with coordinates, in words."""
    names = [f"{name} ({kind})" for name, kind, *_ in owner.structure]
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"the joints {shown}" if names else "no joints"
