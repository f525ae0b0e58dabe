"""Entry points: public functions of a system and a state are compiled, check the state and map over motions."""

import functools
import math
from collections.abc import Callable, Mapping
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..checks import place_of
from ..errors import ModelError
from ..runtime import as_array, jit, map_chunked
from ._changes import with_changes
from ._internal_states import replace_field

Function = TypeVar("Function", bound=Callable)


def state_function(function: Function) -> Function:
    """Compile f(system, state, ...) as a public function, which refuses the state of another system.

    For a motion, or states with leading axes, results have those axes in front.
    """

    @functools.wraps(function)
    def at_one(system, state, *args, **kwargs):
        here = with_changes(system, state)  # with the numbers of the state: functions inside need not take them again
        state = state if state.changes is None else replace_field(state, "changes", None)
        return function(here, state, *args, **kwargs)

    @functools.wraps(function)
    def along(system, states, *args, **kwargs):
        return map_states(lambda state: at_one(system, state, *args, **kwargs), states)

    compiled = jit(at_one)
    compiled_along = jit(along)

    @functools.wraps(function)
    def ask(system, state, *args, **kwargs):
        states = states_of(system, state)
        return (compiled_along if states.t.ndim else compiled)(system, states, *args, **kwargs)

    return ask  # type: ignore[return-value]


def map_states(function: Callable, states, *rates) -> PyTree:
    """Map `function(state, *rates)` over the leading axes of states and of rates (..., nv), if they have any."""
    lead = states.t.shape
    if not lead:
        return function(states, *rates)
    rows = jax.tree.map(lambda x: x.reshape(math.prod(lead), *x.shape[len(lead) :]), (states, *rates))
    found = map_chunked(lambda row: function(*row), rows)
    return jax.tree.map(lambda x: x.reshape(*lead, *x.shape[1:]), found)


def check_system(system) -> None:
    """Raises: TypeError for what is no mechanism; ModelError for one built in another precision than JAX has now."""
    if not hasattr(system, "topology"):
        raise TypeError(f"a System is needed, as SystemBuilder.build() makes it, not a {type(system).__name__}")
    check_precision(system.gravity)


def check_precision(numbers) -> None:
    """Raises: ModelError for numbers in double precision where JAX is in single precision: mixed types would fail."""
    if getattr(numbers, "dtype", None) == np.float64 and jnp.result_type(float) == np.float32:
        raise ModelError(
            [
                "the model is in double precision, and JAX has been switched to single since it was built: call "
                "jax.config.update('jax_enable_x64', True) again, or build the model anew"
            ]
        )


def check_state(system, state) -> None:
    """Check that a state, or states with leading axes, has the coordinates of the system.

    States made for a system have the layout of its joints; of one made by hand only the sizes are known.

    Raises: ModelError for the state of another system; TypeError for what is no system or no state.
    """
    if hasattr(state, "topology"):
        raise TypeError(f"the system comes first, and the state after it; got a {type(system).__name__} and a System")
    check_system(system)
    if not hasattr(state, "structure"):
        hint = ": take one of its states, motion[k] or motion.end" if hasattr(state, "states") else ""
        raise TypeError(f"a State is needed, as State.at(system, ...) makes it, not a {type(state).__name__}{hint}")
    top = system.topology
    if state.structure is not None and state.structure != top.structure:
        raise ModelError(
            [f"the state belongs to another system: it has {_list_joints(state)}, this one {_list_joints(top)}"]
        )
    for part, size in (("coordinates", top.num_coordinates), ("velocities", top.num_velocities)):
        shape = getattr(state, part).shape
        if not shape or shape[-1] != size:
            raise ModelError(
                [f"the state has {part} of shape {shape}; this system has {size}, of {_list_joints(top)}"]
            )
    _check_internal(system, state)


def _check_internal(system, state):
    """Raises: ModelError for a state without the internal states of the system, or with others."""
    records, own = system.topology.internal, getattr(state.internal, "records", ())
    if own == records:
        return
    names = [", ".join(record.name for record in some) or "none" for some in (own, records)]
    hint = "; State.at(system, ...) makes a state with them, State(..., internal=state.internal) keeps them"
    raise ModelError([f"the state has the internal states {names[0]}; this system has {names[1]}{hint}"])


def check_single_state(system, state) -> None:
    """Check a state as `check_state` does.  Raises: ValueError also for states with leading axes."""
    check_state(system, state)
    if state.t.ndim:
        raise ValueError(
            f"this function takes one state, got states with axes {state.t.shape}: take one of them, or use jax.vmap"
        )


def states_of(system, motion):
    """The states of a motion, or a State as it is, that fit the system.  Raises: as `check_state`."""
    states = getattr(motion, "states", motion)
    check_state(system, states)
    return states


def rates_of(system, states, rates, what: str):
    """Rates (..., nv), or by joint, as an array.

    Raises: ValueError unless there is one for every velocity of the states; UnknownNameError.
    """
    shape = states.velocities.shape
    rates = _concatenate_joints(system, shape, rates, what) if isinstance(rates, Mapping) else as_array(rates)
    if rates.shape != shape:
        raise ValueError(f"{what}: shape {rates.shape}, not {shape} as that of the velocities")
    return rates


def _concatenate_joints(system, shape, rates, what):
    """Rates by joint as one array."""
    moving = {name: size for name, _, _, size, _ in system.topology.structure}
    for name in rates:
        place_of("joint with velocities", name, moving)
    missing = [repr(name) for name in moving if name not in rates]
    if missing:
        raise ValueError(f"{what}: none given for {', '.join(missing)}")
    parts = []
    for name, size in moving.items():
        part = as_array(rates[name])
        wanted = (*shape[:-1], size)
        if part.shape != wanted and (size > 1 or part.shape != shape[:-1]):
            raise ValueError(f"{what}: joint {name!r} takes shape {wanted}, got {part.shape}")
        parts.append(jnp.reshape(part, wanted))
    return jnp.concatenate(parts, axis=-1)


def _list_joints(owner) -> str:
    """Text that lists the joints with coordinates."""
    names = [f"{name} ({kind})" for name, kind, *_ in owner.structure]
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"the joints {shown}" if names else "no joints"
