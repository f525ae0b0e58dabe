"""The state of a system at a time, and how to get one that closes all loops."""

import warnings
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import known, no_such
from ..errors import AssemblyError, ModelError
from ..math.host import as_array
from ..model.system import System
from ..typing import ArrayLike
from .assembly import assembled
from .evaluate import is_concrete
from .host_assembly import assembled_on_host
from .poses import neutral_coordinates

_TOLERANCE = {8: 1e-8, 4: 1e-3}  # residuals that count as closed, by precision
_RESTARTS = 12  # searches from other guesses before a state counts as impossible


class State(eqx.Module):
    """Time t () [s], coordinates (nq,) and velocities (nv,) of the tree's joints; leading axes for a motion.

    `residual` () is what assembly left open, the largest over the rows of positions [m, rad] and velocities [m/s,
    rad/s]; zero for a state written down by hand.  In a batch of designs `ok` tells which of them were assembled.
    `structure` is the layout of the system that it was made for, of which the public functions ask; None by hand.
    """

    t: Float[Array, "..."]
    coordinates: Float[Array, "... nq"]
    velocities: Float[Array, "... nv"]
    residual: Float[Array, "..."]
    structure: tuple | None = eqx.field(static=True)

    def __init__(
        self,
        t: ArrayLike,
        coordinates: ArrayLike,
        velocities: ArrayLike,
        residual: Array | None = None,
        structure: tuple | None = None,
    ) -> None:
        plain = (float, list, np.ndarray)
        self.t, self.coordinates, self.velocities = (
            as_array(x) if isinstance(x, plain) else x for x in (t, coordinates, velocities)
        )
        self.residual = jnp.zeros_like(self.t) if residual is None else residual
        self.structure = structure

    @property
    def ok(self) -> jax.Array:
        """Whether the loops are closed and the numbers finite (traceable)."""
        finite = [jnp.all(jnp.isfinite(x), axis=-1) for x in (self.coordinates, self.velocities)]
        return (self.residual <= _TOLERANCE[self.coordinates.dtype.itemsize]) & finite[0] & finite[1]

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
                keywords serve as well, `State.at(system, crank=0.3)`.  These are held, all others are solved for.
            velocities: joint name -> velocity, held; other velocities take the least that closes the loops.
            guess: joint name -> coordinate to start the search from (default: zero).
            t: time [s], for driven joints.

        Raises:
            ModelError: unknown names, wrong sizes, or values for a joint that was cut (all in one report).
            AssemblyError: the loops cannot be closed there; names the joints and what remains open.  Inside of
                tracing (a batch, a gradient) nothing is raised: coordinates and velocities are NaN there, and all
                that follows from them; `residual` says how far open the loops are.
        """
        values = {**(values or {}), **named}
        top = system.topology
        faults: list[str] = []
        precision = jnp.result_type(float)
        psi = _place(top, neutral_coordinates(top).astype(precision), guess or {}, "coordinates", faults)
        psi = _place(top, psi, values, "coordinates", faults)
        u = _place(top, np.zeros(top.num_velocities, precision), velocities or {}, "velocities", faults)
        if faults:
            raise ModelError(faults)
        free = tuple(_free(top, held).astype(precision) for held in (values, velocities or {}))
        if not is_concrete(system, psi, u, t):
            return _traced(system, jnp.asarray(psi), jnp.asarray(u), jnp.asarray(t, float), free)
        found, f, g = _search(system, psi, u, np.asarray(t, precision), free, restart=not guess)
        _check(system, f, g)
        largest = max(np.max(np.abs(x), initial=0.0) for x in (f, g))
        return State(*(as_array(x, None) for x in (np.asarray(t, precision), *found, largest)), top.structure)


@runtime_checkable
class HasStates(Protocol):
    """What has states at several times, as a `Motion` has."""

    @property
    def states(self) -> State: ...


def _traced(system, psi, u, t, free):
    """The state within a trace, NaN where it is not assembled; times NaN and not `where`, so that derivatives are
    NaN too."""
    psi, u, f, g = assembled(system, psi, u, t, *map(jnp.asarray, free))
    largest = [jnp.max(jnp.abs(x), initial=0.0) for x in (f, g)]
    state = State(t, psi, u, jax.lax.stop_gradient(jnp.maximum(*largest)), system.topology.structure)
    factor = jnp.where(state.ok, 1.0, jnp.nan).astype(psi.dtype)
    return State(t, psi * factor, u * factor, state.residual, state.structure)


def _search(system, psi, u, t, free, restart):
    """Assemble from psi on the host; searches that fail start again from random guesses."""
    if not system.has_constraints:
        none = np.zeros(0, psi.dtype)
        return (psi, u), none, none
    *found, f, g = assembled_on_host(system, psi, u, t, *free)
    random, simple = np.random.default_rng(0), np.array([k != "ball" for k in system.topology.node_kind])
    columns = np.nonzero(simple)[0]
    index = np.asarray(system.topology.node_coordinate)[columns]
    for _ in range(_RESTARTS if restart else 0):
        if np.max(np.abs(f), initial=0.0) < _TOLERANCE[f.dtype.itemsize]:
            break
        scale = np.where(system.topology.spins[columns] > 0, 1.0, np.asarray(system.length))
        start = np.array(psi)
        start[index] += random.normal(size=len(columns)) * scale * free[0][columns]
        *found, f, g = assembled_on_host(system, start, u, t, *free)
    return found, f, g


def _place(top, array, values, part, faults):
    """`array` with the named joints' entries set; faults are collected."""
    for name, value in values.items():
        if name not in top.joint_index:
            faults.append(f"state: {no_such('joint', name, top.joint_names)}")
            continue
        joint = top.joints[top.joint_index[name]]
        where = getattr(joint, part)
        if joint.is_cut:
            faults.append(
                f"state: joint {name!r} closes a loop and has no coordinate; "
                f"choose another joint to cut with build(cut=[...])"
            )
            continue
        if isinstance(value, str):
            faults.append(f"state: joint {name!r} takes numbers, got the text {value!r}")
            continue
        host = known(array, value)
        value = np.asarray(value, array.dtype) if host else jnp.asarray(value, float)
        size = where.stop - where.start
        _notice_degrees(name, joint, value, part)
        if value.shape not in (((), (1,)) if size == 1 else ((size,),)):
            faults.append(f"state: joint {name!r} takes {size} {part}, got shape {value.shape}")
            continue
        if host:
            array = array.copy()
            array[where] = np.reshape(value, (size,))
        else:
            array = jnp.asarray(array).at[where].set(jnp.reshape(value, (size,)))
    return array


def _notice_degrees(name, joint, value, part):
    """A warning for an angle of more than two turns: it may be in degrees."""
    turns = joint.kind == "Revolute" and part == "coordinates" and known(value)
    if turns and np.any(np.abs(value) > 4.0 * np.pi):
        angle = float(np.max(np.abs(value)))
        text = f"state: joint {name!r} is put at {angle:.6g} rad, {angle / 2.0 / np.pi:.1f} turns"
        warnings.warn(f"{text}; angles are in radians, not degrees", stacklevel=4)


def _free(top, values):
    free = np.ones(top.num_velocities)
    for name in values:
        free[top.joints[top.joint_index[name]].velocities] = 0.0
    return free


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
