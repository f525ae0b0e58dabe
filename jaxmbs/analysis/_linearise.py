"""Linear equations of small motions about a state, at rest or in steady motion, on independent coordinates.

`M dphi'' + C dphi' + K dphi = efforts`, and the state space for chosen inputs and outputs.
"""

import dataclasses
from collections.abc import Callable, Iterable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..assembly._state import State
from ..blocks import StateSpace
from ..checks import distinct_names, require_numbers
from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._kic import independent_columns, motion_map, position_map, velocity_map
from ..constraints._mobility import nan_unless_determined, with_mobility_at
from ..dynamics._newton_euler import forward_dynamics, required_efforts
from ..dynamics.paper._ports import projected_resistance_field
from ..errors import ModelError
from ..flexible._stiffening import squared_spins, stiffening_errors, warn_of_stiffening
from ..friction._joint_friction import without_friction
from ..kinematics._configuration import at_state, configuration, node_accelerations, with_velocities
from ..kinematics._poses import coordinate_rate
from ..linear._transfer import TransferFunctions
from ..math import _square as square
from ..math._linalg import full_rank_lstsq
from ..model._changes import with_changes
from ..model._entry_points import check_single_state
from ..model._internal_states import InternalStates, replace_field
from ..model._rows import drives
from ..model._system import System
from ..runtime import jit
from ..signal_flow._internal_states import internal_rates
from ..signal_flow._sampling import refuse_sampled
from ..signal_flow._signals import with_inputs
from ..typing import ArrayLike, CoordinateLike
from ..vibration._system_analysis import frequency_response as response_by_names
from ._friction_slopes import friction_slopes, loads_with_friction, nan_at_stick, refuse_stick
from ._linearisation import Linearisation
from ._named_outputs import (
    LoadOutputs,
    NamedOutputs,
    check_inputs_and_outputs,
    number_repeats,
    output_names,
    with_loads,
)
from ._release_drives import release_drives


def linearise(
    system: System,
    state: State,
    inputs: Iterable[str] = (),
    outputs: Iterable[str] | Callable = (),
    loads: Iterable[str] = (),
) -> Linearisation:
    """Linear equations about a state.

    Args:
        inputs: joint names: the effort on a free joint's coordinates [N, N m], or the acceleration of a driven
            joint's coordinate: the drive is then released and its position and speed join the state, so that
            transmissibilities follow by division by its own output.  Or fields of force elements and blocks that are
            functions of time, "motor.voltage", "loop.target": a number added to their values.
        outputs: joint names, for their coordinates; measures, blocks and internal states, for their signals; or one
            function `f(state, accelerations (nv,)) -> (m,)`.
        loads: joint names, for the force and moment on the child in the joint's axes: six more outputs of each.

    Returns: a Linearisation about the motion through the state; K and C hold its accelerations fixed, and have the
    slopes of the friction of joints with those of its loads.  It is on the freedoms of the state asked, where these
    are others than those counted at build; within a trace, where shapes are those of the build, it is NaN there and
    `ok` False: build with a pose of use, `build(guess=...)`.

    Raises: UnknownNameError; ModelError for drives that cannot be released, for joints whose friction sticks, by
    name (within a trace the result is NaN), and for driven inputs beside friction.  Source: S2 (42), (68)-(74).
    """
    check_single_state(system, state)
    refuse_sampled(system, "linearise")
    system = with_changes(system, state)
    inputs, loads = distinct_names("inputs", inputs), distinct_names("loads", loads)
    outputs = outputs if callable(outputs) else distinct_names("outputs", outputs)
    fields = check_inputs_and_outputs(system, inputs, () if callable(outputs) else outputs)
    system = with_mobility_at(system, state)
    driven = tuple(name for name in inputs if name in _drive_names(system))
    if system.friction is not None:
        refuse_stick(system, state, driven)
    accelerations = forward_dynamics(system, state)[0]
    system = release_drives(system, driven, state)
    outputs = outputs if callable(outputs) else NamedOutputs.of(system, outputs)
    outputs = with_loads(system, outputs, loads)
    found = _linearise(system, state, accelerations, inputs, driven, outputs, fields)
    warn_of_stiffening(found.stiffening)
    found = nan_unless_determined(system, state, found)
    found = found if system.friction is None else nan_at_stick(system, state, found)
    names, position_names = (column_names(system.topology, x) for x in (found.velocities, found.positions))
    internal = tuple(entry for record in system.topology.internal for entry in record.entries)
    columns = tuple(number_repeats(_input_of_columns(system, inputs)))
    rows = output_names(system, outputs, len(found.state_space.C))
    return dataclasses.replace(
        found,
        names=names,
        position_names=position_names,
        internal_names=internal,
        input_names=columns,
        output_names=rows,
    )


