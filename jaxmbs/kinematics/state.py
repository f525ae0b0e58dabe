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

from ..checks import broken
from ..errors import AssemblyError, ModelError
from ..math.host import as_array
from ..model.question import check_system
from ..model.system import System
from ..model.topology import Topology
from ..typing import ArrayLike
from .assembly import assembled
from .cut_joints import held
from .evaluate import is_concrete
from .given_values import free_columns, placed, split_cuts
from .host_assembly import assembled_on_host
from .mobility import count_mobility
from .poses import neutral_coordinates
from .rank import constraint_rank

_TOLERANCE = {8: 1e-8, 4: 1e-3}  # residuals that count as closed, by precision
_RESTARTS = 12  # searches from other guesses before a state counts as impossible


class State(eqx.Module):
    """Time t () [s], coordinates (nq,) and velocities (nv,) of the tree's joints; leading axes for a motion.

    `residual` () is what assembly left open, the largest over the rows of positions [m, rad] and velocities [m/s,
    rad/s], without derivative; zero for a state written down by hand.  In a batch of designs `ok` says which of them
    were assembled.
    `rank_change` () is the rank of the constraint rows at this pose less that counted by `build`: where it is not
    zero the mechanism has other freedoms here than those of `system.topology`; zero by hand and along a motion;
    without derivative (a float, so that a State can be differentiated by).
    `structure` is the layout of the system that it was made for, of which the public functions ask; None by hand.

    Raises: ValueError for shapes that do not belong together, TypeError for what are no real numbers.
    """

    t: Float[Array, "..."]
    coordinates: Float[Array, "... nq"]
    velocities: Float[Array, "... nv"]
    residual: Float[Array, "..."]
    structure: tuple | None = eqx.field(static=True)
    rank_change: Float[Array, "..."]

    def __init__(
        self,
        t: ArrayLike,
        coordinates: ArrayLike,
        velocities: ArrayLike,
        residual: Array | None = None,
        structure: tuple | None = None,
        rank_change: Array | None = None,
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

    @property
    def ok(self) -> jax.Array:
        """Whether the loops are closed and the numbers finite (traceable)."""
        finite = [jnp.all(jnp.isfinite(x), axis=-1) for x in (self.coordinates, self.velocities)]
        return (self.residual <= _TOLERANCE[self.coordinates.dtype.itemsize]) & finite[0] & finite[1]

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
        t: ArrayLike = 0.0,
        **named: Any,
    ) -> "State":
        """The assembled state in which the named joint coordinates and velocities have the given values.

        Args:
            values: joint name -> coordinate (several-freedom joints: an array; a ball: its quaternion w, x, y, z);
                keywords serve as well, `State.at(system, crank=0.3)`.  These are held, all others are solved for;
                so is the one coordinate of a joint that was cut, in the place where the loop closes.
            velocities: joint name -> velocity, held; other velocities take the least that closes the loops.
            guess: joint name -> coordinate to start the search from (default: the guess of the model, else zero).
            t: time [s], for driven joints.

        Raises:
            ModelError: unknown names, wrong sizes, velocities of a joint that was cut or several coordinates of one
                (all in one report).
            AssemblyError: the loops cannot be closed there; names the joints and what remains open.  Inside of
                tracing (a batch, a gradient) nothing is raised: coordinates and velocities are NaN there, and all
                that follows from them; `residual` says how far open the loops are.
        """
        check_system(system)
        values = {**(values or {}), **named}
        top = system.topology
        guess = {**{name: np.squeeze(x) for name, x in top.guess}, **(guess or {})}
        faults: list[str] = []
        precision = jnp.result_type(float)
        (guess, near), (values, wanted) = (split_cuts(system, given, faults) for given in (guess or {}, values))
        psi = placed(top, neutral_coordinates(top).astype(precision), guess, "coordinates", faults)
        psi = placed(top, psi, values, "coordinates", faults)
        u = placed(top, np.zeros(top.num_velocities, precision), velocities or {}, "velocities", faults)
        if np.shape(t) != () or isinstance(t, str) or broken(lambda t: ~np.isfinite(t), t):
            faults.append(f"state: t must be one finite time, got {t!r}")
        if faults:
            raise ModelError(faults)
        free = tuple(free_columns(top, given).astype(precision) for given in (values, velocities or {}))
        if not is_concrete(system, psi, u, t, near, wanted):
            return _traced(system, jnp.asarray(psi), jnp.asarray(u), jnp.asarray(t, float), free, near, wanted)
        t = np.asarray(t, precision)
        if near:
            (psi, _), *_ = _search(held(system, {**near, **wanted}), psi, u, t, free, restart=True)
        if wanted:
            (psi, _), f, *_ = _search(held(system, wanted), psi, u, t, free, restart=not guess)
            _check(held(system, wanted), f, np.zeros(0, precision))
        found, f, g, A = _search(system, psi, u, t, free, restart=not (guess or near or wanted))
        _check(system, f, g)
        largest = max(np.max(np.abs(x), initial=0.0) for x in (f, g))
        change = _rank_change(system, constraint_rank(system, A))
        if change:
            _notice_rank(top, change)
        return State(*(as_array(x, None) for x in (t, *found, largest)), top.structure, as_array(change, float))


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


