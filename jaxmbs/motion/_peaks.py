"""`peak`: the largest value of a quantity along a motion, found between the saved times."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..assembly._state import State
from ..assembly._state_report import state_quantities
from ..kinematics._poses import node_parameters
from ..model._entry_points import check_state
from ..model._system import System
from ..ode._loop import stop_gradients
from ..quantities import entries
from ..reports import Report, Reported
from ..runtime import as_argument, jit, map_chunked
from ._interpolation import Knots, between, knots_of
from ._motion import Motion, pieces_of

_STEPS = 12  # each second one cuts the bracket by the golden section, the others end quadratically
_GOLDEN = 0.3819660112501051


class Peak(Reported, eqx.Module):
    """The largest value of a quantity (...), its time [s] (...) and the state then (leading axes ...)."""

    value: Float[Array, "..."]
    time: Float[Array, "..."]
    state: State

    def report(self) -> Report:
        found = [entries("value", self.value), entries("time", self.time, "s")]
        return Report([*found, *(state_quantities(self.state) if np.ndim(self.value) == 0 else [])])


def peak(system: System, motion: Motion, quantity: Callable[[State], Array]) -> Peak:
    """The largest value of a quantity along a motion and when it occurs.

    The largest saved value and its two neighbours enclose the peak.  States between them come from quintic
    polynomials through coordinates, rates and accelerations, with all constraints closed again; their error falls
    with the fifth power of the saving interval.  Both sides of events that acted, and of samples, count as saved.  A
    peak that shows at no such time is not found.

    Args:
        motion: one motion (`jax.vmap` for many).
        quantity: takes one State to a scalar or an array, of which every entry has its own peak; for example
            `lambda s: jnp.linalg.norm(reactions(system, s)["main"].force)`.  For the least value give its negative.

    Returns: Peak, nan where the motion failed.  All of it has derivatives: of a peak inside the motion the time moves
        so that the slope there stays zero, at an end of the motion it is the time of that end.

    Raises: ValueError for a batch of motions; ModelError for the motion of another system.
    """
    check_one_motion(system, motion)
    pieces = pieces_of(system, motion)
    return _peak(system, pieces, as_argument(quantity, _shapes(motion)), pieces is not motion)


def check_one_motion(system: System, motion: Motion) -> None:
    """Raises: ValueError for a batch of motions; ModelError for the motion of another system."""
    if motion.ts.ndim != 1:
        raise ValueError(f"peak takes one motion, use jax.vmap for many; the times have shape {motion.ts.shape}")
    check_state(system, motion.states)


@jit(compile="tape")
def _peak(system, motion, quantity, has_jumps):
    """One program, with the quantity in it twice: at the saved states, and in the search between them."""
    state = _shapes(motion)
    shape = jax.eval_shape(lambda x: quantity(x), state).shape
    # the quantity may know traced numbers by itself, such as those of a system: they become arguments
    entries = eqx.filter_closure_convert(lambda state: jnp.reshape(quantity(state), -1), state)
    values = map_chunked(stop_gradients(entries), stop_gradients(motion.states))
    used = jnp.isfinite(motion.ts)  # after an event nothing is saved
    best, last = jnp.argmax(jnp.where(used[:, None], values, -jnp.inf), axis=0), jnp.sum(used) - 1
    P = node_parameters(system)

    def one(entry, i):
        index = jnp.clip(i + jnp.arange(-1, 2), 0, last)
        knots = knots_of(system, jax.tree.map(lambda x: x[index], motion.states))
        at_end = (i == 0) | (i == last)
        if has_jumps:  # the two sides of a jump have the same time: the peak may be on either, as at an end
            at_end = at_end | jnp.any(jnp.diff(knots.t) <= 0.0)
        return _peak_near(_Interpolated(system, P, knots, entries, entry), values[index, entry], at_end)

    found = jax.vmap(one)(jnp.arange(values.shape[1]), best)
    found = jax.tree.map(lambda x: jnp.where(motion.ok, x, jnp.nan).reshape(shape + x.shape[1:]), found)
    return Peak(*found)


def _shapes(motion):
    """One state of a motion, without its numbers."""
    return eqx.filter_eval_shape(lambda motion: motion[0], motion)


class _Interpolated(eqx.Module):
    """An entry () of a quantity as a function of the time between three knots."""

    system: System
    P: Array
    knots: Knots
    entries: Callable
    entry: Array

    def state(self, t):
        k = jnp.where(t < self.knots.t[1], 0, 1)
        return between(self.system, self.P, self.knots.number(k), self.knots.number(k + 1), t)

    def value(self, t):
        state = self.state(t)
        return self.entries(state)[self.entry], state

    def slope(self, t):
        """(slope of the value by the time, value, state, its rate, None of what does not depend on the time)."""
        (value, state), (slope, rate) = eqx.filter_jvp(self.value, (t,), (jnp.ones_like(t),))
        slope = jnp.zeros_like(value) if slope is None else slope
        return slope, value, state, rate


@eqx.filter_custom_jvp
def _peak_near(function, values, at_end):
    """(value, time, State) of the maximum of an `_Interpolated` with `values` at its knots, the middle largest."""
    time, value = _maximise(lambda t: function.value(t)[0], function.knots.t, values)
    return value, time, function.state(time)


@_peak_near.def_jvp
def _peak_near_jvp(primals, tangents):
    """The slope by the time stays zero inside the motion, so that the value moves with the time of an end alone."""
    function, values, at_end = primals
    value, time, state = found = _peak_near(*primals)
    at_end, knot_dot = at_end & (time == function.knots.t[1]), tangents[0].knots.t
    bend = jax.jvp(lambda t: function.slope(t)[0], (time,), (jnp.ones_like(time),))[1]
    there, moved = eqx.filter_jvp(lambda function: function.slope(time), (function,), (tangents[0],))
    end_dot = jnp.zeros_like(time) if knot_dot is None else knot_dot[1]
    time_dot = jnp.where(at_end, end_dot, -moved[0] / jnp.where(bend == 0.0, jnp.nan, bend))
    value_dot = moved[1] + jnp.where(at_end, there[0] * end_dot, 0.0)

    def along(x, dot, rate):  # at a fixed time the time itself does not move
        moved = None if rate is None else rate * time_dot
        return dot if moved is None else moved if dot is None else dot + moved

    state_dot = jax.tree.map(along, state, moved[2], there[3])
    return found, (value_dot, time_dot, state_dot)


def _maximise(function, t, values):
    """(time, value) of the maximum of a function between t[0] and t[2] (3,), where it has the values (3,), the middle
    largest.

    A bracket of three points is narrowed in turn by the vertex of their parabola and by the golden section.
    """

    def step(bracket, parabolic):
        (a, b, c), (fa, fb, fc) = bracket
        golden = jnp.where(c - b > b - a, b + _GOLDEN * (c - b), b - _GOLDEN * (b - a))
        vertex = _vertex(*bracket)
        usable = parabolic & (vertex > a) & (vertex < c) & (vertex != b)
        t = jnp.where(usable, vertex, golden)
        low, high = jnp.minimum(t, b), jnp.maximum(t, b)
        f = function(t)
        f_low, f_high = jnp.where(t < b, f, fb), jnp.where(t < b, fb, f)
        left = f_low >= f_high  # the maximum lies between a and high, else between low and c
        times = jnp.where(left, jnp.stack([a, low, high]), jnp.stack([low, high, c]))
        return (times, jnp.where(left, jnp.stack([fa, f_low, f_high]), jnp.stack([f_low, f_high, fc]))), None

    turns = jnp.arange(_STEPS) % 2 == 1
    (times, values), _ = lax.scan(step, (t, values), turns)
    return times[1], values[1]


def _vertex(t, f):
    """Time of the vertex of the parabola through three points; not finite where there is none."""
    left, right = t[1] - t[0], t[2] - t[1]
    p, q = right * (f[1] - f[0]), left * (f[1] - f[2])
    return t[1] + 0.5 * (right * p - left * q) / (p + q)
