"""Reverse derivative of one step: explicit Runge-Kutta methods stage by stage, others through their own step."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..runtime import any_in_batch, small_call
from ._diffrax_internals import butcher_arrays, has_explicit_stages, is_diagonally_implicit, with_scan_kind
from ._jumps import jump_cotangents
from ._loop import after_action, begin, interpolate, next_save_time, solver_step
from ._problem import OdeProblem
from ._samples import after_samples


def memory_of(problem: OdeProblem, memory):
    """The part of a solver's memory that has derivatives; None where each step starts anew or from its own stages."""
    if problem.project is not None or has_explicit_stages(problem.solver) or is_diagonally_implicit(problem.solver):
        return None
    return eqx.filter(memory[0], eqx.is_inexact_array)


def first_memory(problem: OdeProblem, y0, t0, dt0, args_of, moving, bars):
    """Cotangents (of the arguments, of the start) with those that the solver's memory at the start adds."""
    moving_bar, y_bar, memory_bar = bars
    if memory_bar is None:
        return moving_bar, y_bar

    def memory(moving, y0):
        return memory_of(problem, begin(problem, y0, t0, dt0, args_of(moving)).memory)

    change = jax.vjp(memory, moving, y0)[1](memory_bar)
    return jax.tree.map(jnp.add, (moving_bar, y_bar), change)


def step_vjp(problem: OdeProblem, args_of, moving, row, bars, ys_bar, jumps_bar=None):
    """Cotangents before a step from those after it and from those of the saved states (T, ...).

    Args:
        args_of: the arguments as a function of the part `moving` of them that has derivatives.
        row: of the log (`_adjoint.CheckpointBuffer`): the loop's state before the step, its dense output if its
            stages are differentiated one by one, the event that acted at its end and the periods sampled there.
        bars: cotangents of the arguments, the state, the solver's memory and `Projection.saved` of the state.
        jumps_bar: those of the `Jumps`, None without such.
    """
    step, before_bar = _whole_step_vjp if row[1] is None else _explicit_step_vjp, None
    if jumps_bar is not None:
        before_bar, after_bar = jump_cotangents(jumps_bar, row[0][5].actions, row[2] >= 0)
        bars = bars[0], jax.tree.map(jnp.add, bars[1], after_bar), *bars[2:]
    change, y_bar, memory_bar = step(problem, args_of, moving, row, bars, ys_bar, before_bar)
    projected_bar = jax.tree.map(jnp.zeros_like, bars[3])  # only the last step of the motion has one
    return jax.tree.map(jnp.add, bars[0], change), y_bar, memory_bar, projected_bar


def _whole_step_vjp(problem, args_of, moving, row, bars, ys_bar, before_bar):
    (t0, t1, y0, memory, saved, *_), *_ = row
    problem = eqx.tree_at(lambda m: m.solver, problem, with_scan_kind(problem.solver, "checkpointed"))
    floating, rest = memory_of(problem, memory), memory[0]
    rest = rest if floating is None else eqx.filter(rest, eqx.is_inexact_array, inverse=True)

    def whole(moving, y0, floating):
        args, state = args_of(moving), rest if floating is None else eqx.combine(floating, rest)
        y, _, dense, state, _ = solver_step(problem, t0, t1, y0, args, state, memory[2])
        return _step_end(problem, t1, y, args, row), dense, memory_of(problem, (state,))

    (y1, dense, _), back = jax.vjp(whole, moving, y0, floating)
    end_bar, dense_bar = _with_saved(problem, t0, t1, saved, y1, dense, (bars[1], bars[3]), ys_bar, before_bar)
    return back((end_bar, dense_bar, bars[2]))


def _explicit_step_vjp(problem, args_of, moving, row, bars, ys_bar, before_bar):
    (t0, t1, y0, _, saved, *_), dense, *_ = row
    y1, back = jax.vjp(lambda moving, y: _step_end(problem, t1, y, args_of(moving), row), moving, dense["y1"])
    end_bar, dense_bar = _with_saved(problem, t0, t1, saved, y1, dense, (bars[1], bars[3]), ys_bar, before_bar)
    change, y_bar = back(end_bar)
    y_bar = jax.tree.map(jnp.add, y_bar, dense_bar["y1"])
    change, y_bar = _stages_vjp(problem, t0, t1, y0, dense["k"], args_of, moving, change, y_bar, dense_bar["k"])
    return change, jax.tree.map(jnp.add, y_bar, dense_bar["y0"]), None


