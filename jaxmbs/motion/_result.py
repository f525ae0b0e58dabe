"""Assembly of the `Motion` from the integrated rows: states on the constraints, accounts and the result code."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..assembly._state import State
from ..constraints._closures import with_directions
from ..dynamics._validity import has_ends, is_outside
from ..math._nan import masked, nan_where
from ..model._changes import Changes
from ..ode._integrate import Arguments, end_of_motion, saved_rows, status_of
from ..ode._problem import LoopState
from ..runtime import map_chunked
from ..status import Status, succeeded
from ._accounts import diagnose, mask_failed, observe, result_code
from ._event_record import event_record
from ._event_sides import num_actions, rows_of_sides, sides_of, with_rows_after_events
from ._hybrid import HybridEquations
from ._motion import Motion

_MOVES = 1e-6  # part of the largest velocity at the start that the rows do not give: rounding is less
_KEEPS = 1e-8  # residual of the velocities' rows, of the largest velocity, that counts as none


def motion_of(
    args: Arguments,
    start: State,
    y0: tuple,
    final: LoopState,
    times: tuple[Array, Array],
    open_at_start: Array,
    lands_on_times: bool,
    names: tuple[str, ...] = (),
    places: tuple[int, ...] = (),
) -> Motion:
    """The motion, its states projected again onto the constraints where steps did not land on the saved times.

    Args:
        args, final: the equations, and the loop after its last step.
        y0: the start as the equations have it.
        times: those to save (T,), the end ().  With an event its state follows the last time before it.
        open_at_start: residual of the constraints at the start.
        names: of the events; places: of the numbers of the system that they change.
    """
    (equations, events, _), (ts, t1) = args, times
    reached, reached_y, arrived = end_of_motion(final, y0, t1, args)
    is_hybrid = isinstance(equations, HybridEquations)
    account: Any = None
    if is_hybrid:
        account = equations.account(reached_y[2])
        final = with_rows_after_events(final, ts, num_actions(account.numbers))
    times, ys, ended = saved_rows(final, ts, (reached, reached_y), args)
    parts = 3 if is_hybrid else 2  # the quadratures say which numbers a row has
    saved, there = (times, *ys[:parts]), (reached, *reached_y[:parts])
    if equations.follows_rows:  # the constraints alone determine coordinates, and their derivative
        saved, there = ((t, lax.stop_gradient(psi), *rest) for t, psi, *rest in (saved, there))
    gone = ~(jnp.all(jnp.isfinite(saved[1]), axis=1) & jnp.all(jnp.isfinite(saved[2]), axis=1))
    together = _with_start_and_end((start.t, *y0[:parts]), saved, there, ended | gone)
    if is_hybrid:
        of_sides, used = rows_of_sides(equations, final, account, there)
        together = jax.tree.map(lambda x, more: jnp.concatenate([x, more]), together, of_sides)
    closes = events is not None or not lands_on_times
    others = start.velocities if equations.follows_rows and equations.system.has_constraints else None
    found, observed, outside = map_chunked(functools.partial(_evaluate, args, places, closes, others), together)
    observed, is_free = _free_at_start(observed, others, found[1])
    observed = (*observed[:2], *lax.stop_gradient(observed[2:]))  # residuals have no derivative
    if is_hybrid:
        split = lambda a, b: jax.tree.map(lambda x: x[a:b], (found, observed))
        (found_sides, observed_sides), (found, observed) = split(len(times) + 2, None), split(None, len(times) + 2)

    lost = jnp.concatenate([gone, ~arrived[None]])
    found = jax.tree.map(lambda x: jnp.concatenate([x[:1], nan_where(lost, x[1:])]), found)
    structure = equations.system.topology.structure
    end = _states(reached, jax.tree.map(lambda x: x[-1], found), observed[2][-1], structure)
    found, observed = jax.tree.map(lambda x: x[:-1], (found, observed))
    states = _states(times, jax.tree.map(lambda x: x[1:], found), observed[2][1:], structure)
    work, acting = _work(equations, ys[2], names)
    diagnostics = diagnose(equations.system, observed, masked(ended, work, jnp.nan), final, acting)
    code = _code_of_end(final, events)
    code, lost = result_code(code, states, diagnostics, observed, ended, open_at_start, ts)
    code, kept = _with_limits(jnp.where(is_free, Status.INCONSISTENT, code), equations.follows_rows, outside)
    states, diagnostics, end = mask_failed(ended, lost, kept, states, diagnostics, end)
    if events is None:
        return Motion(ts, states, code, diagnostics, end, None)
    sides = None
    if is_hybrid:
        observed = jax.tree.map(lambda x, more: jnp.concatenate([x[:1], more]), observed, observed_sides)
        accounts = diagnose(equations.system, observed, _work(equations, of_sides[3], names)[0], final, acting)
        actions = jnp.where(ended, len(used) + 1, num_actions(equations.account(ys[2]).numbers))
        sides = sides_of(_states(of_sides[0], found_sides, observed_sides[2], structure), accounts, used, actions)
    record = event_record(names, account, final, reached, code == Status.EVENT, sides)
    return Motion(times, states, code, diagnostics, end, record)


def _with_start_and_end(first, saved, end, gone):
    """Rows (1 + T + 1, ...) of the start, the saved times and the end.

    Rows that are gone are the end's: so the derivative of what is lost meets all parameters as NaN, and that of what
    is kept is not harmed.
    """
    filled = (masked(gone, x, x1) for x, x1 in zip(saved, end, strict=True))
    return tuple(jnp.concatenate([x0[None], x, x1[None]]) for x0, x, x1 in zip(first, filled, end, strict=True))


def _free_at_start(observed, others, u):
    """(what is observed of all states, True if velocities at the start (nv,) keep the rows there, and are not those
    of u (states, nv) that they give: the start is on a branch with more freedom than that of the build).

    Velocities that do not keep them, as of a state written by hand, are replaced by those that the rows give.
    """
    if others is None:
        return observed, False
    if not others.size:  # nothing moves
        return tuple(observed[:-1]), False
    (*observed, slips), size = observed, jnp.max(jnp.abs(others))
    differ = jnp.max(jnp.abs(others - u[0])) > _MOVES * size
    return tuple(observed), lax.stop_gradient(differ & (slips[0] <= _KEEPS * size))


def _evaluate(args, places, closes, others, row):
    """The numbers of a state at a row, those of the accounts, and True if a part is beyond the end of its model."""
    t, psi, p, *quadratures = row
    equations = args.equations.in_mode(*quadratures) if quadratures else args.equations
    if closes:
        psi, p = equations.close(t, psi, p)
    system, at = equations.system, equations.at(t, psi, p)
    if any(group.law.has_ends for group in system.rows):  # whose loads need the rates of all rows
        at = with_directions(system, at, values=True)
    ends: list | None = [] if has_ends(system) else None
    observed = observe(system, at, ends, others)
    outside = None if ends is None else is_outside(system, at, ends)
    return (psi, at.u, at.internal, Changes.of(system, places)), observed, outside


def _with_limits(code, follows_rows, outside):
    """The status, that of models beyond their ends too, and True if the end of the motion is kept."""
    if follows_rows:
        code = jnp.where((code == Status.STEP_SIZE) | (code == Status.FAILED), Status.INCONSISTENT, code)
    kept = succeeded(code) | (code == Status.ENERGY)
    if outside is not None:
        code = jnp.where(succeeded(code) & jnp.any(outside), Status.VALIDITY, code)
    return code, kept


def _states(t, found, residual, structure):
    psi, u, internal, changes = found
    return State(t, psi, u, residual, structure, internal=internal, changes=changes)


def _work(equations, quadratures, names):
    """(work (T, n) of forces, drives and the events that act; names of those)."""
    if not isinstance(equations, HybridEquations):
        return quadratures, ()
    account, acting = equations.account(quadratures), equations.acting
    jumps = account.jumps[..., np.array(acting, int)]
    return jnp.concatenate([account.work, jumps], axis=-1), tuple(names[k] for k in acting)


def _code_of_end(final, events):
    """The status () with which the loop ended; an event that acts ends it where there were too many."""
    code = status_of(final.result)
    if events is None or not any(events.acts):
        return code
    too_many = (code == Status.EVENT) & jnp.asarray(events.acts)[jnp.maximum(final.bracket.fired, 0)]
    return jnp.where(too_many, Status.EVENTS, code)
