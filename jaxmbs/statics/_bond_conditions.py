"""Bonds as compliances and free twists in world axes, with the numbers by which their loops are solved."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math._linalg import small_matmul
from ..runtime import fusion_barrier, segment_sum_static
from ._bonds import Bonds
from ._loop_methods import chain_compliance
from ._series_reduction import series_reduction

#: Largest ratio of the compliance along a free twist to that of the weakest bond (double, single): more is rounding.
_LARGEST_PENALTY = {8: 1e12, 4: 1e4}
#: Compliance lent to a chain of bonds that has less, by rounding relative to the largest penalty: a stiffer one would
#: drown the others in its rounding.  The rounds take it back.
_LENT_COMPLIANCE = 50


class BondConditions(eqx.Module):
    """World arrays of the bonds about one origin: C (q, 6, 6), F (q, 6, f), penalty (q, f), unit (q, f) of each free
    twist, zero where there is none; lent (m, 6): what the factor adds to the compliance of chains.

    Bonds outside all loops have no free twists here: equilibrium alone determines them.
    """

    C: jax.Array
    F: jax.Array
    penalty: jax.Array
    unit: jax.Array
    lent: jax.Array


def bond_conditions(bonds: Bonds, solver) -> BondConditions:
    """The conditions of the bonds; solver: of the loops, which has the penalty."""
    axes, L = bonds.twist_axes, bonds.length
    # the barrier keeps XLA from computing the first product once for every entry of the second
    C = small_matmul(fusion_barrier(small_matmul(axes, bonds.compliance)), jnp.swapaxes(axes, 1, 2))
    size = bonds.free_sizes()
    unit = jnp.where(size > 0.0, lax.rsqrt(jnp.where(size > 0.0, size, 1.0)), 0.0)
    penalty = _penalty(bonds, solver, unit)
    looped = jnp.asarray(np.abs(series_reduction(bonds.network).sign), L.dtype)
    F = small_matmul(axes, bonds.free) * looped[:, None, None]
    lent = _lent_compliance(bonds, jnp.max(penalty * size, initial=0.0))
    return BondConditions(C, F, penalty, unit * looped[:, None], lent)


def _penalty(bonds, solver, unit):
    """Compliance (q, f) along each free twist: that of the method, times the one of the weakest bond."""
    bits, local = unit.dtype.itemsize, _metric(_link_size(bonds))
    weakest = jnp.max(jnp.diagonal(bonds.compliance, axis1=1, axis2=2) * local[None])
    size = jnp.where(unit > 0.0, jnp.einsum("i,qij->qj", local, bonds.free**2), 1.0)
    relative = jnp.minimum(solver.penalty[bits] / size, _LARGEST_PENALTY[bits] * unit**2)
    return jnp.where(unit > 0.0, relative, 0.0) * jnp.where(weakest > 0.0, weakest, 1.0)


def _lent_compliance(bonds, penalty):
    """Compliance (m, 6) that the factor adds to each chain which has less; penalty (): the largest."""
    metric, least = _metric(bonds.length**2), _LENT_COMPLIANCE * jnp.finfo(penalty.dtype).eps * penalty
    stiffest = jnp.min(jnp.diagonal(bonds.compliance, axis1=1, axis2=2) * metric[None], axis=1)
    return jnp.maximum(least - chain_compliance(bonds.network, stiffest), 0.0)[:, None] / metric[None]


def _metric(square):
    """Weights (6,) of the squares of a twist whose angles count by that square of a length."""
    return jnp.concatenate([jnp.ones(3, square.dtype), jnp.full(3, square)])


def _link_size(bonds):
    """Mean square distance () of the bonds in loops from the middle of their body [m^2].

    By it a moment along a hinge turns into forces.  The characteristic length may be that of a whole row of links.
    """
    network, loops = bonds.network, series_reduction(bonds.network).sign != 0
    body, bond, p = np.concatenate(network.ends), np.tile(np.arange(len(loops)), 2), len(network.bodies)
    chosen = (body < p) & loops[bond]
    body, bond = body[chosen], bond[chosen]
    x, number = bonds.position[bond], np.maximum(np.bincount(body, minlength=p), 1)
    middle = segment_sum_static(x, body, p) / jnp.asarray(number, x.dtype)[:, None]
    square, largest = jnp.sum((x - middle[body]) ** 2) / len(body), bonds.length**2
    return jnp.where(square > 1e-12 * largest, jnp.minimum(square, largest), largest)
