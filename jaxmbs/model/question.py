"""`question`: what every public function of a system and a state shares: the state must fit, and it runs compiled."""

import functools
from collections.abc import Callable
from typing import TypeVar

from ..errors import ModelError
from ..math.host import as_array
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


def check_system(system) -> None:
    """TypeError for what is no mechanism."""
    if not hasattr(system, "topology"):
        raise TypeError(f"a System is needed, as SystemBuilder.build() makes it, not a {type(system).__name__}")


def check_fits(system, state) -> None:
    """ModelError unless a state (or states with leading axes) has the coordinates of the system.

    States that were made for a system remember its joints; of one written down by hand only the sizes are known.

    Raises: TypeError for what is no system or no state.
    """
    if hasattr(state, "topology"):
        raise TypeError(f"the system comes first, and the state after it; got a {type(system).__name__} and a System")
    check_system(system)
    if not hasattr(state, "structure"):
        hint = ": take one of its states, or jax.vmap for all of them" if hasattr(state, "states") else ""
        raise TypeError(f"a State is needed, as State.at(system, ...) makes it, not a {type(state).__name__}{hint}")
    top = system.topology
    if state.structure is not None and state.structure != top.structure:
        raise ModelError([f"the state belongs to another system: it has {_list(state)}, this one {_list(top)}"])
    for part, size in (("coordinates", top.num_coordinates), ("velocities", top.num_velocities)):
        shape = getattr(state, part).shape
        if not shape or shape[-1] != size:
            raise ModelError([f"the state has {part} of shape {shape}; this system has {size}, of {_list(top)}"])


def states_of(system, motion):
    """The states of a motion, or a State as it is, that fit the system.  Raises: as `check_fits`."""
    states = getattr(motion, "states", motion)
    check_fits(system, states)
    return states


def rates_of(states, rates, what: str):
    """Numbers as an array; ValueError unless there is one for every velocity of the states."""
    rates, shape = as_array(rates), states.velocities.shape
    if rates.shape != shape:
        raise ValueError(f"{what}: shape {rates.shape}, not {shape} as that of the velocities")
    return rates


def _list(owner) -> str:
    """The joints with coordinates, in words."""
    names = [f"{name} ({kind})" for name, kind, *_ in owner.structure]
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"the joints {shown}" if names else "no joints"
