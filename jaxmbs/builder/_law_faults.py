"""Faults of a force law that one abstract call of its methods shows: shapes, and names of internal states."""

import jax
import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, faults_if
from ..forces import AbstractLaw, InternalState
from ..forces._law_at import LawAt
from ..runtime import as_array, explain_error


def law_call_faults(law, port, displacement, size) -> list[str]:
    """Faults of the effort (size,) that a law returns, and of its internal states, found by their shapes alone.

    Args: displacement: as the port's methods take it.
    """
    flow, t = as_array(np.zeros(size)), as_array(0.0)
    declared, faults = _declared_states(law)
    if faults:
        return faults
    if not declared:
        faults = effort_faults(law, port, displacement, flow, t)
        if faults and type(law).internal_states is not AbstractLaw.internal_states:
            return ["internal_states must be a dict of InternalState by name, got none", *faults]
        return faults
    s = {name: jnp.zeros(one.shape) for name, one in declared.items()}
    (x, v), here = port.arguments(displacement, flow), LawAt(law, s)
    faults = effort_faults(here, port, displacement, flow, t)
    faults += named_faults("rate", lambda: law.rate(*x, *v, s, t), declared, True)
    faults += named_faults("start", lambda: law.start(*x, *v, t), declared, False)
    wrong, shape = _shape_of("potential", lambda: here.potential(*x, t))
    return faults + (wrong or faults_if((shape != (), f"its potential has shape {shape}, not ()")))


def effort_faults(law, port, displacement, flow, t):
    """Faults of the effort of a law at its states."""
    faults, found = _shape_of("law", lambda: port.effort(law, displacement, flow, t))
    return faults or faults_if((found != flow.shape, f"the law gives shape {found}, not {flow.shape}"))


def _shape_of(what, call):
    """(faults, shape) of what a method returns."""
    try:
        return [], jax.eval_shape(lambda: jnp.asarray(call())).shape
    except Exception as error:  # noqa: BLE001 - the user's own code
        return [f"the {what} cannot be evaluated: {explain_error(error)}"], None


def declared_state_faults(part) -> list[str]:
    """Faults of the declaration of the internal states of a law or block."""
    return _declared_states(part)[1]


def _declared_states(law):
    """(the declared internal states by name, faults of the declaration)."""
    try:
        declared = law.internal_states
    except Exception as error:  # noqa: BLE001 - the user's own code
        return {}, [f"internal_states cannot be evaluated: {explain_error(error)}"]
    if not isinstance(declared, dict):
        return {}, [f"internal_states must be a dict of InternalState by name, got {declared!r}"]
    faults = []
    for name, one in declared.items():
        if not isinstance(name, str) or not isinstance(one, InternalState):
            faults.append(f"internal_states: {name!r} must be a name with an InternalState, got {one!r}")
        elif any_concrete(lambda x: ~((x > 0.0) & np.isfinite(x)), one.scale):
            faults.append(f"internal state {name!r}: its scale must be positive and finite, got {one.scale}")
    return declared, faults


def named_faults(what, call, declared, all_needed):
    """Faults of a method that returns internal states, or their rates, by name."""
    try:
        found = jax.eval_shape(lambda: {name: jnp.asarray(value, float) for name, value in call().items()})
    except Exception as error:  # noqa: BLE001 - the user's own code
        return [f"{what} cannot be evaluated: {explain_error(error)}"]
    faults = [f"{what} gives {name!r}, which is no internal state" for name in found if name not in declared]
    if all_needed:
        faults += [f"{what} lacks the internal state {name!r}" for name in declared if name not in found]
    for name, one in declared.items():
        if name in found and found[name].shape not in (one.shape, () if not all_needed else one.shape):
            faults.append(f"{what}: {name!r} has shape {found[name].shape}, not {one.shape}")
    return faults
