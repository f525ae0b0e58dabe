"""Static equilibrium and steady motion: where the independent accelerations vanish."""

import dataclasses
from collections.abc import Iterable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..assembly._state import State
from ..checks import distinct_names, is_concrete, no_such
from ..constraints._kic import independent_columns
from ..constraints._mobility import is_determined, with_mobility_at
from ..dynamics._bodies import total_mass
from ..dynamics._validity import has_ends, validity
from ..errors import ModelError, SimulationError, warn
from ..friction._joint_friction import bristle_groups, refuse_friction, without_friction
from ..math._nan import nan_where
from ..model._changes import with_changes
from ..model._entry_points import check_single_state
from ..model._held_bands import is_beyond_bands
from ..model._internal_states import replace_field
from ..model._signals import block_elements
from ..model._system import System
from ..named_arrays import elements_of
from ..reports import Note
from ..runtime import jit, note
from ..signal_flow._sampling import refuse_sampled
from ..status import Status
from ._balance import band_columns, band_rates, search_balance, still_columns
from ._equilibrium_result import Equilibrium, curvatures, has_negative_curvature
from ._load_following import follow_load
from ._steep_laws import is_steep
from ._unheld import leaves_internal_states_open, neutral_coordinates, unheld_coordinates
from ._unknowns import at_unknowns, unknowns_of

_MAX_SETS = 3  # independent sets tried, each from the pose found with the one before
_ROUNDINGS = 16  # of the coordinates, of which stiff laws make efforts that are no lack of balance
_RESIDUAL_TOLERANCE = {8: 1e-8, 4: 1e-3}  # efforts over the model's scale that count as zero, half the digits


