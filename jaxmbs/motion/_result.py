"""The `Motion` made of what a march left: saved states on the constraints, the event, accounts, the code."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from ..kinematics._configuration import configuration, with_velocities
from ..kinematics._state import State
from ..math._nan import nan_where, value_where
from ..ode._loop import stop_gradients
from ..runtime import map_chunked
from ..status import Status, succeeded
from ._accounts import diagnose, mask_failed, masked, observe, result_code
from ._motion import Motion


def shown(walk, y0, early, moves):
    """The walk with what was shown in place of what was integrated; at times up to the start that is y0."""
    ys = jax.tree.map(lambda x, x0: masked(early, x, x0[None]), walk.ys, y0)
    y = walk.y[0], jnp.where(moves, walk.shown[1], y0[1]), walk.y[2]
    return eqx.tree_at(lambda w: (w.ys, w.y), walk, (ys, y))


def crossing(t, y, args):
    """The event's value () at a state of the march."""
    problem, event = args
    return event(state_at(problem.system, t, y[0], problem.velocities(t, *y[:2])))


def state_at(system, t, psi, u) -> State:
    """The state as one of the system: one written down by hand does not know the joints."""
    return State(t, psi, u, structure=system.topology.structure)


@eqx.filter_custom_jvp
def attach_time_derivative(y, t, held_t, problem):
    """y (or rows of it), found at `held_t` with that time held: its derivative by the time is its rate."""
    return y


@attach_time_derivative.def_jvp
def _shifted_jvp(primals, tangents):
    y, _, held_t, problem = primals
    y_dot, t_dot, _, _ = tangents
    if t_dot is None:
        return y, y_dot
    rate = jax.vmap(problem.rate)(held_t, y) if held_t.ndim else problem.rate(held_t, y)
    along = lambda r: r * t_dot.reshape(t_dot.shape + (1,) * (r.ndim - t_dot.ndim))  # noqa: E731
    return y, tuple(along(r) if d is None else d + along(r) for r, d in zip(rate, y_dot, strict=True))


def _reached(walk, y0, t1, args):
    """(time, state) that a march ended with, that of the event if it ended the march; and whether all is finite.

    By the end that was asked for, its derivative is the motion's rate.  What is not finite is the start instead, as
    its derivatives would make NaN of cotangents that are zero.
    """
    problem, event = args
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in walk.y]))
    y = jax.tree.map(lambda x, x0: value_where(~finite, x, lax.stop_gradient(x0)), walk.y, y0)
    happened = walk.result == diffrax.RESULTS.event_occurred
    t = stop_gradients(walk.t) + jnp.where(happened | ~jnp.isfinite(t1), 0.0, t1 - stop_gradients(t1))
    y = attach_time_derivative(y, t, stop_gradients(walk.t), problem)
    if event is not None:
        t, y = jax.tree.map(lambda a, b: jnp.where(happened, a, b), _on_the_event(t, y, args), (t, y))
    return t, y, finite


def _on_the_event(t, y, args):
    """(time, state) of the event from those that a march ended with beside it: one Newton step along the motion."""
    rate = args[0].rate(t, y)
    value, slope = jax.jvp(lambda t, y: crossing(t, y, args), (t, y), (jnp.ones_like(t), rate))
    late = value / jnp.where(slope == 0.0, 1.0, slope)
    return t - late, jax.tree.map(lambda y, r: y - late * r, y, rate)


def motion_of(args, start, y0, walk, asked, open_at_start, lands) -> Motion:
    """Saved states back on the constraints where steps did not land on them, accounts and the result code.

    With an event the state that the march reached follows the last time before it.  asked: times to save, the end.
    """
    (problem, event), (ts, t1) = args, asked
    reached, reached_y, arrived = _reached(walk, y0, t1, args)
    times, ys, ended = _with_event(walk, ts, (reached, reached_y), args)
    psi, p, work = ys
    there = (reached, *reached_y[:2])
    if problem.follows_rows:  # the constraints alone determine coordinates, and their derivative
        psi, there = lax.stop_gradient(psi), (reached, lax.stop_gradient(reached_y[0]), reached_y[1])

    def sample(row):
        t, psi, p = row
        if event is not None or not lands:
            psi, _ = problem.project_position(t, psi)
        at = configuration(problem.system, problem.P, psi, t)
        u = problem.velocities_at(at, p)
        return psi, u, observe(problem.system, with_velocities(problem.system, at, u))

    # what is not saved, or not finite, stands at the last state: the derivative of what is lost meets all parameters
    # as NaN, that of what is kept is not harmed
    gone = ~(jnp.all(jnp.isfinite(psi), axis=1) & jnp.all(jnp.isfinite(p), axis=1))
    filled = [masked(ended | gone, x, x1) for x, x1 in zip((times, psi, p), there, strict=True)]
    first = (start.t, *y0[:2])
    rows = tuple(jnp.concatenate([x0[None], x, x1[None]]) for x0, x, x1 in zip(first, filled, there, strict=True))
    psi, u, observed = map_chunked(sample, rows)
    observed = (*observed[:2], *lax.stop_gradient(observed[2:]))  # residuals have no derivative
    lost = jnp.concatenate([gone, ~arrived[None]])
    psi, u = (jnp.concatenate([x[:1], nan_where(lost, x[1:])]) for x in (psi, u))
    structure = problem.system.topology.structure
    end = State(reached, psi[-1], u[-1], observed[2][-1], structure)
    psi, u, observed = jax.tree.map(lambda x: x[:-1], (psi, u, observed))
    states = State(times, psi[1:], u[1:], observed[2][1:], structure)
    diagnostics = diagnose(problem.system, observed, masked(ended, work, jnp.nan), walk)
    code, lost = result_code(walk.result, states, diagnostics, observed, ended, open_at_start, ts)
    if problem.follows_rows:
        code = jnp.where((code == Status.STEP_SIZE) | (code == Status.FAILED), Status.INCONSISTENT, code)
    kept = succeeded(code) | (code == Status.ENERGY)
    states, diagnostics, end = mask_failed(ended, lost, kept, states, diagnostics, end)
    return Motion(ts if event is None else times, states, code, diagnostics, end)


def _with_event(walk, ts, reached, args):
    """(times, rows of the march's state, whether a row is beyond the end); the event has a row more, in its place."""
    index = jnp.arange(len(ts), dtype=jnp.int32)
    ended = (index >= walk.saved) | ~jnp.isfinite(ts)  # after an end nothing is saved
    times, ys = masked(ended, ts, jnp.inf), attach_time_derivative(walk.ys, ts, stop_gradients(ts), args[0])
    if args[1] is None:
        return times, ys, ended
    index = jnp.arange(len(ts) + 1, dtype=jnp.int32)
    times, ys = jax.tree.map(
        lambda x, x1: masked(index == walk.saved, jnp.concatenate([x, x1[None]]), x1[None]), (times, ys), reached
    )
    times = jnp.where(index <= walk.saved, times, jnp.inf)
    return times, ys, ~jnp.isfinite(times)
