"""The state of a system at a time, and how to get one that closes all loops."""

import dataclasses
import warnings
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import AssemblyError, ModelError
from ..model._entry_points import check_fits, check_system
from ..model._system import System
from ..model._topology import Topology
from ..runtime import as_array
from ..typing import ArrayLike
from ._assembled_state import CLOSED, Found, check_closed, found_along, found_in_trace, found_on_host
from ._continuation import at_rest
from ._host_rows import on_host
from ._mobility import count_mobility
from ._named_values import Request, request


class State(eqx.Module):
    """Time t () [s], coordinates (nq,) and velocities (nv,) of the tree's joints; leading axes for a motion.

    `residual` () is what assembly left open, the largest over the rows of positions [m, rad] and velocities [m/s,
    rad/s], without derivative; zero for a state written down by hand.  In a batch of designs `ok` says which of them
    were assembled.
    `rank_change` () is the rank of the constraint rows at this pose less that counted by `build`: where it is not
    zero the mechanism has other freedoms here than those of `system.topology`; zero by hand and along a motion;
    without derivative (a float, so that a State can be differentiated by).
    `structure` is the layout of the system that it was made for, of which the public functions ask; None by hand.
    `branch` (blocks,) is the sign of the branch on which each block of coupled loops is closed, see
    `kinematics.branch`, with the coordinates held that `at` was given; 0 at a singular pose or where nothing was
    assembled.  It is empty for trees, states by hand and those of motions.

    Raises: ValueError for shapes that do not belong together, TypeError for what are no real numbers.
    """

    t: Float[Array, "..."]
    coordinates: Float[Array, "... nq"]
    velocities: Float[Array, "... nv"]
    residual: Float[Array, "..."]
    structure: tuple | None = eqx.field(static=True)
    rank_change: Float[Array, "..."]
    branch: Float[Array, "... blocks"]

    def __init__(
        self,
        t: ArrayLike,
        coordinates: ArrayLike,
        velocities: ArrayLike,
        residual: Array | None = None,
        structure: tuple | None = None,
        rank_change: Array | None = None,
        branch: Array | None = None,
    ) -> None:
        parts = {"t": t, "coordinates": coordinates, "velocities": velocities}
        self.t, self.coordinates, self.velocities = (_floats(name, x) for name, x in parts.items())
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

    @property
    def ok(self) -> jax.Array:
        """Whether the loops are closed and the numbers finite (traceable)."""
        finite = [jnp.all(jnp.isfinite(x), axis=-1) for x in (self.coordinates, self.velocities)]
        return (self.residual <= CLOSED[self.coordinates.dtype.itemsize]) & finite[0] & finite[1]

    def topology_at(self, system: System) -> Topology:
        """The topology of a system with the mobility counted at this state.

        Raises: as `kinematics.count_mobility`.
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
        **named: Any,
    ) -> "State":
        """The assembled state in which the named joint coordinates and velocities have the given values.

        Where the loops can close in several ways, `guess` says near which of them the search begins, but promises
        none; `near` stays on the branch of a state.

        Args:
            values: joint name -> coordinate (several-freedom joints: an array; a ball: its quaternion w, x, y, z);
                keywords serve as well, `State.at(system, crank=0.3)`.  These are held, all others are solved for;
                so is the one coordinate of a joint that was cut, in the place where the loop closes.
            velocities: joint name -> velocity, held; other velocities take the least that closes the loops.
            guess: joint name -> coordinate to start the search from (default: of driven joints what their drives ask
                for at the time, of others the guess of the model, else zero).
            t: time [s], for driven joints (default: that of `near`, else zero).
            near: a state whose branch is followed, without a search, while held coordinates and time go from its
                values to those asked for, the straight way; a constant to derivatives.

        Raises:
            ModelError: unknown names, wrong sizes, velocities of a joint that was cut or several coordinates of one,
                `guess` beside `near` (all in one report); `near` of another system.
            AssemblyError: the loops cannot be closed there; names the joints and what remains open, or how far the
                branch of `near` goes.  Inside of tracing (a batch, a gradient) nothing is raised: coordinates and
                velocities are NaN there, and all that follows from them; `residual` says how far open the loops are.
        """
        check_system(system)
        if near is not None:
            _check_near(system, near, guess)
        if t is None:
            t = 0.0 if near is None else near.t
        asked = request(system, {**(values or {}), **named}, velocities, guess, t)
        if near is not None:
            return _along(asked, near)
        if on_host(system, *asked.numbers):
            return made(system, found_on_host(asked))
        return made(system, found_in_trace(asked))


def made(system: System, found: Found) -> State:
    """The state of what was found."""
    parts = found.t, found.coordinates, found.velocities, jax.lax.stop_gradient(found.residual)
    t, psi, u, residual, change, signs = (as_array(x, None) for x in (*parts, found.rank_change, found.branch))
    state = State(t, psi, u, residual, system.topology.structure, change, signs)
    if on_host(state) and state.t.ndim == 0 and int(state.rank_change):
        _notice_rank(system.topology, int(state.rank_change))
    return state


def _notice_rank(top, change):
    """A warning: the mechanism has other freedoms at this pose than at the one of its build."""
    counted, here = top.mobility, top.mobility - change
    hint = "the pose is singular" if change < 0 else "give a pose of use, build(guess=...), to count there"
    text = f"state: the mechanism has mobility {here} at this pose, and {counted} at the pose that build() counted at"
    warnings.warn(f"{text}; {hint}", stacklevel=4)


def _check_near(system, near, guess):
    """Raises: TypeError, ModelError unless `near` is one state of the system, without a guess beside it."""
    if not isinstance(near, State):
        hint = '; values of a joint called "near" go into State.at(system, {"near": ...})'
        raise TypeError(f"near= takes a State, as State.at(system, ...) makes it, not a {type(near).__name__}{hint}")
    check_fits(system, near)
    faults = []
    if near.t.shape:
        faults.append(f"near= takes one state, got {near.t.shape} of them: jax.vmap takes several")
    if guess:
        faults.append("near= says where the loops are closed; leave guess= away")
    if faults:
        raise ModelError(faults)


def _along(asked: Request, near: State) -> State:
    """The state asked for on the branch of `near`."""
    system, dtype = asked.system, asked.coordinates.dtype
    psi, u, t = (jnp.asarray(x, dtype) for x in asked.numbers[:3])
    start = at_rest(near.coordinates.astype(dtype), near.t.astype(dtype), len(u))
    found, share, _ = found_along(system, psi, u, t, start, asked.held, asked.held_rates, asked.cuts)
    if on_host(found, share):
        if not share >= 1.0:
            raise AssemblyError(_ended(asked, near, float(share)))
        rows = len(system.topology.position_rows)
        check_closed(system, np.asarray(found.open)[len(found.open) - rows :], np.asarray(found.open_rates))
    return made(system, found)


def _ended(asked, near, share):
    """A sentence for a branch that ends on the way."""
    at = []
    for joint in asked.system.topology.joints:
        if joint.num_velocities == 1 and joint.first_velocity in asked.held:
            here, there = (float(x[joint.first_coordinate]) for x in (near.coordinates, asked.coordinates))
            at.append(f"{joint.name} = {here + share * (there - here):.6g}")
    if float(near.t) != float(asked.t):
        at.append(f"t = {float(near.t) + share * (float(asked.t) - float(near.t)):.6g}")
    where = f" at {', '.join(at)}" if at else ""
    return (
        f"the branch of near= ends{where}, {share:.3g} of the way to the values asked for: the loops lock there; ask "
        "for values before that, hold other coordinates, or search for another branch by guess="
    )


@runtime_checkable
class HasStates(Protocol):
    """What has states at several times, as a `Motion` has."""

    @property
    def states(self) -> State: ...


def _floats(name, x):
    """An array of floats; one that is none yet, or of whole numbers, is made one.  Raises: TypeError."""
    if isinstance(x, jax.Array) and jnp.issubdtype(x.dtype, jnp.floating):
        return x
    try:
        return as_array(x)
    except (TypeError, ValueError) as error:
        raise TypeError(f"the {name} of a State are no real numbers: {error}") from error
