"""Loads of rubbing surfaces: the solution N of `N = sum over patches |R0 + G (N + preload)|`, and its verdict."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..math import _square as square

#: Loads are smooth within this part of the largest of them, and within this many newtons.
_SMOOTH, _LEAST = 1e-6, 1e-9
#: Newton steps at most: patches whose load changes its sign may take a few, all others converge in three.
_MOST_STEPS = 20
#: Residual of the loads, of the largest, that counts as solved (double, single precision).
_SOLVED = {8: 1e-9, 4: 1e-4}
#: Squarings of the matrix whose spectral radius is asked: its 1024th power is right to a thousandth.
_SQUARINGS = 10
#: Unknowns that are eliminated without a loop.
_FEW = 4


class NormalLoads(NamedTuple):
    """Loads (n,) without the preload, NaN where they are not unique; the spectral radius () of their map, zero
    where nothing feeds back; and True () where they have one solution."""

    load: Array
    contraction: Array
    unique: Array


class _Map(NamedTuple):
    """The map from loads to loads: R0 (n, patches, 3), G (n, patches, 3, n), preload (n,) and the smooth length ()."""

    R: Array
    G: Array
    preload: Array
    smooth: Array

    def value(self, N):
        """Loads (n,) of loads N (n,)."""
        q = jnp.sum(self.patches(N) ** 2, axis=2)
        return jnp.sum(q * lax.rsqrt(q + self.smooth**2), axis=1)

    def patches(self, N):
        return self.R + self.G @ (N + self.preload)

    def slope(self, N):
        """Derivative (n, n) of `value`."""
        R = self.patches(N)
        q = jnp.sum(R * R, axis=2)
        s = q + self.smooth**2
        factor = (s + self.smooth**2) * lax.rsqrt(s) / s
        return jnp.einsum("npi,npie->ne", factor[:, :, None] * R, self.G)


def normal_loads(R, G, preload) -> NormalLoads:
    """The loads of R0 (n, patches, 3) and G (n, patches, 3, n).

    Newton's method starts at the loads without friction; derivatives are those of the implicit function.
    """
    largest = jnp.max(jnp.abs(lax.stop_gradient(R)), initial=0.0)
    smooth = (_SMOOTH * largest + _LEAST).astype(R.dtype)
    loads, fixed = _Map(R, G, preload, smooth), _Map(*lax.stop_gradient((R, G, preload, smooth)))
    eye = np.eye(len(R), dtype=R.dtype)
    start = fixed.value(jnp.zeros_like(preload))
    least = 4.0 * jnp.finfo(R.dtype).eps

    def step(carry):
        k, N, value, _ = carry
        N = N + solve_small(eye - fixed.slope(N), value - N)
        after = fixed.value(N)
        return k + 1, N, after, jnp.max(jnp.abs(after - N)) <= least * jnp.max(after)

    def goes_on(carry):
        return ~carry[3] & (carry[0] < _MOST_STEPS)

    def newton(_, N):
        return lax.while_loop(goes_on, step, (0, N, fixed.value(N), jnp.zeros((), bool)))[1]

    def tangent(linear, y):
        return solve_small(jax.jacobian(linear)(jnp.zeros_like(y)), y)

    N = lax.custom_root(lambda N: loads.value(N) - N, start, newton, tangent)
    solved = lax.stop_gradient(N)
    contraction = spectral_radius(fixed.slope(solved))
    missed = jnp.max(jnp.abs(fixed.value(solved) - solved)) <= _SOLVED[R.dtype.itemsize] * jnp.max(solved + smooth)
    unique = (contraction < 1.0) & missed & (jnp.min(solved) >= -smooth)
    # of the reactions themselves, so that no rounding makes a load negative
    return NormalLoads(jnp.where(unique, loads.value(N), jnp.nan), contraction, unique)


def solve_small(A, b):
    """Solution (n,) of A x = b: without pivots for a few unknowns, as A is near the unit matrix there."""
    n = len(b)
    if n > _FEW:
        return square.solve(A, b)
    A, b = [[A[i, j] for j in range(n)] for i in range(n)], [b[i] for i in range(n)]
    for k in range(n):
        for i in range(k + 1, n):
            factor = A[i][k] / A[k][k]
            A[i] = [x - factor * y for x, y in zip(A[i], A[k], strict=True)]
            b[i] = b[i] - factor * b[k]
    x: list = [None] * n
    for k in reversed(range(n)):
        x[k] = (b[k] - sum(A[k][j] * x[j] for j in range(k + 1, n))) / A[k][k]
    return jnp.stack(x)


def spectral_radius(C):
    """Spectral radius () of C (n, n), from above, by repeated squaring."""
    if len(C) == 1:
        return jnp.abs(C[0, 0])
    tiny = jnp.finfo(C.dtype).tiny

    def squared(_, carry):
        C, log, power = carry
        size = jnp.maximum(jnp.sqrt(jnp.sum(C * C)), tiny)
        C = C / size
        return C @ C, log + jnp.log(size) / power, 2.0 * power

    C, log, power = lax.fori_loop(0, _SQUARINGS, squared, (C, jnp.zeros((), C.dtype), jnp.ones((), C.dtype)))
    size = jnp.sqrt(jnp.sum(C * C))
    return jnp.where(size > 0.0, jnp.exp(log + jnp.log(jnp.maximum(size, tiny)) / power), 0.0)
