"""One step of a march pulled back: explicit Runge-Kutta methods stage by stage, others through their own step."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..runtime import any_lane, small_call
from ._implicit_step import is_diagonally_implicit
from ._loop import OdeProblem, begin, interpolated, next_save_time, solver_step, with_scan


def has_stages(solver) -> bool:
    """Whether it is an explicit Runge-Kutta method with diffrax's own step and inside."""
    explicit = isinstance(solver, diffrax.AbstractERK) and isinstance(solver.tableau, diffrax.ButcherTableau)
    return explicit and type(solver).step is diffrax.AbstractERK.step


def memory_of(march: OdeProblem, memory):
    """What of a solver's memory has derivatives: nothing where every step starts anew or from its own stages."""
    if march.close is not None or has_stages(march.solver) or is_diagonally_implicit(march.solver):
        return None
    return eqx.filter(memory[0], eqx.is_inexact_array)


def first_memory(march: OdeProblem, y0, t0, dt0, args_of, moving, bars):
    """Cotangents (of what moves, of the start) with what the solver's memory at the start adds."""
    moving_bar, y_bar, memory_bar = bars
    if memory_bar is None:
        return moving_bar, y_bar

    def memory(moving, y0):
        return memory_of(march, begin(march, y0, t0, dt0, args_of(moving)).memory)

    change = jax.vjp(memory, moving, y0)[1](memory_bar)
    return jax.tree.map(jnp.add, (moving_bar, y_bar), change)


def step_vjp(march: OdeProblem, args_of, moving, row, bars, ys_bar):
    """Cotangents (of what moves in the arguments, of the state before the step, of the solver's memory there, of what
    is shown of that state, or None) from those after it and of the saved states (T, ...)."""
    pull = _pulled_whole if row[1] is None else _pulled_stages
    change, y_bar, memory_bar = pull(march, args_of, moving, row, bars, ys_bar)
    shown_bar = jax.tree.map(jnp.zeros_like, bars[3])  # only the last of the march has one
    return jax.tree.map(jnp.add, bars[0], change), y_bar, memory_bar, shown_bar


def _pulled_whole(march, args_of, moving, row, bars, ys_bar):
    (t0, t1, y0, memory, saved, _), _ = row
    march = eqx.tree_at(lambda m: m.solver, march, with_scan(march.solver, "checkpointed"))
    floating, rest = memory_of(march, memory), memory[0]
    rest = rest if floating is None else eqx.filter(rest, eqx.is_inexact_array, inverse=True)

    def whole(moving, y0, floating):
        args, state = args_of(moving), rest if floating is None else eqx.combine(floating, rest)
        y, _, dense, state, _ = solver_step(march, t0, t1, y0, args, state, memory[2])
        return _ends(march, t1, y, args), dense, memory_of(march, (state,))

    (y1, dense, _), back = jax.vjp(whole, moving, y0, floating)
    end_bar, dense_bar = _with_saved(march, t0, t1, saved, y1, dense, (bars[1], bars[3]), ys_bar)
    return back((end_bar, dense_bar, bars[2]))


def _pulled_stages(march, args_of, moving, row, bars, ys_bar):
    (t0, t1, y0, _, saved, _), dense = row
    y1, back = jax.vjp(lambda moving, y: _ends(march, t1, y, args_of(moving)), moving, dense["y1"])
    end_bar, dense_bar = _with_saved(march, t0, t1, saved, y1, dense, (bars[1], bars[3]), ys_bar)
    change, y_bar = back(end_bar)
    y_bar = jax.tree.map(jnp.add, y_bar, dense_bar["y1"])
    change, y_bar = _stages(march, t0, t1, y0, dense["k"], args_of, moving, change, y_bar, dense_bar["k"])
    return change, jax.tree.map(jnp.add, y_bar, dense_bar["y0"]), None


def _ends(march, t1, y, args):
    """The state that a step ends with, and what is shown of it if that is saved."""
    if march.close is None:
        return y
    y, _, shown = march.close(t1, y, args)
    return (y, shown) if march.shows else y


def _with_saved(march, t0, t1, saved, y1, dense, end_bars, ys_bar):
    """Cotangents of (`_ends`, the inside of the step), those of the states saved in it added."""
    y_bar, shown_bar = end_bars
    none = jax.tree.map(jnp.zeros_like, dense)
    if march.lands:
        hit, at = next_save_time(march, saved) <= t1, jnp.minimum(saved, march.times.size - 1)
        saved_bar = jax.tree.map(lambda ys: jnp.where(hit, ys[at], 0.0), ys_bar)
        if march.shows:
            return (y_bar, jax.tree.map(jnp.add, shown_bar, saved_bar)), none
        return jax.tree.map(jnp.add, y_bar, saved_bar), none

    def left(carry):
        return next_save_time(march, carry[0]) <= t1

    def body(carry):
        k, bars = carry
        there = left(carry)
        _, back = jax.vjp(lambda y1, dense: interpolated(march, t0, t1, y1, dense, march.times[k]), y1, dense)
        change = back(jax.tree.map(lambda ys: jnp.where(there, ys[k], 0.0), ys_bar))
        return jnp.where(there, k + 1, k), jax.tree.map(jnp.add, bars, change)

    return lax.while_loop(lambda carry: any_lane(left(carry)), body, (saved, (y_bar, none)))[1]


def _stages(march, t0, t1, y0, K, args_of, moving, moving_bar, y_bar, K_bar):
    """Back through `k_i = h f(t_i, y0 + sum a_ij k_j)` and `y1 = y0 + sum b_i k_i`, the last stage first."""
    tableau, h = march.solver.tableau, t1 - t0
    dtype, n = jax.tree.leaves(y0)[0].dtype, tableau.num_stages
    A, c = np.zeros((n, n)), np.r_[tableau.c1, tableau.c]
    for i, row in enumerate(tableau.a_lower):
        A[i + 1, : i + 1] = row
    # the last stage of a first-same-as-last method is in the interpolation only
    used = n if not march.lands else 1 + int(np.max(np.nonzero(tableau.b_sol)))
    A, b, c = (jnp.asarray(x, dtype) for x in (A, tableau.b_sol, c))
    K_bar = jax.tree.map(lambda k, y: k + b.reshape(-1, *[1] * y.ndim) * y[None], K_bar, y_bar)

    def stage(carry, i):
        moving_bar, y_bar, K_bar = carry
        y = jax.tree.map(lambda y, k: y + jnp.tensordot(A[i], k, 1), y0, K)
        t = jnp.where(c[i] == 1.0, t1, t0 + c[i] * h)
        _, back = jax.vjp(lambda moving, y: march.rate(t, y, args_of(moving)), moving, y)
        change, stage_bar = back(jax.tree.map(lambda k: h * k[i], K_bar))
        K_bar = jax.tree.map(lambda k, y: k + A[i].reshape(-1, *[1] * y.ndim) * y[None], K_bar, stage_bar)
        add = lambda old, new: jax.tree.map(jnp.add, old, new)  # noqa: E731
        return (add(moving_bar, change), add(y_bar, stage_bar), K_bar), None

    stages = small_call(lambda bars: lax.scan(stage, bars, jnp.arange(used), reverse=True)[0])
    return stages((moving_bar, y_bar, K_bar))[:2]
