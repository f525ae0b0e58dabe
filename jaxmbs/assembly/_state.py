"""`State`: time, coordinates and velocities of a mechanism, and the assembly of one that closes all loops."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..constraints._host_rows import runs_on_host
from ..constraints._mobility import count_mobility
from ..errors import AssemblyError, ModelError, warn
from ..model._changes import Changes
from ..model._entry_points import check_state, check_system
from ..model._internal_states import InternalStates
from ..model._system import AbstractState, System
from ..model._topology import Topology
from ..quantities import Quantity
from ..reports import Report, Reported, failures
from ..runtime import as_array
from ..signal_flow._internal_states import with_start
from ..typing import ArrayLike, WordedError
from ._assembled_state import AssembledState, check_closed, find_in_trace, find_on_branch, find_on_host
from ._branch_following import first_branch_point
from ._levenberg_marquardt import CLOSED_RESIDUAL
from ._named_values import StateRequest, parse_request
from ._state_report import state_quantities


class State(Reported, AbstractState):
    """Time t () [s], coordinates (nq,) and velocities (nv,) of the tree's joints; leading axes for a motion.

    `residual` () is the largest residual of assembly over the rows of positions [m, rad] and velocities [m/s, rad/s],
    without derivative; zero for a state made by hand.  In a batch of designs `ok` is True for those that were
    assembled.
    `rank_change` () is the rank of the constraint rows at this pose less that counted by `build`: where it is not
    zero the mechanism has other freedoms here than those of `system.topology`; zero by hand and along a motion;
    without derivative (a float, so that a State can be differentiated by).
    `structure` is the layout of the system that it was made for, which the public functions check; None by hand.
    `branch` (blocks,) is the sign of the branch on which each block of coupled loops is closed, see
    `assembly.branch`, with the coordinates held that `at` was given; 0 at a singular pose or where nothing was
    assembled.  It is empty for trees, states by hand and those of motions.
    `internal` are the internal states of force elements by name, `state.internal["boom.p0"]`; None without such.
    `changes` are the numbers of the mechanism that events of its motion have changed by then (`Event(system=)`); None
    without such events.  Functions of a system and this state take them in place of those of the system.

    Raises: ValueError for shapes that do not belong together, TypeError for what are no real numbers.
    """

    t: Float[Array, "..."]
    coordinates: Float[Array, "... nq"]
    velocities: Float[Array, "... nv"]
    residual: Float[Array, "..."]
    structure: tuple | None = eqx.field(static=True)
    rank_change: Float[Array, "..."]
    branch: Float[Array, "... blocks"]
    internal: InternalStates | None
    changes: Changes | None

    def __init__(
        self,
        t: ArrayLike,
        coordinates: ArrayLike,
        velocities: ArrayLike,
        residual: Array | None = None,
        structure: tuple | None = None,
        rank_change: Array | None = None,
        branch: Array | None = None,
        internal: InternalStates | None = None,
        changes: Changes | None = None,
    ) -> None:
        parts = {"t": t, "coordinates": coordinates, "velocities": velocities}
        self.t, self.coordinates, self.velocities = (_as_floats(name, x) for name, x in parts.items())
        leading = self.t.shape
        if not leading == self.coordinates.shape[:-1] == self.velocities.shape[:-1] or not self.coordinates.ndim:
            shapes = ", ".join(f"{name} {getattr(self, name).shape}" for name in parts)
            raise ValueError(
                "a State has a time (), coordinates (nq,) and velocities (nv,), or all of them with the same leading "
                f"axes; got {shapes}"
            )
        self.residual = jnp.zeros_like(self.t) if residual is None else residual
        self.structure = structure
        self.rank_change = jnp.zeros_like(self.t) if rank_change is None else rank_change
        self.branch = as_array(np.zeros((*leading, 0), self.t.dtype), None) if branch is None else branch
        self.internal = internal
        self.changes = changes

    def report(self) -> Report:
        return Report(
            [*([Quantity("t", self.t, "s")] if self.t.ndim == 0 else []), *state_quantities(self)],
            fault=failures(self.ok, "not assembled"),
            t=self.t,
        )

    @property
    def ok(self) -> jax.Array:
        """True where the loops are closed and all numbers are finite (traceable)."""
        finite = [jnp.all(jnp.isfinite(x), axis=-1) for x in (self.coordinates, self.velocities)]
        found = (self.residual <= CLOSED_RESIDUAL[self.coordinates.dtype.itemsize]) & finite[0] & finite[1]
        return found if self.internal is None else found & self.internal.ok

    def topology_at(self, system: System) -> Topology:
        """The topology of a system with the mobility counted at this state.

        Raises: as `constraints.count_mobility`.
        """
        return dataclasses.replace(system.topology, analysis=count_mobility(system, self))

    @classmethod
    def at(
        cls,
        system: System,
        values: Mapping[str, Any] | None = None,
        velocities: Mapping[str, Any] | None = None,
        guess: Mapping[str, Any] | None = None,
        t: ArrayLike | None = None,
        near: "State | None" = None,
        internal: WordedError[Mapping[str, Any] | None] = None,
        **named: Any,
    ) -> "State":
        """The assembled state in which the named joint coordinates and velocities have the given values.

        Where the loops can close in several ways, `guess` only sets where the search begins; `near` stays on the
        branch of a state.

        Args:
            values: joint name -> coordinate (several-freedom joints: an array; a ball: its quaternion w, x, y, z);
                keywords serve as well, `State.at(system, crank=0.3)`.  These are held, all others are solved for;
                so is the one coordinate of a joint that was cut, in the place where the loop closes.
            velocities: joint name -> velocity, held; other velocities take the least that closes the loops.
            guess: joint name -> coordinate to start the search from (default: of driven joints the values of
                their drives, of others the guess of the model, else zero).
            t: time [s], for driven joints (default: that of `near`, else zero).
            near: a state whose branch is followed, without a search, while given coordinates and time go linearly
                from its values to the requested ones; a constant to derivatives.
            internal: name -> internal state of a force element, `{"boom.p0": 2e6}` (default: as its law starts).

        Raises:
            ModelError: unknown names, wrong sizes, velocities of a joint that was cut or several coordinates of one,
                `guess` beside `near` (all in one report); `near` of another system; internal states that start at
                values, or have rates there, that are not finite.
            AssemblyError: the loops cannot be closed there; names the joints and what remains open, or how far the
                branch of `near` goes.  Inside of tracing (a batch, a gradient) nothing is raised: coordinates and
                velocities are NaN there, and all that follows from them; `residual` says how far open the loops are.
        """
        check_system(system)
        if near is not None:
            _check_near(system, near, guess)
        if t is None:
            t = 0.0 if near is None else near.t
        asked = parse_request(system, {**(values or {}), **named}, velocities, guess, t, internal)
        if near is not None:
            return _state_on_branch(asked, near)
        if runs_on_host(system, *asked.numbers):
            return make_state(system, find_on_host(asked), asked.internal)
        return make_state(system, find_in_trace(asked), asked.internal)


def make_state(system: System, found: AssembledState, internal: Mapping[str, Any] | None = None) -> State:
    """The `State` of an assembled state, with a warning where the rank of the rows differs from the build.

    Args: internal: checked internal states by name; the others are as their laws start.
    """
    parts = found.t, found.coordinates, found.velocities, jax.lax.stop_gradient(found.residual)
    t, psi, u, residual, change, signs = (as_array(x, None) for x in (*parts, found.rank_change, found.branch))
    state = State(t, psi, u, residual, system.topology.structure, change, signs)
    if system.topology.internal:
        state = with_start(system, state, internal or {})
    if runs_on_host(state) and state.t.ndim == 0 and int(state.rank_change):
        _warn_about_rank(system.topology, int(state.rank_change))
    return state


def _warn_about_rank(top, change):
    """Warn that the mechanism has another mobility at this pose than at that of its build."""
    counted, here = top.mobility, top.mobility - change
    hint = "the pose is singular" if change < 0 else "give a pose of use, build(guess=...), to count there"
    text = f"state: the mechanism has mobility {here} at this pose, and {counted} at the pose that build() counted at"
    warn(f"{text}; {hint}")


def _check_near(system, near, guess):
    """Raises: TypeError, ModelError unless `near` is one state of the system, without a guess beside it."""
    if not isinstance(near, State):
        hint = '; values of a joint called "near" go into State.at(system, {"near": ...})'
        raise TypeError(f"near= takes a State, as State.at(system, ...) makes it, not a {type(near).__name__}{hint}")
    check_state(system, near)
    faults = []
    if near.t.shape:
        faults.append(f"near= takes one state, got {near.t.shape} of them: jax.vmap takes several")
    if guess:
        faults.append("near= determines the branch, so that guess= has no effect: give one of the two")
    if faults:
        raise ModelError(faults)


def _state_on_branch(asked: StateRequest, near: State) -> State:
    """The state asked for on the branch of `near`."""
    system, dtype = asked.system, asked.coordinates.dtype
    psi, u, t = (jnp.asarray(x, dtype) for x in asked.numbers[:3])
    start = first_branch_point(near.coordinates.astype(dtype), near.t.astype(dtype), len(u))
    found, share, _ = find_on_branch(system, psi, u, t, start, asked.held, asked.held_rates, asked.cuts)
    if runs_on_host(found, share):
        if not share >= 1.0:
            raise AssemblyError(_branch_end_message(asked, near, float(share)))
        rows = len(system.topology.position_rows)
        check_closed(system, np.asarray(found.open)[len(found.open) - rows :], np.asarray(found.open_rates))
    return make_state(system, found, asked.internal)


def _branch_end_message(asked, near, share):
    """Message for a branch that ends before the requested values."""
    at = []
    for joint in asked.system.topology.joints:
        if joint.num_velocities == 1 and joint.first_velocity in asked.held:
            here, there = (float(x[joint.first_coordinate]) for x in (near.coordinates, asked.coordinates))
            at.append(f"{joint.name} = {here + share * (there - here):.6g}")
    if float(near.t) != float(asked.t):
        at.append(f"t = {float(near.t) + share * (float(asked.t) - float(near.t)):.6g}")
    where = f" at {', '.join(at)}" if at else ""
    return (
        f"the branch of near= ends{where}, {share:.3g} of the way to the requested values: the loops lock there; ask "
        "for values before that, give other coordinates, or search for another branch by guess="
    )


@runtime_checkable
class HasStates(Protocol):
    """An object with states at several times, as a `Motion`."""

    @property
    def states(self) -> State: ...


def _as_floats(name, x):
    """An array of floats; one that is none yet, or of whole numbers, is made one.  Raises: TypeError."""
    if isinstance(x, jax.Array) and jnp.issubdtype(x.dtype, jnp.floating):
        return x
    try:
        return as_array(x)
    except (TypeError, ValueError) as error:
        raise TypeError(f"the {name} of a State are no real numbers: {error}") from error
