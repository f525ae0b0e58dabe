"""Loads of rubbing surfaces: the solution N of `N = sum over patches |R0 + G (N + preload)|`, and its verdict."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..math import _square as square
from ..math._linalg import few_columns

#: Loads are smooth within this part of the largest of them, and within this many newtons.
_SMOOTH, _LEAST = 1e-6, 1e-9
#: Newton steps at most: patches whose load changes its sign may take a few, all others converge in three.
_MOST_STEPS = 20
#: Residual of the loads, of the largest, that counts as solved (double, single precision).
_SOLVED = {8: 1e-9, 4: 1e-4}
#: Squarings of the matrix whose spectral radius is asked: its 256th power gives that to a quarter per cent.
_SQUARINGS = 8
#: Newton steps to the complex loads of a jam.
_STEPS_IN_JAM = 40
#: Unknowns that are eliminated without a loop.
_FEW = 4


class LoadMap(NamedTuple):
    """The map from loads to loads: R0 (rows,), G (rows, n), preload (n,), and the smooth length (); static matrices
    from rows to patches (patches, rows) and from patches to surfaces (n, patches)."""

    R: Array
    G: Array
    preload: Array
    smooth: Array
    patches: np.ndarray
    surfaces: np.ndarray

    @classmethod
    def of(cls, R, G, preload, patches, surfaces) -> "LoadMap":
        """The map with its smooth length."""
        smooth = _SMOOTH * jnp.max(jnp.abs(lax.stop_gradient(R)), initial=0.0) + _LEAST
        return cls(R, G, preload, smooth, patches.astype(R.dtype), surfaces.astype(R.dtype))

    def fixed(self) -> "LoadMap":
        """The map without derivatives."""
        R, G, preload, smooth = lax.stop_gradient((self.R, self.G, self.preload, self.smooth))
        return LoadMap(R, G, preload, smooth, self.patches, self.surfaces)

    def components(self, N):
        """Components (rows,) of the loads of the patches at loads N (n,)."""
        return self.R + jnp.sum(self.G * (N + self.preload)[None], axis=1)

    def value(self, N):
        """Loads (n,) of loads N (n,)."""
        return self.sizes(self.components(N))

    def sizes(self, R):
        """Loads (n,) of components R (rows,)."""
        q = jnp.sum(self.patches * (R * R)[None], axis=1)
        return jnp.sum(self.surfaces * (q * lax.rsqrt(q + self.smooth**2))[None], axis=1)

    def value_and_slope(self, N):
        """`value`, and its derivative (n, n)."""
        R = self.components(N)
        q = jnp.sum(self.patches * (R * R)[None], axis=1)
        s = q + self.smooth**2
        root = lax.rsqrt(s)
        factor = (s + self.smooth**2) * root / s
        along = (self.surfaces[:, :, None] * factor[None, :, None] * self.patches[None]).sum(1) * R[None]
        return jnp.sum(self.surfaces * (q * root)[None], axis=1), jnp.sum(along[:, :, None] * self.G[None], axis=1)


class NormalLoads(NamedTuple):
    """Loads (n,) without the preload, NaN where they are not unique; the derivative (n, n) of their map there; True
    () where they have one solution; and the map."""

    load: Array
    slope: Array
    unique: Array
    map: LoadMap


def normal_loads(loads: LoadMap) -> NormalLoads:
    """The loads that the map takes to themselves.

    Newton's method starts at the loads without friction; derivatives are those of the implicit function.
    """
    fixed, dtype = loads.fixed(), loads.R.dtype
    eye = np.eye(len(loads.preload), dtype=dtype)
    least = 4.0 * jnp.finfo(dtype).eps

    def step(carry):
        k, N, value, slope, _ = carry
        N = N + solve_small(eye - slope, value - N)
        value, slope = fixed.value_and_slope(N)
        return k + 1, N, value, slope, jnp.max(jnp.abs(value - N)) <= least * jnp.max(value)

    def newton(_, N):
        # the first step, of no slope and no residual, evaluates the start: so both are traced once
        start = (0, N, N, jnp.zeros_like(eye), jnp.zeros((), bool))
        _, N, value, slope, _ = lax.while_loop(lambda carry: ~carry[4] & (carry[0] <= _MOST_STEPS), step, start)
        return N, (value, slope)

    def tangent(linear, y):
        return square.solve(jax.jacobian(linear)(jnp.zeros_like(y)), y)

    start = fixed.sizes(fixed.R)  # without friction
    N, (value, slope) = lax.custom_root(lambda N: loads.value(N) - N, start, newton, tangent, has_aux=True)
    value, slope = lax.stop_gradient((value, slope))
    left = value - lax.stop_gradient(N)
    solved = jnp.max(jnp.abs(left)) <= _SOLVED[dtype.itemsize] * jnp.max(value + fixed.smooth)
    unique = contracts(slope) & solved
    # the value in place of N, which rounding may make negative
    return NormalLoads(jnp.where(unique, N + left, jnp.nan), slope, unique, fixed)


def solve_small(A, b):
    """Solution (n,) of A x = b: without pivots for a few unknowns, as A is near the unit matrix there."""
    n = len(b)
    if n > _FEW:
        return square.solve(A, b)
    rows, unit = jnp.concatenate([A, b[:, None]], axis=1), np.eye(n, dtype=A.dtype)
    for k in range(n):  # Gauss and Jordan: column k becomes that of the unit matrix, in two kernels
        rows = rows - (rows[:, k] - unit[k])[:, None] * (rows[k] / rows[k, k])[None]
    return rows[:, n]


def contracts(C):
    """True () where the spectral radius of C (n, n) is below one: where a power of it has a norm below one."""
    if len(C) == 1:
        return jnp.abs(C[0, 0]) < 1.0

    def is_open(carry):
        return ~(_norm(carry[1]) < 1.0) & (carry[0] < _SQUARINGS)  # true for what is not a number

    def squared(carry):
        return carry[0] + 1, few_columns(carry[1], carry[1])

    return _norm(lax.while_loop(is_open, squared, (0, C))[1]) < 1.0


def _norm(C):
    return jnp.sqrt(jnp.sum((C * C.conj()).real if jnp.iscomplexobj(C) else C * C))


def contraction(found: NormalLoads):
    """Spectral radius () of the derivative of the loads by the loads; of a jam at the solution that goes on from the
    last one, whose loads are negative or complex: one or more, NaN where none is found."""
    jam = spectral_radius(_slope_in_jam(found.map))
    return jnp.where(found.unique, spectral_radius(found.slope), jnp.where(jam >= 1.0, jam, jnp.nan))


def _slope_in_jam(loads: LoadMap):
    """The derivative (n, n) of the map at its complex solution; NaN where none is found.

    `|R|` goes on as the root of `R . R` with the phase of its load.
    """
    start = loads.sizes(loads.R) + loads.smooth
    number = lax.complex(start, start).dtype
    eye, patches, surfaces = (x.astype(number) for x in (np.eye(len(start)), loads.patches, loads.surfaces))
    R0, G, preload = (x.astype(number) for x in (loads.R, loads.G, loads.preload))

    def value_and_slope(N):
        R = R0 + jnp.sum(G * (N + preload)[None], axis=1)
        own = jnp.sum(surfaces * N[:, None], axis=0)
        root = jnp.sqrt(jnp.sum(patches * (R * R)[None], axis=1))
        root = jnp.where((own.conj() * root).real < 0.0, -root, root)
        along = (surfaces[:, :, None] * (1.0 / root)[None, :, None] * patches[None]).sum(1) * R[None]
        return jnp.sum(surfaces * root[None], axis=1), jnp.sum(along[:, :, None] * G[None], axis=1)

    def step(_, N):
        value, slope = value_and_slope(N)
        return N + square.solve(eye - slope, value - N)

    N = lax.fori_loop(0, _STEPS_IN_JAM, step, lax.complex(0.3 * start, start))
    value, C = value_and_slope(N)
    solved = jnp.max(jnp.abs(value - N)) <= _SOLVED[start.dtype.itemsize] * jnp.max(jnp.abs(N))
    return jnp.where(solved, C, jnp.nan)


def spectral_radius(C):
    """Spectral radius () of C (n, n), from above; zero where a power of it is zero."""
    power, logarithm, is_zero = C, jnp.zeros((), C.real.dtype), jnp.zeros((), bool)
    for k in range(_SQUARINGS + 1):
        if k:
            power = few_columns(power, power)
        size = _norm(power)
        is_zero = is_zero | (size == 0.0)
        size = jnp.where(is_zero, 1.0, size)
        power = power / size.astype(power.dtype)  # so that no power leaves the range of numbers
        logarithm = logarithm + jnp.log(size) / 2**k
    return jnp.where(is_zero, 0.0, jnp.exp(logarithm))
