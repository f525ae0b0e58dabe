"""Slices and updates at places known when the program runs, gathers and scatters."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ._data import BEYOND, BEYOND_53, CUBE, EMPTY, K32, K64, PLACES, RNG, U32, W, X, Y, Z, varied

_STARTS = np.array([[0, 0], [1, 2], [3, 1], [-1, 0], [2, 2]])
_UPDATES = RNG.normal(size=(5, 2, 2))
_CORNERS = [tuple(map(np.int64, corner)) for corner in ((0, 0), (1, 1), (5, -9), (-1, 2))]


def _get(x, i, **options):
    return x.at[i].get(**options)


def _windows(x, i, mode, fill_value=None, indices_are_sorted=False):
    """Windows (2, 2) of an array (3, 4), some of them moved too far."""
    numbers = lax.GatherDimensionNumbers(offset_dims=(1, 2), collapsed_slice_dims=(), start_index_map=(1, 0))
    options = {"mode": mode, "fill_value": fill_value, "indices_are_sorted": indices_are_sorted}
    return lax.gather(x, i, numbers, (2, 2), **options)


def _gathers():
    kinds = X, X > 0, K32, U32, K64, Z
    yield from varied(_get, [(array, BEYOND) for array in kinds], mode=("fill", "clip"))
    yield from varied(_get, [(X, PLACES), (X, np.array([0, 1, 2]))], mode=("fill", "promise_in_bounds"))
    yield from varied(_get, [(X, BEYOND), (Z, BEYOND)], mode=("fill",), fill_value=(None, 2.0, np.nan))
    yield from varied(_get, [(Z, BEYOND)], mode=("fill",), fill_value=(2.0 - 1j,))
    yield from varied(_get, [(K32, BEYOND)], mode=("fill",), fill_value=(None, 3))
    yield from varied(
        _get, [(X, np.array([0, 1, 2]))], indices_are_sorted=(False, True), unique_indices=(False, True)
    )
    yield from varied(_get, [(X, BEYOND)], wrap_negative_indices=(False, True))
    yield from varied(_windows, [(X, _STARTS), (X, _STARTS.astype(np.uint32))], mode=("fill", "clip"))
    yield from varied(_windows, [(X, _STARTS)], mode=("fill",), fill_value=(-1.0,))
    yield lambda i: jnp.ones((3, 4)).at[i].get(mode="fill"), (BEYOND,)
    yield lambda x, i: jax.vmap(lambda x, i: x.at[i].get(mode="fill"))(x, i), (X, BEYOND[:3])
    yield lambda x, i: jax.vmap(lambda x, i: x.at[i].get(mode="clip"), (1, 0))(x, i), (X, BEYOND)
    for mode in ("fill", "clip"):
        yield lambda x, mode=mode: x.at[np.array([5, 0])].get(mode=mode), (X,)
    yield lambda x, i: x.at[i].get(mode="fill"), (X, BEYOND[:0])
    yield lambda x, i: x[:, i, :, None], (CUBE, PLACES)
    yield lambda x, i: x[i, :, i], (CUBE, np.array([0, 1, 1]))


_TARGETS = [
    (X, BEYOND, Y[[0, 1, 2, 0]]),
    (X, np.array([1, 1, 2]), Y),
    (X, BEYOND, 0.3),
    (np.where(X > 1, np.nan, X), PLACES, np.where(Y < -1, np.nan, Y)),
    (np.arange(4), BEYOND, np.array([5, -7, 8, 2])),
    (K32[:4], np.array([1, 3, 3, 0]), np.array([2**31 - 1, 2**31 - 1, 3, -5], np.int32)),
    (U32[:4], np.array([1, 3, 3, 0]), U32[4:]),
    (X, BEYOND[:0], Y[:0]),
    (EMPTY, BEYOND, np.ones((4, 4))),
]


def _scatters(name, *more):
    def change(x, i, u, **options):
        return getattr(x.at[i], name)(u, **options)

    found = varied(change, _TARGETS, mode=("drop", "clip"))
    found += varied(change, [(X, PLACES, Y)], mode=("drop", "promise_in_bounds"), unique_indices=(False, True))
    found += varied(change, [(X, np.array([0, 1, 2]), Y)], indices_are_sorted=(False, True))
    found += [(lambda x, u: getattr(x.at[1:3, ::2], name)(u), (X, Y[:2, :2]))]
    found += [(lambda x, u: getattr(x.at[:, BEYOND], name)(u), (X, Y))]
    found += [(lambda x, i, u: jax.vmap(change)(x, i, u), (X, BEYOND[:3], Y[0, :3]))]
    return found + list(more)


def _complex(name):
    return varied(lambda x, i, u, mode: getattr(x.at[i], name)(u, mode=mode), [(Z, BEYOND, W[[0, 1, 2, 0]])],
                  mode=("drop", "clip"))  # fmt: skip


def _add_windows(x, i, u, mode):
    return lax.scatter_add(x, i, u, lax.ScatterDimensionNumbers((1, 2), (), (1, 0)), mode=mode)


def _twice(k):
    return k.at[jnp.array([0, 0])].add(k[1:3])


PLACED = {
    "dynamic_slice": varied(
        lax.dynamic_slice, [(x, corner) for x in (X, Z) for corner in _CORNERS],
        slice_sizes=((2, 3), (3, 4), (1, 1), (0, 2)),
    ),
    "dynamic_update_slice": [
        (lax.dynamic_update_slice, (x, part, corner))
        for x, part in ((X, Y[:2, 1:3]), (X, Y), (Z, W[:1, :3]), (X, Y[:0, :2]), (K32[:4, None], K32[4:5, None]))
        for corner in _CORNERS
    ],
    "gather": list(_gathers()),
    "scatter": _scatters(
        "set", *_complex("set"), (lambda x, i: x.at[i].apply(jnp.sin), (X, BEYOND)),
        (lambda x: x.at[1].apply(jnp.exp), (X,)), (lambda x: x.at[:, 1].apply(jnp.conj), (Z,)),
    ),
    "scatter-add": _scatters(
        "add", *_complex("add"), *varied(_add_windows, [(X, _STARTS, _UPDATES)], mode=("clip", "drop")),
        (_twice, (BEYOND_53,)), (_twice, (K64,)),
    ),
    "scatter-sub": _scatters("subtract"),
    "scatter-mul": _scatters("multiply"),
    "scatter-min": _scatters("min"),
    "scatter-max": _scatters("max"),
}  # fmt: skip
