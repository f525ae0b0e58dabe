"""Random programs: operations of random numbers, shapes and types, in loops, branches, lanes and derivatives too."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

_AXES = (0, 1, 3, 4)
_OF_NUMBERS = (
    *(jnp.sin, jnp.tanh, jnp.abs, jnp.sign, jnp.square, jnp.negative, lax.logistic, jnp.cumsum, jnp.sort, jnp.ravel),
    *(lambda x: x[..., ::-1], lambda x: jnp.exp(-jnp.abs(x)), jnp.floor, lambda x: x.astype(int).astype(float)),
    *(lambda x: jnp.sum(x, axis=-1, keepdims=True), lambda x: jnp.max(x, initial=-9.0), jnp.transpose),
    *(lambda x: jnp.pad(x, [(1, 0)] * x.ndim, constant_values=0.5), lambda x: x[None]),
    *(lambda x: jnp.real(jnp.sqrt(x + 0j)), lambda x: jnp.repeat(x, 2, -1), lambda x: jnp.roll(x, 1)),
    *(lambda x: lax.map(jnp.sin, x), lambda x: jnp.argsort(x).astype(float), lambda x: jnp.nan_to_num(1.0 / x)),
    *(lambda x: lax.fori_loop(0, 3, lambda k, c: 0.5 * c + k, x), lambda x: x),
    *(lambda x: jnp.cumsum(x[::-1])[::-1], lambda x: jnp.fft.fft(x).imag, lambda x: (x * (1 + 2j)).imag),
)  # fmt: skip
_OF_TWO = (
    *(jnp.add, jnp.subtract, jnp.multiply, jnp.divide, jnp.maximum, jnp.minimum, jnp.arctan2, jnp.remainder),
    *(lambda x, y: jnp.where(x > y, x, y), lambda x, y: jnp.where(x == y, 1.0, x), lambda x, y: jnp.clip(x, -1.0, y)),
)
_OF_FLOATS_AND_WHOLE = (
    *(lambda x, k: x.at[k].get(mode="fill"), lambda x, k: x.at[k].get(mode="clip"), lambda x, k: x.at[k].add(1.5)),
    *(lambda x, k: x.at[k].set(0.5), lambda x, k: x.at[k].max(0.2), lambda x, k: x.at[k].multiply(2.0, mode="clip")),
    *(lambda x, k: lax.switch(k.sum() % 3, [lambda x: x, jnp.sin, lambda x: 2.0 * x], x),),
    *(lambda x, k: lax.dynamic_index_in_dim(x, k.sum(), keepdims=False), lambda x, k: x * k.sum()),
    *(lambda x, k: lax.while_loop(lambda c: c[0] < k.max() % 5, lambda c: (c[0] + 1, 0.5 * c[1]), (0, x))[1],),
)
_OF_WHOLE = (
    *(
        lambda k: k + 1,
        lambda k: k * 3,
        lambda k: -k,
        lambda k: k // 2,
        lambda k: k % 3,
        lambda k: k & 5,
        lambda k: ~k,
    ),
    *(
        lambda k: jnp.cumsum(k),
        jnp.sort,
        lambda k: lax.div(k, jnp.full_like(k, -2)),
        jnp.abs,
        lambda k: k.astype(np.int32),
    ),
    *(lambda k: lax.rem(k, jnp.full_like(k, -2)), lambda k: k.astype(np.uint32) - 7, lambda k: jnp.ravel(k)[:4]),
)


def random_program(seed: int, length: int = 12):
    """A function of two arrays of doubles and one of whole numbers, and these."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.choice(_AXES, rng.integers(1, 3), p=(0.05, 0.25, 0.35, 0.35)))
    special = rng.choice([np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0, 2.5], shape)
    args = [np.where(rng.random(shape) < 0.15 * rng.integers(2), special, rng.normal(size=shape)) for _ in range(2)]
    kinds = rng.integers(0, 5, length)
    choices = rng.random((length, 3))

    def function(x, y, k):
        floats, whole = [x, y], [k]
        for kind, (which, first, second) in zip(kinds, choices, strict=True):
            pick = lambda items, at: items[int(at * len(items))]
            if kind == 4:
                found = _tried(pick(_OF_WHOLE, which), pick(whole, first))
                whole += [] if found is None else [found]
                continue
            operands = (pick(floats, first), pick(floats, second))
            if kind == 3:
                found = _tried(pick(_OF_FLOATS_AND_WHOLE, which), operands[0], pick(whole, second))
            elif kind == 2:
                found = _tried(pick(_OF_TWO, which), *operands)
            else:
                found = _tried(pick(_OF_NUMBERS, which), operands[0])
            floats += [] if found is None else [found]
        return floats[2:] + whole[1:]

    return function, (*args, rng.integers(-4, 6, 3))


def _tried(function, *args):
    """The result, None where the shapes do not fit or grow too large."""
    try:
        found = jax.eval_shape(function, *args)
    except (TypeError, ValueError, IndexError, ZeroDivisionError):
        return None
    if found.size > 300 or found.ndim > 3:
        return None
    return function(*args)


def in_a_scan(function):
    """The program as the body of a scan over rows, which carries the sum of what it finds."""

    def turns(x, y, k):
        def turn(c, row):
            found = function(x + 1e-3 * c, y, k + row)
            return c + sum(jnp.nan_to_num(jnp.sum(f), posinf=1.0, neginf=1.0) % 1.0 for f in found[:3]), found

        return lax.scan(turn, 0.0, jnp.arange(3))

    return turns


def in_lanes(function):
    """Three lanes of it, each with whole numbers of its own."""
    return lambda x, y, k: jax.vmap(lambda k: function(x, y, k))(jnp.stack([k, k + 1, -k]))


def slope(function):
    """The gradient of the sum of its doubles by the first array."""

    def total(x, y, k):
        return sum(jnp.sum(jnp.where(jnp.isfinite(f), f, 0.0)) for f in function(x, y, k) if f.dtype == np.float64)

    def by_the_way_that_loops_have(*args):
        try:
            return jax.grad(total)(*args)
        except ValueError:  # loops of unknown length
            return jax.jacfwd(total)(*args)

    return by_the_way_that_loops_have