def _traced(system, psi, u, t, free, near, wanted):
    """The state within a trace, NaN where it is not assembled; times NaN and not `where`, so that derivatives are
    NaN too."""
    free, rows = tuple(map(jnp.asarray, free)), []
    if near:
        psi = jax.lax.stop_gradient(assembled(held(system, {**near, **wanted}), psi, u, t, *free)[0])
    if wanted:
        psi, _, f, *_ = assembled(held(system, wanted), psi, u, t, *free)
        rows.append(f)
    psi, u, f, g, rank = assembled(system, psi, u, t, *free)
    largest = jnp.max(jnp.abs(jnp.concatenate([*rows, f, g])), initial=0.0)
    state = State(t, psi, u, jax.lax.stop_gradient(largest), system.topology.structure)
    factor = jnp.where(state.ok, 1.0, jnp.nan).astype(psi.dtype)
    change = _rank_change(system, rank).astype(psi.dtype)
    return State(t, psi * factor, u * factor, state.residual, state.structure, change)


def _rank_change(system, rank):
    """The rank of the rows less that of the build."""
    return rank - (rank if system.topology.analysis is None else system.topology.analysis.rank)


def _notice_rank(top, change):
    """A warning: the mechanism has other freedoms at this pose than at the one of its build."""
    counted, here = top.mobility, top.mobility - change
    hint = "the pose is singular" if change < 0 else "give a pose of use, build(guess=...), to count there"
    text = f"state: the mechanism has mobility {here} at this pose, and {counted} at the pose that build() counted at"
    warnings.warn(f"{text}; {hint}", stacklevel=3)


def _search(system, psi, u, t, free, restart):
    """Assemble from psi on the host; searches that fail start again from random guesses."""
    if not system.has_constraints:
        none = np.zeros(0, psi.dtype)
        return (psi, u), none, none, np.zeros((0, len(u)), psi.dtype)
    *found, f, g, A = assembled_on_host(system, psi, u, t, *free)
    # one seed: a state is a function of its arguments
    random, simple = np.random.default_rng(0), np.array([k != "ball" for k in system.topology.node_kind])
    columns = np.nonzero(simple)[0]
    index = np.asarray(system.topology.node_coordinate)[columns]
    for _ in range(_RESTARTS if restart else 0):
        if np.max(np.abs(f), initial=0.0) < _TOLERANCE[f.dtype.itemsize]:
            break
        scale = np.where(system.topology.spins[columns] > 0, 1.0, np.asarray(system.length))
        start = np.array(psi)
        start[index] += random.normal(size=len(columns)) * scale * free[0][columns]
        *found, f, g, A = assembled_on_host(system, start, u, t, *free)
    return found, f, g, A


def _check(system, f, g):
    """AssemblyError when residuals remain, by the name of the joint or constraint."""
    for residual, rows, what in (
        (f, system.topology.position_rows, "the mechanism cannot be assembled with the coordinates held"),
        (g, slice(None), "the velocities held contradict the constraints"),
    ):
        closed = _TOLERANCE[residual.dtype.itemsize]
        if np.all(np.abs(residual) < closed):
            continue
        worst: dict = {}
        names = np.array(system.topology.row_joint)[rows]
        for name, value in zip(names, np.abs(residual), strict=True):
            if not value < closed:
                worst[name] = max(worst.get(name, 0.0), float(value) if np.isfinite(value) else np.inf)
        raise AssemblyError(f"{what}; residual [m or rad] by joint:", worst)