def column_names(topology, columns):
    """Names of velocities: that of the joint, with its label where the joint has several."""
    names = {}
    for joint in topology.joints:
        own = range(joint.velocities.start, joint.velocities.stop)
        labels = _velocity_labels(joint.labels, [topology.node_kind[k] for k in own])
        names |= {k: joint.name if len(own) == 1 else f"{joint.name} {d}" for k, d in zip(own, labels, strict=True)}
    return tuple(names.get(k, str(k)) for k in columns)


def _velocity_labels(labels, kinds):
    """Labels of a joint's velocities: those of its coordinates, rx ry rz for the four numbers of a quaternion."""
    found, rest = [], list(labels)
    for k, kind in enumerate(kinds):
        if kind != "ball":
            found.append(rest.pop(0) if rest else str(k))
        elif kinds[:k].count("ball") % 3 == 0:
            found, rest = [*found, "rx", "ry", "rz"], rest[4:]
    return found


def _drive_names(system):
    return {row.name for row in drives(system.rows)}


def unbalanced_efforts(system: System, at, w, a, move=None):
    """`I* a + ... - Q` (N,): efforts that the independent velocities w need for accelerations a; zero in a motion.

    Also returns all velocities (nv,) and accelerations (nv,).  Args: move: `motion_map` where it is known.
    """
    at = closures.with_directions(system, at)
    move, none = motion_map(system, at) if move is None else move, jnp.zeros(system.topology.num_rows, w.dtype)
    u = move(w, -constraints.time_rate(system, at))
    here = with_velocities(system, at, u)
    unmoved = node_accelerations(system.topology, here, jnp.zeros_like(u))
    u_dot = move(a, constraints.acceleration_bias(system, here, unmoved))
    V_dot, loads = node_accelerations(system.topology, here, u_dot), loads_with_friction(system, here)
    need = required_efforts(system, here, V_dot, u_dot, loads)
    return jax.linear_transpose(lambda w: move(w, none), w)(need)[0], u, u_dot


