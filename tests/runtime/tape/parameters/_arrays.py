"""Primitives that move, add up and sort numbers."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from equinox.internal import nontraceable, unvmap_all, unvmap_any, unvmap_max
from jax import lax

from ._data import BEYOND_53, COMPLEX_CUBE, CUBE, EMPTY, K32, K64, SPECIAL, U32, WITH_NAN, B, W, X, Y, Z, of, varied

K_CUBE, U_CUBE = K32[:6].reshape(1, 2, 3), U32.reshape(2, 2, 2)
_EMPTY_CUBES = CUBE[:0], K_CUBE[:0], CUBE[:0] > 0, U_CUBE[:, :0], K64[:0].reshape(2, 0, 2)


def _reduced(primitive, *arrays):
    """A reduction over some axes, all and none of them."""
    return varied(primitive.bind, arrays, axes=((0,), (1,), (2,), (0, 2), (0, 1, 2), (1, 2), ())) if arrays else []


def _sums(function, *arrays):
    return varied(lambda x, axes: function(x, axes), arrays, axes=((0,), (1,), (2,), (0, 2), (0, 1, 2), ()))


def _cumulative(function):
    arrays = CUBE, WITH_NAN, K_CUBE, CUBE[:, :0]
    of_three = varied(function, arrays, axis=range(3), reverse=(False, True))
    return of_three + varied(function, (U32[:4].reshape(2, 2),), axis=range(2), reverse=(False, True))


def _argument(function):
    arrays = CUBE, WITH_NAN, CUBE > 0, K_CUBE, np.round(CUBE)
    return varied(function, arrays, axis=range(3), index_dtype=(np.int32, np.int64, np.uint32))


def _pads():
    choices = ((0, 0, 0), (1, 2, 0)), ((-1, 0, 0), (0, -2, 0)), ((-1, 2, 1), (3, -2, 2)), ((1, 1, 3), (-1, -1, 1))
    given = [(x, x.dtype.type(7)) for x in (X, Z, K32[:6].reshape(2, 3), X > 0)]
    inside = varied(lax.pad, given, padding_config=choices)
    return inside + varied(lax.pad, [(EMPTY, 7.0), (X[:, :1], 7.0)], padding_config=choices[::2])


def _sorts():
    ties, payload = np.array([2, 0, 1, 0, 2, 1]), np.arange(6.0)
    zeros = np.array([0.0, -0.0, np.nan, -np.nan, 1.0, -0.0])
    by_keys = functools.partial(lax.sort, num_keys=1)
    together = lambda *arrays: ((arrays, ()),)[0][0]
    yield from varied(lax.sort, (CUBE,), dimension=range(3), is_stable=(True, False))
    yield from of(lax.sort, SPECIAL, K32, U32, B, EMPTY, X[:, :1], np.round(Z[0]) + 0j)
    for keys in (1, 2, 3):
        yield lambda *x, keys=keys: lax.sort(x, num_keys=keys), (ties, ties[::-1] % 2, payload[::-1].copy())
    yield lambda *x: by_keys(x, is_stable=True), together(ties, payload)
    yield lambda *x: by_keys(x, is_stable=False), (ties + payload, payload)
    yield lambda *x: by_keys(x), (zeros, payload)
    yield lambda *x: by_keys(x), (Z[0], payload[:4])


ARRAYS = {
    "add_any": of(jax.grad(lambda x: jnp.sum(jnp.sin(x) * x)), X),
    "argmax": _argument(lax.argmax),
    "argmin": _argument(lax.argmin),
    "broadcast_in_dim": [
        *varied(lax.broadcast_in_dim, (X, Z, X > 0), shape=((2, 3, 4), (5, 3, 4)), broadcast_dimensions=((1, 2),)),
        *varied(lax.broadcast_in_dim, (X,), shape=((3, 2, 4),), broadcast_dimensions=((0, 2),)),
        *varied(lax.broadcast_in_dim, (X[:, 0],), shape=((3, 3),), broadcast_dimensions=((0,), (1,))),
        *varied(lax.broadcast_in_dim, (X[:, :1],), shape=((3, 4),), broadcast_dimensions=((0, 1),)),
    ],
    "concatenate": [
        *varied(lambda x, y, dimension: lax.concatenate([x, y, x], dimension), ((X, Y), (Z, W), (X > 0, Y > 0)),
                dimension=(0, 1)),
        (lambda x, y: lax.concatenate([x, y], 0), (EMPTY, X)),
        (lambda x, y: lax.concatenate([x, y], 1), (X[:, :0], X)),
        (lambda x: lax.concatenate([x], 1), (X,)),
    ],
    "copy": of(jnp.copy, X, Z, K32),
    **{name: _cumulative(getattr(lax, name)) for name in ("cumsum", "cumprod", "cummax", "cummin")},
    "device_put": of(jax.device_put, X, Z),
    "empty": of(lambda x: x + 0.0 * lax.empty((3, 4), float), X),
    "iota": [
        *[(lambda x, d=d, kind=kind: x * lax.broadcasted_iota(kind, (3, 4), d).astype(float), (X,))
          for d in (0, 1) for kind in (np.float64, np.int32, np.int64, np.uint32)],
        *of(lambda x: x + lax.broadcasted_iota(float, (4,), 0), X[0]),
        *of(lambda x: lax.broadcasted_iota(complex, (3, 4), 0) * x, Z),
    ],
    "optimization_barrier": [(lambda x, z: lax.optimization_barrier((x, z)), (X, Z))],
    "name": varied(lambda x, name: jax.ad_checkpoint.checkpoint_name(x, name), (X,), name=("a", "jaxmbs shown")),
    "nontraceable": of(lambda x: nontraceable(x, name="here"), X),
    "pad": _pads(),
    "reduce_and": _reduced(lax.reduce_and_p, CUBE > 0, K_CUBE, CUBE[:0] > 0),
    "reduce_or": _reduced(lax.reduce_or_p, CUBE > 0, K_CUBE, CUBE[:0] > 0),
    **{name: _sums(getattr(lax, name), CUBE, WITH_NAN, 0.0 * CUBE, K_CUBE, CUBE > 0, U_CUBE, *_EMPTY_CUBES)
       for name in ("reduce_max", "reduce_min")},
    "reduce_prod": _sums(lax.reduce_prod, CUBE, COMPLEX_CUBE, K_CUBE, U_CUBE, *_EMPTY_CUBES[:2]),
    "reduce_sum": _sums(lax.reduce_sum, CUBE, COMPLEX_CUBE, K_CUBE, U_CUBE, *_EMPTY_CUBES[:2], BEYOND_53[None, None]),
    "reshape": varied(lax.reshape, (CUBE, COMPLEX_CUBE), new_sizes=((24,), (4, 6)),
                      dimensions=(None, (2, 0, 1), (1, 2, 0))),
    "rev": varied(lax.rev, (X, Z), dimensions=((0,), (1,), (0, 1))),
    "slice": [(functools.partial(lax.slice, start_indices=start, limit_indices=end, strides=step), (x,))
              for x in (X, Z) for start, end, step in (
                  ((0, 0), (3, 4), None), ((1, 0), (3, 3), None), ((1, 0), (3, 4), None),
                  ((0, 1), (2, 4), (1, 2)), ((1, 1), (1, 3), None), ((0, 0), (3, 4), (2, 3)))],
    "sort": list(_sorts()),
    "split": [(functools.partial(lax.split, sizes=sizes, axis=axis), (x,)) for x in (X, Z)
              for sizes, axis in (((1, 3), 1), ((1, 2), 0), ((2, 1), 0), ((0, 3), 0), ((1, 1, 2), 1))],
    "squeeze": varied(lax.squeeze, (X[None, :1], Z[None, :1]), dimensions=((0,), (1,), (0, 1))),
    "stack": varied(lambda x, y, axis: jnp.stack([x, y], axis), ((X, Y), (Z, W)), axis=(0, 1, 2)),

    "tile": varied(jnp.tile, (X, Z), reps=((2, 1), (1, 3), (2, 2, 2))),
    "transpose": [
        *varied(lax.transpose, (CUBE,), permutation=((0, 1, 2), (2, 0, 1), (1, 0, 2), (2, 1, 0))),
        *varied(lax.transpose, (Z,), permutation=((1, 0),)),
    ],
    "unstack": varied(jnp.unstack, (X, Z), axis=(0, 1)),
    "unvmap_all": of(unvmap_all, X > 0),
    "unvmap_any": of(unvmap_any, X > 0),
    "unvmap_max": of(unvmap_max, K32, U32),
}  # fmt: skip
