"""Wrenches of bonds that balance the loads, respect the free directions and have the least compliance.

The conditions are, for wrenches w, efforts mu against the free twists F and twists u of the bodies,

    C w + F mu - I_E^T u = deformation,    F^T w = effort,    I_E w = loads,

solved with C + F rho F^T in place of C and proximal iterations on one factor, which work alike for determined,
redundant and movable networks.  Derivatives are those of the conditions themselves.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math.linalg import small_matmul
from .bonds import Bonds
from .loops import along_chains, choose, in_series, to_bonds
from .reduction import series_reduction
from .tree import across_bonds, on_bodies, tree_twists, tree_wrenches

#: Each round starts from exact equilibrium and gains what the penalty is worth; long rows of loops need many.
_ROUNDS = 60
#: Gap along the free twists, of the largest wrench, that is closed (double, single).
_SMALL = {8: 1e-14, 4: 1e-6}


class _Conditions(eqx.Module):
    """World arrays of the bonds about one origin: C (q, 6, 6), F (q, 6, f), penalty (q, f), unit (q, f) of each free
    twist, zero where there is none.

    Bonds outside all loops have no free twists here: equilibrium alone determines them.
    """

    C: jax.Array
    F: jax.Array
    penalty: jax.Array
    unit: jax.Array


def _conditions(bonds, solver):
    axes, L = bonds.twist_axes, bonds.length
    C = small_matmul(lax.optimization_barrier(small_matmul(axes, bonds.compliance)), jnp.swapaxes(axes, 1, 2))
    weight = jnp.concatenate([jnp.full(3, L**2), jnp.ones(3, L.dtype)])
    weakest = jnp.max(jnp.diagonal(bonds.compliance, axis1=1, axis2=2) * weight[None])
    size = bonds.free_sizes()
    used = size > 0.0
    unit = jnp.where(used, lax.rsqrt(jnp.where(used, size, 1.0)), 0.0)
    penalty = solver.penalty[L.dtype.itemsize] * weakest * unit * unit
    looped = np.abs(series_reduction(bonds.network).sign)
    F = small_matmul(axes, bonds.free) * jnp.asarray(looped, L.dtype)[:, None, None]
    return _Conditions(C, F, penalty, unit * jnp.asarray(looped, L.dtype)[:, None])


def _times(matrix, x):
    return jnp.einsum("qij,qj->qi", matrix, x)


def _along(F, effort):
    """F effort, by outer products: F has few columns."""
    return small_matmul(F, effort[:, :, None])[:, :, 0]


def _into(F, wrench):
    """F^T wrench."""
    return small_matmul(wrench[:, None, :], F)[:, 0]


def least_compliance(bonds: Bonds, deformation, effort, loads, method: str = "auto"):
    """Wrenches (q, 6) on the bonds' children, world axes, about the world origin.

    Args:
        deformation (q, 6): world twist that each bond would have of itself; zero for ordinary statics.
        effort (q, f) along each free twist; loads (p, 6) that the bonds must supply to every body.
        method: "force", "nodal" or "auto"; see `loops`.
    """
    network, solver = bonds.network, choose(bonds.network, method)
    conditions = _conditions(bonds, solver)
    pack, unpack = _packing(deformation, effort, loads)
    inverse = _inverse(network, solver, lax.stop_gradient(conditions), pack, unpack)

    def apply(x):
        w, mu, u = unpack(x)
        stretch = _times(conditions.C, w) + _along(conditions.F, mu) - across_bonds(network, u)
        return pack(stretch, _into(conditions.F, w), -on_bodies(network, w))

    right = pack(deformation, effort, -loads)  # one array: each part alone may lack a tangent
    return unpack(lax.custom_linear_solve(apply, right, inverse, inverse, symmetric=True))[0]


def _packing(*parts):
    shapes, ends = [x.shape for x in parts], np.cumsum([x.size for x in parts])

    def pack(*arrays):
        return jnp.concatenate([x.reshape(-1) for x in arrays])

    def unpack(x):
        return [part.reshape(shape) for part, shape in zip(jnp.split(x, ends[:-1]), shapes, strict=True)]

    return pack, unpack


def _open(unit, F, effort, w):
    """Largest gap along the free twists, of the largest wrench."""
    return jnp.max(jnp.abs(unit * (effort - _into(F, w))), initial=0.0) / jnp.maximum(jnp.max(jnp.abs(w)), 1e-30)


def _inverse(network, solver, conditions, pack, unpack):
    """The solution of the conditions: a balance by the tree, then the chains' wrenches by proximal iterations."""
    C, F, penalty, unit = conditions.C, conditions.F, conditions.penalty, conditions.unit
    series, stiffening = in_series(network, C), small_matmul(F * penalty[:, None], jnp.swapaxes(F, 1, 2))
    factors = solver.factor(network, series + in_series(network, stiffening))  # of C + F rho F^T

    def inverse(_, right):
        deformation, effort, minus_loads = unpack(right)

        def balanced(w):
            return w + tree_wrenches(network, -minus_loads - on_bodies(network, w))

        def twists(w, mu):
            return tree_twists(network, _times(C, w) + _along(F, mu) - deformation)

        def improve(_, x, w, stretch):
            y, mu = x
            gap = effort - _into(F, w + to_bonds(network, y))
            d = stretch + _times(series, y) + along_chains(network, _along(F, mu - penalty * gap))
            step = solver.correct(network, factors, d)
            return y + step, mu + penalty * (_into(F, to_bonds(network, step)) - gap)  # the gap as it was

        def improved(carry):
            k, w, mu, _, before = carry
            open_stretch = _times(C, w) - deformation - across_bonds(network, twists(w, mu))
            stretch = along_chains(network, open_stretch)
            start = jnp.zeros_like(stretch), mu
            y, mu = lax.fori_loop(0, solver.iterations, partial(improve, w=w, stretch=stretch), start)
            w = balanced(w + to_bonds(network, y))
            return k + 1, w, mu, before, _open(unit, F, effort, w)

        def improves(carry):
            k, _, _, before, gap = carry
            return (k < 2) | ((k < _ROUNDS) & (gap > _SMALL[gap.dtype.itemsize]) & (gap < 0.95 * before))

        # Not from zeros: XLA would work out what follows from a constant, for a whole batch, at compile time.
        none = jnp.full((), jnp.inf, effort.dtype)
        start = 0, tree_wrenches(network, -minus_loads), jnp.zeros_like(effort), none, none
        _, w, mu, *_ = lax.while_loop(improves, improved, start)
        return pack(w, mu, twists(w, mu))

    return inverse
