"""`peak`: the largest value of a quantity along a motion, found between the saved times."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..kinematics._poses import node_parameters
from ..kinematics._state import State
from ..model._entry_points import check_state
from ..model._system import System
from ..ode._loop import stop_gradients
from ._interpolation import between, knots_of
from ._motion import Motion

_STEPS = 12  # each second one cuts the bracket by the golden section, the others end quadratically
_GOLDEN = 0.3819660112501051


class Peak(eqx.Module):
    """The largest value of a quantity (...), its time [s] (...) and the state then (leading axes ...)."""

    value: Float[Array, "..."]
    time: Float[Array, "..."]
    state: State


def peak(system: System, motion: Motion, quantity: Callable[[State], Array]) -> Peak:
    """The largest value of a quantity along a motion and when it occurs.

    The largest saved value and its two neighbours enclose the peak.  States between them come from quintic
    polynomials through coordinates, rates and accelerations, with all constraints closed again; their error falls
    with the fifth power of the saving interval.  A peak that shows at no saved time is not found.

    Args:
        motion: one motion (`jax.vmap` for many).
        quantity: takes one State to a scalar or an array, of which every entry has its own peak; for example
            `lambda s: jnp.linalg.norm(reactions(system, s)["main"].force)`.  For the least value give its negative.

    Returns: Peak, nan where the motion failed.  All of it has derivatives: of a peak inside the motion the time moves
        so that the slope there stays zero, at an end of the motion it is the time of that end.

    Raises: ValueError for a batch of motions.
    """
    if motion.ts.ndim != 1:
        raise ValueError(f"peak takes one motion, use jax.vmap for many; the times have shape {motion.ts.shape}")
    check_state(system, motion.states)
    values = jax.vmap(quantity)(motion.states)
    shape, values = values.shape[1:], values.reshape(values.shape[0], -1)
    used = jnp.isfinite(motion.ts)  # after an event nothing is saved
    best = jnp.argmax(jnp.where(used[:, None], lax.stop_gradient(values), -jnp.inf), axis=0)
    last = jnp.sum(used) - 1

    def one(entry, i):
        index = jnp.clip(i + jnp.arange(-1, 2), 0, last)
        states = jax.tree.map(lambda x: x[index], motion.states)
        at_end = (i == 0) | (i == last)
        return _peak_near(system, states, values[index, entry], quantity, entry, at_end)

    found = jax.vmap(one)(jnp.arange(values.shape[1]), best)
    found = jax.tree.map(lambda x: jnp.where(motion.ok, x, jnp.nan).reshape(shape + x.shape[1:]), found)
    return Peak(*found)


def _peak_near(system, states, values, quantity, entry, at_end):
    """(value, time, State) of the largest entry of the quantity between three states, the middle one largest."""
    knots = knots_of(system, states)
    parts = system, node_parameters(system), knots

    def at(parts, t):
        k = jnp.where(t < parts[2].t[1], 0, 1)
        state = between(*parts[:2], parts[2].number(k), parts[2].number(k + 1), t)
        return jnp.reshape(quantity(state), -1)[entry], state

    frozen = stop_gradients(parts)
    found = _maximise(lambda t: at(frozen, t)[0], *lax.stop_gradient((knots.t, values)))
    at_end, middle = at_end & (found == knots.t[1]), knots.t[1]
    # the quantity may know traced numbers by itself, such as those of a system: they become arguments of the rule
    open_ = eqx.filter_closure_convert(lambda parts, t: at(parts, t)[0], parts, found)
    time = jnp.where(at_end, middle, _still(found, parts, open_))
    # the slope is zero inside the motion, so that the value moves with the time of an end alone
    value = at(parts, jnp.where(at_end, middle, found))[0]
    return value, time, at(parts, time)[1]


@eqx.filter_custom_jvp
def _still(t, parts, function):
    """The time t where `function(parts, t)` is largest; it moves so that the slope by the time stays zero."""
    return t


@_still.def_jvp
def _still_jvp(primals, tangents):
    t, parts, function = primals

    def slope(function, parts, t):
        return jax.jvp(lambda t: function(parts, t), (t,), (jnp.ones_like(t),))[1]

    bend = jax.jvp(lambda t: slope(function, parts, t), (t,), (jnp.ones_like(t),))[1]
    turned = eqx.filter_jvp(lambda f, parts: slope(f, parts, t), (function, parts), (tangents[2], tangents[1]))[1]
    return t, -turned / jnp.where(bend == 0.0, jnp.nan, bend)


def _maximise(function, t, values):
    """Time of the maximum of a function between t[0] and t[2] (3,), where it has the values (3,), the middle largest.

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
    return lax.scan(step, (t, values), turns)[0][0][1]


def _vertex(t, f):
    """Time of the vertex of the parabola through three points; not finite where there is none."""
    left, right = t[1] - t[0], t[2] - t[1]
    p, q = right * (f[1] - f[0]), left * (f[1] - f[2])
    return t[1] + 0.5 * (right * p - left * q) / (p + q)
