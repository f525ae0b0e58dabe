"""Wrenches of bonds that balance the loads, respect the free directions and have the least compliance.

The conditions are, for wrenches w, efforts mu against the free twists F and twists u of the bodies,

    C w + F mu - I_E^T u = deformation,    F^T w = effort,    I_E w = loads,

solved with C + F rho F^T in place of C and proximal iterations on one factor (the method of multipliers: Hestenes,
J. Optim. Theory Appl. 4, 1969), which work alike for determined, redundant and movable networks.  Their iterates are
combined by Anderson's acceleration (J. ACM 12, 1965; Walker and Ni, SIAM J. Numer. Anal. 49, 2011).  Derivatives are
those of the conditions themselves.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math._linalg import small_matmul
from ..math._spd import spd_inverse
from ._bond_conditions import bond_conditions
from ._bonds import Bonds
from ._loop_methods import chain_compliance, chain_to_bond_wrenches, chain_twists, choose_method
from ._network_sums import body_wrenches, bond_twists, tree_twists, tree_wrenches

#: Each round starts from exact equilibrium; the last `_ANDERSON_DEPTH` rounds are combined.  The rounds end when the
#: gap is closed, or has not fallen by the factor `_PROGRESS` for `_PATIENCE` rounds, which is rounding.
_MAX_ROUNDS, _ANDERSON_DEPTH, _PATIENCE, _PROGRESS = 60, 8, 4, 0.7
#: Gap along the free twists, of the largest wrench, that is closed (double, single), and the share of a change of the
#: wrenches that counts as one: what is shared among redundant bonds is left over by far less than the last change.
_CLOSED_GAP, _SETTLING = {8: 1e-15, 4: 1e-6}, {8: 1e-7, 4: 1e-3}


def _apply(matrix, x):
    return jnp.einsum("qij,qj->qi", matrix, x)


def _effort_twist(F, effort):
    """Twists `F effort`, as a sum over an axis, since batches of small products are slow on the CPU."""
    return jnp.sum(F * effort[:, None, :], axis=2)


def _wrench_efforts(F, wrench):
    """Efforts `F^T wrench` along the free twists."""
    return jnp.sum(wrench[:, :, None] * F, axis=1)


def least_compliance(bonds: Bonds, deformation, effort, loads, method: str = "auto"):
    """Wrenches (q, 6) on the bonds' children, world axes, about the world origin.

    Args:
        deformation (q, 6): world twist that each bond would have of itself; zero for ordinary statics.
        effort (q, f) along each free twist; loads (p, 6) that the bonds must supply to every body.
        method: "force", "nodal" or "auto"; see `loops`.
    """
    network, solver = bonds.network, choose_method(bonds.network, method)
    conditions = bond_conditions(bonds, solver)
    pack, unpack = _packing(deformation, effort, loads)
    inverse = _inverse(network, solver, lax.stop_gradient(conditions), pack, unpack)

    def apply(x):
        w, mu, u = unpack(x)
        stretch = _apply(conditions.C, w) + _effort_twist(conditions.F, mu) - bond_twists(network, u)
        return pack(stretch, _wrench_efforts(conditions.F, w), -body_wrenches(network, w))

    right = pack(deformation, effort, -loads)  # one array: each part alone may lack a tangent
    return unpack(lax.custom_linear_solve(apply, right, inverse, inverse, symmetric=True))[0]


def _packing(*parts):
    shapes, ends = [x.shape for x in parts], np.cumsum([x.size for x in parts])

    def pack(*arrays):
        return jnp.concatenate([x.reshape(-1) for x in arrays])

    def unpack(x):
        return [part.reshape(shape) for part, shape in zip(jnp.split(x, ends[:-1]), shapes, strict=True)]

    return pack, unpack


class _RoundState(eqx.Module):
    """State of the rounds: their number k; result x = (w, mu) of the last one, its gap (q, f) along the free twists
    and the size of the gap; start of the next; changes of x and gap in the previous rounds (leading axis
    `_ANDERSON_DEPTH`); best size, and the round that reached it."""

    k: jax.Array
    x: tuple
    gap: jax.Array
    size: jax.Array
    start: tuple
    changes: tuple
    best: jax.Array
    best_at: jax.Array


def _anderson_step(x, gap, size, last: _RoundState):
    """Combination of the rounds so far whose gap is least, and the changes with the last one included.

    Where the gap falls fast it is the round itself: else rounding would only be mixed in.
    """
    slow = (size > 0.1 * last.size) & (last.k > 0)
    return lax.cond(slow, _combined_rounds, lambda x, gap, last: (x, last.changes), x, gap, last)


def _combined_rounds(x, gap, last):
    """Anderson's acceleration, type II: as a round is affine, the combination of iterates has the same combination of
    gaps, and the least-squares problem for its weights is solved by normal equations.
    """
    change = jax.tree.map(jnp.subtract, (*x, gap), (*last.x, last.gap))
    changes = jax.tree.map(lambda old, new: jnp.roll(old, 1, axis=0).at[0].set(new), last.changes, change)
    G = changes[2].reshape(_ANDERSON_DEPTH, -1)
    length = jnp.sqrt(jnp.sum(G * G, axis=1))
    moves = length > 1e-4 * jnp.sqrt(jnp.sum(gap * gap))  # else the gap stays: loads that would move the network
    unit = jnp.where(moves, 1.0 / jnp.where(moves, length, 1.0), 0.0)
    G = unit[:, None] * G
    # regularised by 1e-5 of the unit length of the columns, since successive changes become nearly parallel
    share = unit * (spd_inverse(G @ G.T + 1e-5 * jnp.eye(_ANDERSON_DEPTH, dtype=G.dtype)) @ (G @ gap.reshape(-1)))
    return jax.tree.map(lambda now, old: now - jnp.tensordot(share, old, axes=1), x, changes[:2]), changes


def _inverse(network, solver, conditions, pack, unpack):
    """The solution of the conditions: a balance by the tree, then the chains' wrenches by proximal iterations."""
    C, F, penalty, unit = conditions.C, conditions.F, conditions.penalty, conditions.unit
    series, stiffening = chain_compliance(network, C), small_matmul(F * penalty[:, None], jnp.swapaxes(F, 1, 2))
    lent = jax.vmap(jnp.diag)(conditions.lent)
    factors = solver.factor(network, series + lent + chain_compliance(network, stiffening))  # of C + F rho F^T

    def inverse(_, right):
        deformation, effort, minus_loads = unpack(right)

        def balanced(w):
            return w + tree_wrenches(network, -minus_loads - body_wrenches(network, w))

        def twists(w, mu):
            return tree_twists(network, _apply(C, w) + _effort_twist(F, mu) - deformation)

        def improve(_, x, w, stretch):
            y, mu = x
            gap = effort - _wrench_efforts(F, w + chain_to_bond_wrenches(network, y))
            d = stretch + _apply(series, y) + chain_twists(network, _effort_twist(F, mu - penalty * gap))
            step = solver.correct(network, factors, d)
            # the gap before this step: it is part of the proximal term
            change = _wrench_efforts(F, chain_to_bond_wrenches(network, step)) - gap
            return y + step, mu + penalty * change

        def gap_of(w):
            return unit * (effort - _wrench_efforts(F, w))

        def improved(last):
            w, mu = last.start
            open_stretch = _apply(C, w) - deformation - bond_twists(network, twists(w, mu))
            stretch = chain_twists(network, open_stretch)
            start = jnp.zeros_like(stretch), mu
            y, mu = lax.fori_loop(0, solver.iterations, partial(improve, w=w, stretch=stretch), start)
            w = balanced(w + chain_to_bond_wrenches(network, y))
            gap = gap_of(w)
            change = _SETTLING[w.dtype.itemsize] * jnp.max(jnp.abs(w - last.x[0]))
            size = jnp.maximum(jnp.max(jnp.abs(gap)), change) / jnp.maximum(jnp.max(jnp.abs(w)), 1e-30)
            start, changes = _anderson_step((w, mu), gap, size, last)
            k, better = last.k + 1, size < _PROGRESS * last.best
            best, at = jnp.where(better, size, last.best), jnp.where(better, k, last.best_at)
            return _RoundState(k, (w, mu), gap, size, start, changes, best, at)

        def improves(last):
            goes_on = (last.size > _CLOSED_GAP[last.size.dtype.itemsize]) & (last.k - last.best_at <= _PATIENCE)
            return (last.k < 2) | ((last.k < _MAX_ROUNDS) & goes_on)

        # not zeros: XLA would fold what follows from a constant, for a whole batch, at compile time
        none = jnp.full((), jnp.inf, effort.dtype)
        x = tree_wrenches(network, -minus_loads), jnp.zeros_like(effort)
        gap = gap_of(x[0])
        changes = jax.tree.map(lambda x: jnp.zeros((_ANDERSON_DEPTH, *x.shape), x.dtype), (*x, gap))
        begin = _RoundState(jnp.asarray(0), x, gap, none, x, changes, none, jnp.asarray(0))
        w, mu = lax.while_loop(improves, improved, begin).x
        return pack(w, mu, twists(w, mu))

    return inverse
