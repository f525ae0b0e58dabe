"""Rainflow pairing of samples (ASTM E1049-85, 5.4.4): a stack, as one loop."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from ..runtime import small_call


class Pairing(NamedTuple):
    """Pairs of samples that make a cycle, one in each entry whose count is not zero.

    Attributes:
        first, second: (entries,) indices of the samples, int32.
        counts: (entries,) 1 for a cycle, 0.5 for half a cycle, 0 for none.
    """

    first: jax.Array
    second: jax.Array
    counts: jax.Array


class _Stack(NamedTuple):
    """Turning points that wait for their partners: the last three, the two below them, and (samples,) all below.

    A step writes into what lies below before it reads there: so the loop changes it in place, however deep it is.
    """

    next: jax.Array  # the sample to be read
    size: jax.Array
    top: tuple[jax.Array, jax.Array, jax.Array]  # values of the last three, the latest at the end
    at: tuple[jax.Array, jax.Array, jax.Array]  # their samples
    under: tuple[jax.Array, jax.Array]  # values of the two that move up when a cycle leaves
    under_at: tuple[jax.Array, jax.Array]
    values: jax.Array
    places: jax.Array


def pair_samples(signal: jax.Array) -> Pairing:
    """Pairs of a signal (samples,), constants to differentiation; ranges still open at its end are half cycles."""
    signal = lax.stop_gradient(signal)
    last, pairs = small_call(_all_steps)(signal)
    return _with_residue(last, pairs, signal.dtype)


def _all_steps(signal):
    zero, one = jnp.int32(0), jnp.int32(1)
    none = jnp.zeros((), signal.dtype)
    stack = _Stack(
        next=one,
        size=one,
        top=(none, none, signal[0]),
        at=(zero, zero, zero),
        under=(none, none),
        under_at=(zero, zero),
        values=jnp.zeros(len(signal), signal.dtype),
        places=jnp.zeros(len(signal), jnp.int32),
    )
    # each step reads a sample or takes a pair away, which is one point less: there are no more than these
    return lax.scan(lambda s, _: _step(s, signal), stack, length=2 * len(signal))


def _step(s, signal):
    """A pair leaves the stack, or a sample comes to it; at the end of the signal nothing is done."""
    a, b, c = s.top
    closes = (s.size >= 3) & (jnp.abs(c - b) >= jnp.abs(b - a))
    half = closes & (s.size == 3)  # the range begins at the first point of the history
    full = closes & ~half
    reads = ~closes & (s.next < len(signal))
    x = signal[jnp.minimum(s.next, len(signal) - 1)]
    same_way = jnp.where(s.size >= 2, (x - c) * (c - b) >= 0, x == c)  # the last point is no turning point
    push = reads & ~same_way
    size = jnp.where(half, 2, jnp.where(full, s.size - 2, s.size + push.astype(jnp.int32)))
    values, places = _spill(s, s.values, a, push), _spill(s, s.places, s.at[0], push)
    after = _Stack(
        next=s.next + reads.astype(jnp.int32),
        size=size,
        top=_shift(s.top, s.under, full, push, jnp.where(reads, x, c)),
        at=_shift(s.at, s.under_at, full, push, jnp.where(reads, s.next, s.at[2])),
        under=_under(size, values),
        under_at=_under(size, places),
        values=values,
        places=places,
    )
    twice = jnp.where(half, 1, jnp.where(full, 2, 0)).astype(jnp.int32)
    return after, (s.at[0], s.at[1], twice)


def _under(size, below):
    """The two points that move up when a cycle leaves a stack of a size."""
    high, low = jnp.maximum(size - 4, 0), jnp.maximum(size - 5, 0)
    return below[low], below[high]


def _shift(top, under, full, push, new):
    a, b, c = top
    return (
        jnp.where(full, under[0], jnp.where(push, b, a)),
        jnp.where(full, under[1], jnp.where(push, c, b)),
        new,
    )


def _spill(s, below, value, push):
    """The stack below its last three with one more, where a point came to three."""
    place = jnp.where(push & (s.size >= 3), s.size - 3, len(below))
    return below.at[place].set(value, mode="drop")


def _with_residue(s, pairs, dtype):
    """The pairs with those of neighbours that are left on the stack, half a cycle each."""
    points = jnp.concatenate([s.places, jnp.zeros(3, jnp.int32)])
    k = jnp.arange(len(points), dtype=jnp.int32)
    for j in range(3):  # the last three points follow those below
        points = jnp.where(k == s.size - 3 + j, s.at[j], points)
    is_open = (k[1:] < s.size).astype(jnp.int32)
    first, second = (jnp.where(is_open > 0, p, 0) for p in (points[:-1], points[1:]))
    first, second, twice = (jnp.concatenate(both) for both in zip(pairs, (first, second, is_open), strict=True))
    return Pairing(first, second, 0.5 * twice.astype(dtype))