@jit
def _linearise(system, state, accelerations, inputs, driven, outputs, fields):
    psi, t, at = state.coordinates, state.t, at_state(system, state, inertias=False)
    top, chosen = system.topology, independent_columns(system)
    w, a = state.velocities[chosen], accelerations[chosen]
    Gamma = velocity_map(system, at)[0]
    Z = position_map(system, at) if top.slip_rows else Gamma

    def everything(psi, w, a, s, added=None):
        here = system if added is None else with_inputs(system, dict(zip(fields, added, strict=True)), False)
        moved = configuration(here, at.P, psi, t, internal=s)
        need, u, u_dot = unbalanced_efforts(here, moved, w, a)
        internal = None if s is None else InternalStates(s, top.internal)
        there = State(t, psi, u, structure=top.structure, internal=internal)
        if isinstance(outputs, LoadOutputs):
            output = outputs.at(here, moved, there, u_dot)
        else:
            named = isinstance(outputs, NamedOutputs)
            asked = there if named else replace_field(there, "changes", state.changes)
            output = outputs.at(here, moved, there) if named else outputs(asked, u_dot)
        rates = None if s is None else internal_rates(here, with_velocities(here, moved, u))
        return (need, coordinate_rate(top, psi, u), output), rates

    s = None if state.internal is None else state.internal.values
    ((_, psi_dot, _), _), slopes = jax.linearize(everything, psi, w, a, s)
    # directions: positions, velocities, accelerations, internal states
    ends, number = np.cumsum([Z.shape[1], len(chosen), len(chosen)]), top.num_internal
    eye = np.eye(ends[2] + number, dtype=psi.dtype)
    moved = jax.vmap(lambda z: coordinate_rate(top, psi, z), 1, 1)(Z) @ eye[: ends[0]]
    w_moved, a_moved, s_moved = (jnp.asarray(part) for part in np.split(eye, ends)[1:])
    found, rates = jax.vmap(slopes, 1, 1)(moved, w_moved, a_moved, s_moved if number else None)
    split = ends if number else ends[:2]
    (K, C, M, *F), (drift, flow, *_), (y_psi, y_w, y_a, *y_s) = (jnp.split(part, split, axis=1) for part in found)
    positions = independent_positions(system)
    upper = _position_rates(top, psi, Z, psi_dot, drift, flow)[positions]
    by_field = _slopes_by_fields(everything, (psi, w, a, s), len(fields)) if fields else None
    efforts_by = {} if by_field is None else dict(zip(fields, -by_field[0].T, strict=True))
    KC = jnp.concatenate([K, C, *F], axis=1)
    by_effort, rubs = Gamma.T, 0.0
    if system.friction is not None:
        rubs, more = friction_slopes(system, at_state(system, state), state.velocities, Gamma)
        by_effort = by_effort + more
    lower, B = _acceleration_matrices(system, by_effort, M, KC, inputs, driven, efforts_by)
    space = StateSpace(
        A=jnp.concatenate([upper, lower]) if rates is None else _with_internal_rows(upper, lower, rates, ends),
        B=jnp.concatenate([jnp.zeros((len(positions), B.shape[1]), B.dtype), B]),
        C=jnp.concatenate([y_psi, y_w, *y_s], axis=1) + y_a @ lower,
        D=y_a @ B,
    )
    if number:
        rows = jnp.concatenate([space.B, jnp.zeros((number, B.shape[1]), B.dtype)])
        space = StateSpace(space.A, rows, space.C, space.D)
    if by_field is not None:
        space = _with_direct_parts(space, *by_field[1:], np.isin(_input_of_columns(system, inputs), fields))
    system = without_friction(system)
    R = projected_resistance_field(system, at, Gamma, state.velocities) + rubs
    columns = tuple(int(k) for k in positions), tuple(int(k) for k in chosen)
    still = (
        stiffening_errors(system, squared_spins(system, with_velocities(system, at, state.velocities)))
        if system.elastic
        else {}
    )
    return Linearisation(M, C, C - R, K, space, *columns, stiffening=still)


def _slopes_by_fields(everything, point, number):
    """Slopes of efforts (N, k), outputs (m, k) and rates of internal states (ns, k) or None by k added values."""
    eye = jnp.eye(number, dtype=point[0].dtype)
    slopes = jax.linearize(lambda added: everything(*point, added), jnp.zeros_like(eye[0]))[1]
    (need, _, output), rates = jax.vmap(slopes, 1, 1)(eye)
    return need, output, rates


def _with_direct_parts(space, output, rates, is_field):
    """A state space with the slopes of outputs and rates of internal states by the inputs that are fields."""
    B, D, columns = space.B, space.D, np.flatnonzero(is_field)
    D = D.at[:, columns].add(output)
    if rates is not None:
        B = B.at[len(B) - len(rates) :, columns].add(rates)
    return StateSpace(space.A, B, space.C, D)


def _with_internal_rows(upper, lower, rates, ends):
    """A from the rates of positions (n, n + N), velocities (N, n + N + ns) and, along all directions, of internal
    states (ns, n + 2 N + ns), which no acceleration changes."""
    of_positions, of_velocities, _, own = jnp.split(rates, ends, axis=1)
    upper = jnp.concatenate([upper, jnp.zeros((len(upper), len(rates)), upper.dtype)], axis=1)
    return jnp.concatenate([upper, lower, jnp.concatenate([of_positions, of_velocities, own], axis=1)])


