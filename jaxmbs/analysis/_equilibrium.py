"""Static equilibrium and steady motion: where the independent accelerations vanish."""

from collections.abc import Iterable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from ..checks import distinct_names, is_concrete, no_such
from ..contact import BristleContact
from ..dynamics._bodies import total_mass
from ..errors import ModelError, SimulationError
from ..forces import LuGre
from ..kinematics._kic import independent_columns
from ..kinematics._mobility import is_determined, with_mobility_at
from ..kinematics._sampling import refuse_sampled
from ..kinematics._state import State
from ..math._nan import nan_where
from ..model._changes import with_changes
from ..model._entry_points import check_single_state
from ..model._friction import bristle_groups, refuse_friction, without_friction
from ..model._system import System
from ..runtime import jit, lapack
from ._balance import search_balance, still_columns
from ._unknowns import at_unknowns, unknowns_of

_MAX_SETS = 3  # independent sets tried, each from the pose found with the one before
_RESIDUAL_TOLERANCE = {8: 1e-8, 4: 1e-3}  # efforts over the model's scale that count as zero, half the digits


class Equilibrium(eqx.Module):
    """Equilibrium or steady motion of a mechanism.

    Attributes:
        state: the State there; NaN where none was found, as are stiffness and efforts, so that no result is computed
            from a state that is no equilibrium.
        residual: largest effort left on the independent velocities [N, N m] or gap of a loop, over the model's scale,
            without derivative.
        ok: true if the residual is small.
        stable: true if the symmetric part of the stiffness is positive definite on the coordinates that do not move.
        stiffness: K (N, N) there, all causes, along the admissible directions, at unchanged internal states of force
            elements: of these `modes` has the stability.
        efforts: (N,) that keep the moving joints at their speed; zero when the motion sustains itself.
        steps: number of Newton steps.
    """

    state: State
    residual: Float[Array, ""]
    ok: Bool[Array, ""]
    stable: Bool[Array, ""]
    stiffness: Float[Array, "N N"]
    efforts: Float[Array, " N"]
    steps: Int[Array, ""]


def equilibrium(
    system: System, state: State, moving: Iterable[str] = (), throw: bool = True, held: Iterable[str] = ()
) -> Equilibrium:
    """The state of rest, or of steady motion, near a state.

    Args:
        state: where the search starts; its time serves the drives.
        moving: names of joints that turn or slide steadily: they keep their coordinates and velocities, all other
            independent velocities are zero.
        throw: raise when none is found (outside of tracing); otherwise check `.ok`.
        held: internal states of force elements that keep the values of the state, such as the pressure of a closed
            volume: at rest its rate vanishes at any.  The rates of all others vanish.

    Newton's method with a line search on the independent efforts and the loops together; derivatives by the
    implicit function theorem.  Joints that rub hold a mechanism at rest in a band of poses: the answer is the pose of
    that band at which their friction is zero, and `stable` and `stiffness` are those without friction.
    `impending_motion` gives the two limits of the efforts that hold it.

    Raises:
        ModelError: a moving joint is unknown or not independent (name it in `build(independent=...)`), an internal
            state is unknown, joints rub beside moving ones or with bristles.
        SimulationError: no equilibrium was found.
    """
    check_single_state(system, state)
    refuse_sampled(system, "equilibrium")
    moving, held = distinct_names("moving", moving), distinct_names("held", held)
    if moving:
        refuse_friction(
            system,
            "steady motion",
            "ask inverse_dynamics for the efforts that keep the speed, or simulate until it is",
        )
    if bristle_groups(system.friction):
        refuse_friction(
            system, "equilibrium", "bristles hold at any pose of a band; simulate, or take forces.SmoothCoulomb"
        )
    system = without_friction(with_changes(system, state))
    result = _equilibrium_on_sets(system, state, moving, held)
    if throw and is_concrete(result.ok) and not np.all(np.asarray(result.ok)):
        worst = float(np.max(np.asarray(result.residual)))
        raise SimulationError(
            f"no equilibrium was found near the state: the residual is {worst:.3g} of the model's scale; "
            + _advice(system, held)
        )
    return result


def _advice(system, held):
    """Words for a search that failed: bristles are named, as they hold at any pose of a band."""
    open_bends = [bend for bend in _bends(system) if bend not in held]
    if open_bends:
        names = ", ".join(repr(bend.removesuffix(".bristle")) for bend in open_bends)
        return (
            f"the bristles of {names} hold at any pose of a band; give held={open_bends} for the balance at the "
            "bends of the state, or simulate until the motion has died out"
        )
    hold = ", give held= the internal states that may have any value at rest" if system.topology.internal else ""
    return f"start from a state that is closer{hold}, or add damping and simulate until the motion has died out"


