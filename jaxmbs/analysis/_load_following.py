"""Equilibria followed from no load to all of it.

The start is held at rest by efforts on its independent coordinates, which are then taken away bit by bit: whatever
acts on the mechanism, weight, forces, springs that are bent, comes on from zero.  Each share of it has an
equilibrium, from which the search for the next begins; the lengths of the increments are controlled.
Source: Allgower and Georg, Numerical Continuation Methods (1990), the global (Newton) homotopy.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..assembly._state import State
from ..constraints._kic import independent_columns
from ..model._system import System
from ..runtime import jit
from ._balance import Balance, NewtonStep, balance, band_columns, given_or_own, newton_step, still_columns
from ._unknowns import after_step, at_unknowns, normalised, unknowns_of

_MOST_STEPS = 200  # evaluations of the balance
_LONGEST_STEP = 0.3  # of a prediction, in rad or lengths of the model
_WANTED_CORRECTION = 0.03  # of a prediction, for which increments are made
_CONTRACTION = 0.7  # of a correction to the one before
_PATH_TOLERANCE = 1e-4  # of the last correction on the way; the search at all of the load mends what it leaves
_SHORTEST = 1e-4  # share of the load; shorter increments say that the path has ended


class _Increment(NamedTuple):
    """An increment of the load from its `share` () by `length` (), whose `trial` is being corrected.

    At `psi`, with the stresses of its steep laws, the share holds; from there `newton` is the step for all of the
    load, `release` that for efforts as large as those that hold the start, `held` (N + ns,).  `first`, `last` () are
    sizes of corrections of the trial, infinite before there is one.
    """

    steps: Array
    share: Array
    length: Array
    psi: Array
    newton: NewtonStep
    release: NewtonStep
    stresses: tuple[Array, ...]
    held: Array
    trial: Array
    trial_stresses: tuple[Array, ...]
    first: Array
    last: Array


@jit(compile="tape")
def follow_load(system: System, state: State, moving: tuple[int, ...]) -> tuple[State, Array, Array]:
    """The state at the end of the path from no load to all of it, the share () of the load that it has, which is one
    if it is an equilibrium, and the number of steps."""
    top, psi, t = system.topology, unknowns_of(system, state), state.t
    still, chosen = still_columns(system, moving, psi.dtype), independent_columns(system)
    bands = band_columns(system, moving)
    w = state.velocities[chosen] * (1.0 - still[: len(chosen)])

    def correct(last: _Increment) -> _Increment:
        at = balance(system, last.trial, t, w, last.trial_stresses)
        start = last.steps == 0
        held = jnp.where(start, still * at.efforts, last.held)
        newton = newton_step(at, still, still * at.efforts, bands)
        release = _difference(newton_step(at, still, still * at.efforts - held, bands), newton)
        target = jnp.minimum(last.share + last.length, 1.0)
        step = _at_share(newton, release, target)
        size = _size(system, step.step)
        arrives = start | (size <= _PATH_TOLERANCE)
        shrinks = size <= jnp.where(jnp.isinf(last.last), _LONGEST_STEP, _CONTRACTION * last.last)
        own = given_or_own(last.trial_stresses, at.stresses)
        # the next increment: as long as the prediction stays short, and longer where the corrections were small
        first = jnp.where(jnp.isinf(last.first), size, last.first)
        grown = last.length * jnp.clip(jnp.sqrt(_WANTED_CORRECTION / jnp.maximum(first, 1e-30)), 0.5, 4.0)
        reach = _LONGEST_STEP / jnp.maximum(_size(system, release.step), 1e-30)
        longer = jnp.minimum(jnp.where(start, 1.0, grown), reach)
        ahead = (target, longer, last.trial, newton, release, own)
        back = (last.share, 0.25 * last.length, last.psi, last.newton, last.release, last.stresses)
        share, length, psi, newton, release, stresses = _select(arrives, ahead, back)
        from_psi = _at_share(newton, release, jnp.minimum(share + length, 1.0))
        goes_on = ~arrives & shrinks
        step = _select(goes_on, step, from_psi)
        trial = normalised(system, after_step(system, jnp.where(goes_on, last.trial, psi), step.step))
        share, length, psi, newton, release, stresses = _select(
            goes_on,
            (last.share, last.length, last.psi, last.newton, last.release, last.stresses),
            (share, length, psi, newton, release, stresses),
        )
        first, size = (jnp.where(goes_on, x, jnp.inf) for x in (first, size))
        taken = (share, length, psi, newton, release, stresses, held)
        return _Increment(last.steps + 1, *taken, trial, step.stresses, first, size)

    def continues(last: _Increment) -> Array:
        return (last.share < 1.0) & (last.steps < _MOST_STEPS) & ((last.steps == 0) | (last.length > _SHORTEST))

    found = lax.while_loop(continues, correct, _first_increment(system, psi, t, w))
    psi, internal = at_unknowns(system, found.psi)
    end = State(t, psi, state.velocities, structure=top.structure, internal=internal, changes=state.changes)
    return lax.stop_gradient((end, found.share, found.steps))


def _first_increment(system, psi, t, w):
    shapes: Balance = jax.eval_shape(lambda: balance(system, psi, t, w))
    none, far = jnp.zeros((), psi.dtype), jnp.full((), jnp.inf, psi.dtype)
    own = tuple(jnp.full(x.shape, jnp.nan, x.dtype) for x in shapes.stresses)
    step = NewtonStep(jnp.zeros(shapes.closing.shape, psi.dtype), own)
    held = jnp.zeros(shapes.efforts.shape, psi.dtype)
    return _Increment(jnp.zeros((), int), none, none, psi, step, step, own, held, psi, own, far, far)


def _difference(a: NewtonStep, b: NewtonStep) -> NewtonStep:
    return jax.tree.map(lambda x, y: x - y, a, b)


def _at_share(newton: NewtonStep, release: NewtonStep, share: Array) -> NewtonStep:
    """The step to the equilibrium at a share of the load, of which the rest is held."""
    return jax.tree.map(lambda x, y: x + (1.0 - share) * y, newton, release)


def _select(condition, one, other):
    return jax.tree.map(lambda x, y: jnp.where(condition, x, y), one, other)


def _size(system, step):
    """Largest part () of a step, in rad and lengths of the model; infinite if it is not finite."""
    top = system.topology
    unit = jnp.where(np.asarray(top.spins) > 0, 1.0, system.length).astype(step.dtype)
    size = jnp.max(jnp.abs(step[: top.num_velocities] / unit), initial=0.0)
    return jnp.where(jnp.all(jnp.isfinite(step)), size, jnp.inf)