def equilibrium(
    system: System,
    state: State,
    moving: Iterable[str] = (),
    throw: bool = True,
    held: Iterable[str] = (),
    follow: bool | None = None,
) -> Equilibrium:
    """The state of rest, or of steady motion, near a state.

    Args:
        state: where the search starts; its time serves the drives.
        moving: names of joints that turn or slide steadily: they keep their coordinates and velocities, all other
            independent velocities are zero.
        throw: raise when none is found (outside of tracing); otherwise check `.ok`.
        held: internal states of force elements that keep the values of the state, such as the pressure of a closed
            volume: at rest its rate vanishes at any.  The rates of all others vanish.
        follow: the loads from zero where the search ends unstable, or finds nothing: by default outside of tracing
            only, as it is a second program; True within it too, False never.

    Newton's method with a line search on the independent efforts and the loops together; derivatives by the
    implicit function theorem.

    A motion that nothing holds or pushes, as the spin of a load that hangs at its centre of mass, is left where it
    is: the equilibrium is neutral, `stable` False, and its `reason` names the coordinates.

    Where that ends at an unstable equilibrium, or at none, the loads are followed: the start is held by efforts on
    its independent coordinates, which are taken away bit by bit, so that weight, forces and bent springs come on
    from zero.  If this ends at a stable equilibrium it is the answer, and `reason` says so.  Otherwise the first
    stands: `ok`, of `status` UNSTABLE, with a warning outside of tracing.  A start that is itself at rest, as a
    pendulum that stands, is not left.  Stiffness does not tell the stability of a steady motion (`modes` do), which
    has no such status.

    Where a part is beyond the end of its model at the equilibrium, its `status` is VALIDITY and its print and a
    warning name the part, as `dynamics.validity` does.

    Joints that rub hold a mechanism at rest in a band of poses: the answer is the pose of
    that band at which their friction is zero, and `stable` and `stiffness` are those without friction.
    `impending_motion` gives the two limits of the efforts that hold it.

    Bristles of contacts, metal that yields, and tyres with relaxation rest at any value of a band.  The answer is the
    rest near the start in which they change least: they take only the loads that nothing else takes.  What would
    need more than the end of a band finds no equilibrium, as a block on a slope beyond the angle of friction.

    Within a trace that follows nothing, start from a state found before it.

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
    result = dataclasses.replace(result, is_steady=bool(moving))
    if follow or (follow is None and is_concrete(result)):
        result = _followed(system, state, moving, held, result)
    if follow is not False and is_concrete(result):
        result = _with_neutral_motions(system, state, moving, held, result)
    if not is_concrete(result):
        note(lambda: result.result)
        return result
    if throw and not bool(result.ok):
        raise SimulationError(_failure(system, state, result, held))
    if result.status == Status.UNSTABLE:
        warn(f"equilibrium: it is unstable: {Status.UNSTABLE}; start nearer to another")
    if faults := result.faults():
        warn(f"equilibrium: {Status.VALIDITY}: {'; '.join(faults)}")
    return result


def _followed(system, state, moving, held, first):
    """The first equilibrium, or that at the end of the loads where it is unstable or none."""
    if is_concrete(first) and (bool(first.ok) and not bool(first.is_unstable) or _is_at(first.state, state)):
        return first
    here = with_mobility_at(system, state)
    end, share, steps = follow_load(here, state, _columns(here, moving) + _held_columns(here.topology, held))
    # of one structure with the start, so that one program serves both searches
    end = replace_field(replace_field(state, "coordinates", end.coordinates), "internal", end.internal)
    if is_concrete(first, share):
        return _chosen(system, end, moving, held, first, float(share), int(first.steps) + int(steps))
    leaves = ~first.ok | first.is_unstable
    first = dataclasses.replace(first, share=share, steps=first.steps + steps)
    found = _equilibrium_on_sets(system, end, moving, held)
    found = dataclasses.replace(found, is_steady=first.is_steady, share=share, steps=first.steps + found.steps)
    better = leaves & (share >= 1.0) & found.ok & (~found.is_unstable | ~first.ok)
    result = jax.tree.map(lambda a, b: jnp.where(better, a, b), found, first)
    return dataclasses.replace(result, followed=better)


def _with_neutral_motions(system, state, moving, held, found):
    """The equilibrium, with the names of the motions that nothing holds or pushes; where none was found that of
    shortest steps, which leave such motions as they are: the slope along them has no inverse."""
    if not bool(found.ok):
        other = _equilibrium_on_sets(system, state, moving, held, least=True)
        here = with_mobility_at(system, other.state)
        columns = _columns(here, moving) + _held_columns(here.topology, held)
        if not bool(other.ok) or leaves_internal_states_open(here, other.state, columns):
            return found
        found = dataclasses.replace(other, is_steady=found.is_steady)
    if bool(found.stable) or bool(found.is_negative):
        return found
    names = neutral_coordinates(with_mobility_at(system, found.state), np.asarray(found.stiffness))
    return dataclasses.replace(found, neutral=Note(", ".join(names)))


def _chosen(system, end, moving, held, first, share, steps):
    """The first equilibrium or that at the end of the loads, of known ones."""
    kept = dataclasses.replace(first, **jax.device_put({"share": np.asarray(share), "steps": np.asarray(steps)}))
    if share < 1.0:
        return kept
    found = _equilibrium_on_sets(system, end, moving, held)
    if not bool(found.ok) or (bool(first.ok) and bool(found.is_unstable) and not first.is_steady):
        return kept
    more = jax.device_put({"steps": np.asarray(steps + int(found.steps)), "followed": np.asarray(True)})
    return dataclasses.replace(found, is_steady=first.is_steady, **more)


def _is_at(state, start):
    """True if a state has the coordinates of a start, which then is at rest."""
    there, here = np.asarray(state.coordinates), np.asarray(start.coordinates)
    return bool(np.max(np.abs(there - here), initial=0.0) <= 1e-9 * (1.0 + np.max(np.abs(here), initial=0.0)))


def _failure(system, state, result, held):
    """Words for a search that found nothing."""
    text = (
        f"no equilibrium was found near the state: the residual is {float(result.residual):.3g} of the model's scale"
    )
    if result.share < 1.0:
        text += f", and the loads could be followed up to {100.0 * float(result.share):.3g} % of them"
    if free := unheld_coordinates(system, state):
        return f"{text}; nothing holds {', '.join(free)} against the loads there: give them a support, or a spring"
    return f"{text}; {_advice(system, held)}"


def _advice(system, held):
    """Advice after a failed search: states that rest at any value of a band, such as bristles, are named."""
    resting = [name for name in _holding(system) if name not in held]
    if resting:
        return (
            f"{', '.join(map(repr, resting))} may rest at any value of a band, as bristles do, and hold no more than "
            f"its end; give held={resting} for the balance at the values of the state, or simulate until the motion "
            "has died out"
        )
    hold = ", give held= the internal states that may have any value at rest" if system.topology.internal else ""
    return f"start from a state that is closer{hold}, or add damping and simulate until the motion has died out"


def _holding(system):
    """Names of the internal states that may rest at any value, as their laws and blocks say."""
    each = [(element.name, element.block) for element in block_elements(system.blocks) if element.group.internal]
    for group in (group for group in system.forces if group.internal):
        each += elements_of(group.names, group.law)
    return [f"{name}.{state}" for name, thing in each for state in thing.holds]


def _equilibrium_on_sets(system, state, moving, held, least=False):
    """The equilibrium on the freedoms of the state, and once more from where it was found if these are others there:
    a linkage that starts straight leaves a singular pose."""
    for _ in range(_MAX_SETS):
        here = with_mobility_at(system, state)
        result = _equilibrium(here, state, _columns(here, moving) + _held_columns(here.topology, held), least)
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


@jit(compile="tape")
def _equilibrium(system, state, moving, least=False):
    top, psi, t = system.topology, unknowns_of(system, state), state.t
    still, chosen = still_columns(system, moving, psi.dtype), independent_columns(system)
    N = len(chosen)
    w = state.velocities[chosen] * (1.0 - still[:N])
    weight = total_mass(system) * (1.0 + jnp.max(jnp.abs(system.gravity)))
    psi, at, scale, count = search_balance(system, psi, t, w, moving, weight, least)
    efforts, gap = (jnp.max(jnp.abs(x), initial=0.0) for x in (still * at.efforts / scale, at.gap))
    residual = lax.stop_gradient(jnp.maximum(efforts, gap))
    ok, stiffness, missing = residual < _RESIDUAL_TOLERANCE[psi.dtype.itemsize], at.slope, at.efforts
    if is_steep(system):
        ok = ok | _is_rounding(psi, at, still)
    if top.internal:
        stiffness = stiffness[:N, :N] + at.slope[:N, N:] @ band_rates(system, psi, t, moving)
        missing, still = missing[:N], still[:N]
        ok = ok & ~is_beyond_bands(system, at_unknowns(system, psi)[1])
    psi, u, K, missing = (nan_where(~ok, x) for x in (psi, at.velocities, stiffness, missing))
    bands = bool(np.any(band_columns(system, moving)))
    stable = _is_stable(K, still, bands)
    psi, internal = at_unknowns(system, psi)
    state = State(t, psi, u, structure=top.structure, internal=internal, changes=state.changes)
    ends = validity(system, state) if has_ends(system) else None
    efforts = (1.0 - still) * missing
    negative = ok & ~stable & has_negative_curvature(K, bands)
    return Equilibrium(state, residual, ok, stable, K, efforts, count, negative, validity=ends)


def _is_rounding(psi, at, still):
    """True if rounding of the coordinates alone makes efforts and gaps as large."""
    unit = _ROUNDINGS * jnp.finfo(psi.dtype).eps * (1.0 + jnp.max(jnp.abs(psi), initial=0.0))
    least = unit * jnp.sum(jnp.abs(at.slope), axis=1)
    return lax.stop_gradient(jnp.all(jnp.abs(still * at.efforts) <= least) & jnp.all(jnp.abs(at.gap) <= unit))


def _is_stable(K, still, bands):
    """True if K is positive definite on the coordinates that do not move, see `curvatures`."""
    both = still[:, None] * still[None, :]
    largest = jnp.max(jnp.abs(K), initial=0.0)
    values = curvatures(jnp.where(both > 0, K, jnp.eye(K.shape[0], dtype=K.dtype) * largest), bands)
    return jnp.min(values, initial=jnp.inf) > 1e-12 * jnp.max(jnp.abs(values), initial=0.0)
