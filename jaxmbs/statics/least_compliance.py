"""Wrenches of bonds that balance the loads, respect the free directions and have the least compliance.

The conditions are, for wrenches w, efforts mu against the free twists F and twists u of the bodies,

    C w + F mu - I_E^T u = deformation,    F^T w = effort,    I_E w = loads,

solved with C + F rho F^T in place of C and proximal iterations on one factor, which work alike for determined,
redundant and movable networks.  Derivatives are those of the conditions themselves.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from .bonds import Bonds
from .loops import choose
from .tree import across_bonds, on_bodies, tree_twists, tree_wrenches

#: Each gains the factor that the penalty is above a loop's stiffness; on nearly singular loops that is not much.
ITERATIONS = 5


class _Conditions(eqx.Module):
    """World arrays of the bonds about one origin: C (q, 6, 6), F (q, 6, 6), penalty (q, 6)."""

    C: jax.Array
    F: jax.Array
    penalty: jax.Array

    @property
    def penalised(self):
        """C + F rho F^T."""
        return self.C + jnp.einsum("qik,qk,qjk->qij", self.F, self.penalty, self.F)


def _conditions(bonds, solver):
    axes, L = bonds.twist_axes, bonds.length
    C = jnp.einsum("qik,qkl,qjl->qij", axes, bonds.compliance, axes)
    weight = jnp.concatenate([jnp.full(3, L**2), jnp.ones(3, L.dtype)])
    weakest = jnp.max(jnp.diagonal(bonds.compliance, axis1=1, axis2=2) * weight[None])
    size = bonds.free_sizes()
    used = size > 0.0
    penalty = jnp.where(used, solver.penalty[L.dtype.itemsize] * weakest / jnp.where(used, size, 1.0), 0.0)
    return _Conditions(C, axes @ bonds.free, penalty)


def _times(matrix, x):
    return jnp.einsum("qij,qj->qi", matrix, x)


def _into(matrix, x):
    return jnp.einsum("qji,qj->qi", matrix, x)


def least_compliance(bonds: Bonds, deformation, effort, loads, method: str = "auto"):
    """Wrenches (q, 6) on the bonds' children, world axes, about the world origin.

    Args:
        deformation (q, 6): world twist that each bond would have of itself; zero for ordinary statics.
        effort (q, 6) along each free twist; loads (p, 6) that the bonds must supply to every body.
        method: "force", "nodal" or "auto"; see `loops`.
    """
    network, q = bonds.network, len(bonds.network.bonds)
    solver = choose(network, method)
    conditions = _conditions(bonds, solver)
    fixed = lax.stop_gradient(conditions)
    C, F, penalty, stiff = fixed.C, fixed.F, fixed.penalty, fixed.penalised
    factors = solver.factor(network, stiff)

    def apply(x):
        w, mu, u = jnp.split(x, [q, 2 * q])
        stretch = _times(conditions.C, w) + _times(conditions.F, mu) - across_bonds(network, u)
        return jnp.concatenate([stretch, _into(conditions.F, w), -on_bodies(network, w)])

    def inverse(_, right):
        deformation, effort, minus_loads = jnp.split(right, [q, 2 * q])

        def improve(_, x):
            w, mu, u = x
            gap = effort - _into(F, w)
            open_stretch = deformation - _times(C, w) - _times(F, mu - penalty * gap) + across_bonds(network, u)
            step = tree_wrenches(network, -minus_loads - on_bodies(network, w))
            step = step + solver.correct(network, factors, _times(stiff, step) - open_stretch)
            u = u + tree_twists(network, _times(stiff, step) - open_stretch)
            return w + step, mu + penalty * (_into(F, step) - gap), u  # the gap as it was: rounding cancels

        start = jnp.zeros_like(deformation), jnp.zeros_like(effort), jnp.zeros_like(minus_loads)
        w, mu, u = lax.fori_loop(0, ITERATIONS, improve, start)
        return jnp.concatenate([w + tree_wrenches(network, -minus_loads - on_bodies(network, w)), mu, u])

    right = jnp.concatenate([deformation, effort, -loads])  # one array: each part alone may lack a tangent
    return lax.custom_linear_solve(apply, right, inverse, inverse, symmetric=True)[:q]
