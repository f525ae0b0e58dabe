"""Branches of states: their signs, and states along a coordinate on one branch."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import distinct_names, place_of
from ..constraints._constraints import jacobian
from ..constraints._host_rows import runs_on_host
from ..constraints._saddle_operator import stop_gradients
from ..errors import ModelError, warn
from ..kinematics._configuration import configuration
from ..kinematics._poses import node_parameters
from ..model._changes import with_changes
from ..model._entry_points import check_state
from ..model._system import System
from ..runtime import as_array, jit
from ..typing import ArrayLike
from ._assembled_state import close_state
from ._branch_following import first_branch_point, follow_branch
from ._branches import branch_signs
from ._cut_joints import with_cut_values as holding
from ._named_values import coordinate_mask, parse_request, velocity_columns
from ._state import State, make_state


def branch(system: System, state: State, held: Sequence[str] = ()) -> Float[Array, "... blocks"]:
    """The branch on which the loops are closed: -1 or 1 for each block of coupled loops, 0 at a singular pose.

    It is the sign of the determinant of the rows' Jacobian in the coordinates that depend on the held ones.  States
    with the same coordinates held that differ in a sign are on different branches: a motion between them passes a
    dead point.  A loop that is determined once those before it are is a block of its own, and closes in two ways if
    it is plane; of loops that are coupled both ways, or of several degrees in space, more than two branches share
    the two signs.  A tree has no block.  The sign is 0 too where what is redundant turns with the pose (three
    parallel cranks, spatial loops that move by their proportions alone), so that it has none.

    Args:
        state: a State of this system, or several with leading axes, as those of a motion.
        held: joints whose coordinates are given, the crank in `State.at(system, crank=0.3)`; what they lack of the
            freedoms is completed from the independent columns.

    Raises: UnknownNameError; ModelError for the state of another system.
    """
    check_state(system, state)
    return _branch_of_states(system, state, velocity_columns(system.topology, _joint_names(system, held)))


def states_along(
    system: System,
    joint: str,
    values: ArrayLike,
    start: State,
    *,
    held: Sequence[str] = (),
    velocities: dict[str, Any] | None = None,
) -> State:
    """States at values of one joint's coordinate, all on the branch of a state: a whole turn of a crank.

    Each is followed from the one before, the first from `start`, in as many steps as keep the branch.  Derivatives by
    parameters of the system, values and velocities are exact; `start` is a constant to them.  Where the branch ends
    (a value that cannot be reached, a dead point) the states from there on are NaN and not `ok`, with a warning
    outside of tracing; so is a change of the branch's sign, where branches cross.

    Args:
        joint: with one coordinate, in the tree or cut.
        values: (n,) [rad or m], in the order in which they are gone through.
        start: a closed state of the system; its time is that of all.
        held: other joints that stay at their coordinates in `start`.
        velocities: joint name -> velocity, held in each of the states.

    Returns: a State with a leading axis (n,).

    Raises: ModelError for names, sizes or values that do not fit, UnknownNameError.
    """
    check_state(system, start)
    values = as_array(values)
    faults = [] if values.ndim == 1 else [f"states_along: values of {joint!r} must be (n,), got shape {values.shape}"]
    faults += [f"states_along: start must be one state, got {start.t.shape}"] if start.t.shape else []
    if faults:
        raise ModelError(faults)
    here = system.coordinates(start)
    fixed = {name: here[name] for name in _joint_names(system, held) if name in here and name != joint}
    asked = parse_request(system, {**fixed, joint: values[0] if len(values) else 0.0}, velocities, None, start.t)
    psi, u, t = (jnp.asarray(x, values.dtype) for x in asked.numbers[:3])
    begin = first_branch_point(start.coordinates.astype(values.dtype), t, len(u))
    states = make_state(system, _states_on_branch(system, joint, values, psi, u, begin, asked.held, asked.held_rates))
    if runs_on_host(states):
        _warn_about_branch(joint, values, states)
    return states


@jit(compile="tape")
def _states_on_branch(system, joint, values, psi, u, begin, columns, rate_columns):
    """Assembled states at each of the values, followed from one to the next."""
    top = system.topology
    record = top.joints[top.joint_index[joint]]

    def target(psi, value):
        cuts = {joint: value} if record.is_cut else {}
        return cuts, psi if cuts else psi.at[record.first_coordinate].set(value)

    fixed, P, goal, begin, stops = stop_gradients((system, node_parameters(system), psi, begin, values))

    def step(place, value):
        cuts, psi = target(goal, value)
        place, _ = follow_branch(holding(fixed, cuts) if cuts else fixed, P, place, psi, begin.t, columns)
        return place, place.psi

    found = lax.scan(step, begin, stops)[1]

    def close(value, found):
        cuts, here = target(psi, value)
        here = jnp.where(coordinate_mask(top, columns), here, found)
        return close_state(system, here, u, begin.t, columns, rate_columns, cuts, search=False)

    return jax.vmap(close)(values, found)


@jit(compile="tape")
def _branch_of_states(system, states, columns):
    def signs(state):
        here = with_changes(system, state)
        at = configuration(here, node_parameters(here), state.coordinates, state.t, inertias=False)
        return branch_signs(here, jacobian(here, at), columns)

    for _ in states.t.shape:
        signs = jax.vmap(signs)
    return signs(states)


def _joint_names(system, held):
    """Names of joints of the system, one or several.  Raises: UnknownNameError."""
    names = distinct_names("held", [held] if isinstance(held, str) else held)
    for name in names:
        place_of("joint", name, system.topology.joint_names)
    return list(names)


def _warn_about_branch(joint, values, states):
    """Warn where the branch ends or its sign changes."""
    ok, values, signs = np.asarray(states.ok), np.asarray(values), np.asarray(states.branch)
    if not np.all(ok):
        k = int(np.argmin(ok))
        text = "the branch ends before {}; from there on the states are NaN"
    elif np.any(signs != signs[:1]):
        k = int(np.argmax(np.any(signs != signs[:1], axis=1)))
        text = "the branch's sign changes at {}: branches cross there"
    else:
        return
    place = f"{joint} = {values[k]:.6g} (state {k} of {len(values)})"
    warn(f"states_along: {text.format(place)}")