def _position_rates(top, psi, Z, psi_dot, drift, flow):
    """Rates (nv, n + N) of the displacements of all columns: `psi_dot` less what fixed displacements turn with."""
    if top.is_simple:
        return jnp.concatenate([drift, flow], axis=1)
    resting = jax.vmap(lambda z: _rate_of_step(top, psi, z, psi_dot), 1, 1)(Z)
    T = jax.vmap(lambda z: coordinate_rate(top, psi, z), 1, 1)(jnp.eye(top.num_velocities, dtype=psi.dtype))
    return full_rank_lstsq(T, jnp.concatenate([drift - resting, flow], axis=1))


def independent_positions(system: System) -> np.ndarray:
    """Columns of the independent coordinates (static)."""
    top = system.topology
    if top.analysis is None or not top.slip_rows:
        return independent_columns(system)
    return np.asarray(top.analysis.independent_positions, int)


def _rate_of_step(top, psi, z, psi_dot):
    """Rate of `T(psi) z` along the motion at fixed z: zero but for quaternions."""
    return jax.jvp(lambda q: coordinate_rate(top, q, z), (psi,), (psi_dot,))[1]


def _acceleration_matrices(system, by_effort, M, KC, inputs, driven, efforts_by):
    """Accelerations (N, n + N) per state and (N, m) per input; driven velocities take theirs from the input.

    Args: by_effort: efforts (N, nv) of units of efforts on all columns; efforts_by: (N,) of a unit of each input that
    is a field.
    """
    top, chosen, columns = system.topology, list(independent_columns(system)), []
    prescribed = np.zeros(len(chosen), bool)
    for name in inputs:
        if name in efforts_by:
            columns.append(efforts_by[name][:, None])
            continue
        joint = top.joints[top.joint_index[name]].velocities
        if name in driven:
            prescribed[chosen.index(joint.start)] = True
            columns.append(jnp.asarray(np.eye(len(chosen))[:, [chosen.index(joint.start)]], M.dtype))
        else:
            columns.append(by_effort[:, joint])
    right = jnp.concatenate([jnp.zeros((len(chosen), 0), M.dtype), *columns], axis=1)
    rows = jnp.asarray(prescribed)[:, None]
    left = jnp.where(rows, jnp.eye(len(chosen), dtype=M.dtype), M)
    if efforts_by:
        is_field = np.isin(_input_of_columns(system, inputs), list(efforts_by))
        right = jnp.where(rows & is_field[None], 0.0, right)
    solved = square.solve(left, jnp.concatenate([jnp.where(rows, 0.0, -KC), right], axis=1))
    return solved[:, : KC.shape[1]], solved[:, KC.shape[1] :]


def _input_of_columns(system, inputs):
    """The name of the input of every column."""
    top = system.topology
    sizes = [top.joints[top.joint_index[n]].num_velocities if n in top.joint_index else 1 for n in inputs]
    return np.repeat(np.asarray(inputs), sizes)


def frequency_response(
    space: StateSpace | Linearisation,
    omega: ArrayLike,
    into: Iterable[CoordinateLike] | None = None,
    out: Iterable[CoordinateLike] | None = None,
) -> Array | TransferFunctions:
    """Transfer matrices (..., outputs, inputs) of a linearised mechanism at angular frequencies omega (...,) [rad/s].

    Args: into, out: names of joints, in place of the inputs and outputs of `linearise`; the answer of the
    Linearisation's `system`, labelled `TransferFunctions`, in m or rad for unit efforts.

    Raises: UnknownNameError; ModelError for one of `into`, `out` without the other.
    """
    require_numbers(omega=omega)
    if into is not None and out is not None and isinstance(space, Linearisation):
        return response_by_names(space.system, omega, into, out)
    if into is not None or out is not None:
        raise ModelError(["give `into` and `out` both, with a Linearisation: a bare StateSpace has no names"])
    space = space.state_space if isinstance(space, Linearisation) else space
    eye = jnp.eye(space.A.shape[0], dtype=space.A.dtype)
    A, B, C, D = (jax.lax.complex(x, jnp.zeros_like(x)) for x in space)

    def at(w):
        return C @ square.solve(jax.lax.complex(jnp.zeros_like(eye), w * eye) - A, B) + D

    return jnp.vectorize(at, signature="()->(m,k)")(jnp.asarray(omega, float))