def _saves_other(problem):
    """True if other numbers are saved than the next step starts from."""
    return problem.saves_projection or problem.jump is not None or problem.clock is not None


def _step_end(problem, t1, y, args, row):
    """The state at the end of a step; where other numbers are saved than the next step starts from, both: with
    `Projection.saved`, or before and after the action of an event and samples."""
    (*_, numbers), _, acted, due = row
    saved = y
    if problem.project is not None:
        found = problem.project(t1, y, args)
        y, saved = found.y, found.saved if problem.saves_projection else found.y
    if problem.jump is not None:
        y = after_action(problem, t1, y, args, acted >= 0, acted)
    y = after_samples(problem, t1, y, args, due, numbers)
    return (y, saved) if _saves_other(problem) else y


def _with_saved(problem, t0, t1, saved, end, dense, end_bars, ys_bar, before_bar):
    """Cotangents of (`_step_end`, the dense output), with those of the states saved during the step."""
    y_bar, projected_bar = end_bars
    none = jax.tree.map(jnp.zeros_like, dense)
    saved_bar = projected_bar if problem.saves_projection else jax.tree.map(jnp.zeros_like, y_bar)
    if before_bar is not None:  # what is saved is that before the action
        saved_bar = before_bar
    two = _saves_other(problem)
    saved_y, dense_bar = end[1] if two else end, none
    if problem.lands_on_times:
        hit, at = next_save_time(problem, saved) <= t1, jnp.minimum(saved, problem.times.size - 1)
        change = jax.tree.map(lambda ys: jnp.where(hit, ys[at], 0.0), ys_bar)
        saved_bar = jax.tree.map(jnp.add, saved_bar, change)
    else:
        saved_bar, dense_bar = _of_interpolated(problem, t0, t1, saved, saved_y, dense, (saved_bar, none), ys_bar)
    return ((y_bar, saved_bar) if two else jax.tree.map(jnp.add, y_bar, saved_bar)), dense_bar


def _of_interpolated(problem, t0, t1, saved, y1, dense, bars, ys_bar):
    """Cotangents of (the step's end, the dense output), with those of the states that are interpolated in it."""

    def left(carry):
        return next_save_time(problem, carry[0]) <= t1

    def body(carry):
        k, bars = carry
        there = left(carry)
        _, back = jax.vjp(lambda y1, dense: interpolate(problem, t0, t1, y1, dense, problem.times[k]), y1, dense)
        change = back(jax.tree.map(lambda ys: jnp.where(there, ys[k], 0.0), ys_bar))
        return jnp.where(there, k + 1, k), jax.tree.map(jnp.add, bars, change)

    return lax.while_loop(lambda carry: any_in_batch(left(carry)), body, (saved, bars))[1]


def _stages_vjp(problem, t0, t1, y0, K, args_of, moving, moving_bar, y_bar, K_bar):
    """Back through `k_i = h f(t_i, y0 + sum a_ij k_j)` and `y1 = y0 + sum b_i k_i`, the last stage first."""
    tableau, h, dtype = butcher_arrays(problem.solver), t1 - t0, jax.tree.leaves(y0)[0].dtype
    # the last stage of a first-same-as-last method is in the interpolation only
    used = len(tableau[0]) if not problem.lands_on_times else 1 + int(np.max(np.nonzero(tableau[1])))
    A, b, c = (jnp.asarray(x, dtype) for x in tableau)
    K_bar = jax.tree.map(lambda k, y: k + b.reshape(-1, *[1] * y.ndim) * y[None], K_bar, y_bar)

    def stage(carry, i):
        moving_bar, y_bar, K_bar = carry
        y = jax.tree.map(lambda y, k: y + jnp.tensordot(A[i], k, 1), y0, K)
        t = jnp.where(c[i] == 1.0, t1, t0 + c[i] * h)
        _, back = jax.vjp(lambda moving, y: problem.rate(t, y, args_of(moving)), moving, y)
        change, stage_bar = back(jax.tree.map(lambda k: h * k[i], K_bar))
        K_bar = jax.tree.map(lambda k, y: k + A[i].reshape(-1, *[1] * y.ndim) * y[None], K_bar, stage_bar)
        add = lambda old, new: jax.tree.map(jnp.add, old, new)
        return (add(moving_bar, change), add(y_bar, stage_bar), K_bar), None

    stages = small_call(lambda bars: lax.scan(stage, bars, jnp.arange(used), reverse=True)[0])
    return stages((moving_bar, y_bar, K_bar))[:2]