def _bends(system):
    """Names of the bends of bristles of contacts and of friction laws."""
    laws = [(group, getattr(group.law, "law", group.law)) for group in system.forces]
    return [
        f"{name}.bristle" for group, law in laws if isinstance(law, LuGre | BristleContact) for name in group.names
    ]


def _equilibrium_on_sets(system, state, moving, held):
    """The equilibrium on the freedoms of the state, and once more from where it was found if these are others there:
    a linkage that starts straight leaves a singular pose."""
    for _ in range(_MAX_SETS):
        here = with_mobility_at(system, state)
        result = _equilibrium(here, state, _columns(here, moving) + _held_columns(here.topology, held))
        if not is_concrete(result):
            fits = is_determined(here, result.state.coordinates, result.state.t) if here.has_constraints else True
            return eqx.tree_at(lambda r: r.ok, result, result.ok & fits)
        state = result.state
        if with_mobility_at(here, state) is here:
            return result
    return eqx.tree_at(lambda r: r.ok, result, jnp.zeros_like(result.ok))


def _columns(system, moving):
    """Velocity columns of the joints that move steadily.  Raises: ModelError."""
    top, chosen = system.topology, independent_columns(system)
    faults, columns = [], []
    for name in distinct_names("moving", moving):
        if name not in top.joint_index:
            faults.append(f"moving: {no_such('joint', name, top.joint_names)}")
            continue
        mine = range(*top.joints[top.joint_index[name]].velocities.indices(top.num_velocities))
        if not mine or not set(mine) <= set(chosen.tolist()):
            faults.append(f"moving: joint {name!r} is not independent; use build(independent=[..., {name!r}])")
        columns += mine
    if faults:
        raise ModelError(faults)
    return tuple(columns)


def _held_columns(top, held):
    """Columns after the velocities of the internal states that keep their values.  Raises: ModelError."""
    records, held = {record.name: record for record in top.internal}, distinct_names("held", held)
    faults = [f"held: {no_such('internal state', name, list(records))}" for name in held if name not in records]
    if faults:
        raise ModelError(faults)
    found = [records[name] for name in held]
    return tuple(top.num_velocities + one.first + k for one in found for k in range(one.size))


@jit(compile="quick")
def _equilibrium(system, state, moving):
    top, psi, t = system.topology, unknowns_of(system, state), state.t
    still, chosen = still_columns(system, moving, psi.dtype), independent_columns(system)
    N = len(chosen)
    w = state.velocities[chosen] * (1.0 - still[:N])
    weight = total_mass(system) * (1.0 + jnp.max(jnp.abs(system.gravity)))
    psi, at, scale, count = search_balance(system, psi, t, w, moving, weight)
    efforts, gap = (jnp.max(jnp.abs(x), initial=0.0) for x in (still * at.efforts / scale, at.gap))
    residual = lax.stop_gradient(jnp.maximum(efforts, gap))
    ok, stiffness, missing = residual < _RESIDUAL_TOLERANCE[psi.dtype.itemsize], at.slope, at.efforts
    if top.internal:
        stiffness, missing, still = stiffness[:N, :N], missing[:N], still[:N]
    stable = _is_stable(stiffness, still)
    psi, u, K, missing = (nan_where(~ok, x) for x in (psi, at.velocities, stiffness, missing))
    _, psi, internal = at_unknowns(system, psi)
    state = State(t, psi, u, structure=top.structure, internal=internal, changes=state.changes)
    return Equilibrium(state, residual, ok, stable, stiffness=K, efforts=(1.0 - still) * missing, steps=count)


def _is_stable(K, still):
    """True if the symmetric part of K is positive definite on the coordinates that do not move."""
    both = still[:, None] * still[None, :]
    symmetric = jnp.where(
        both > 0, 0.5 * (K + K.T), jnp.eye(K.shape[0], dtype=K.dtype) * jnp.max(jnp.abs(K), initial=0.0)
    )
    values = lapack.eigvalsh(lax.stop_gradient(symmetric))
    return jnp.min(values, initial=jnp.inf) > 1e-12 * jnp.max(jnp.abs(values), initial=0.0)
