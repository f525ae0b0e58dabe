"""Implicit stages of a mechanism whose force elements have internal states: a step costs what the mechanism costs.

The states of an element are seen by that element alone, so the stage equations have an arrow of blocks: at given
coordinates and second half each element finds its own (`ImplicitLaw`), and only these two parts are left to
Newton's method, with one matrix a step (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8).
Derivatives by the implicit function theorem: the adjoint has the transposed elimination.
"""

from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..forces._implicit_law import ImplicitLaw
from ..kinematics._configuration import configuration, with_velocities
from ..kinematics._internal_states import internal_rates
from ..math import _square as square
from ..model._internal_states import with_internal
from ..ode._stages_of_equations import StageStart

if TYPE_CHECKING:
    from ._formulation import Formulation

_MOST_ITERATIONS = 12
#: Change of the last iteration over the tolerance of a step that counts as none (Hairer and Wanner's kappa).
_CONVERGED = 1e-2


class ImplicitStages(eqx.Module):
    """The stages of a step: rates r of (coordinates, p, work) with `r = f(t, y + s r)`.

    Attributes:
        step: s.
        inverse: of the derivative of the stage equations at the start of the step, internal states eliminated.
        scale: tolerance of every coordinate and entry of the second half.
    """

    equations: "Formulation"
    step: Array
    inverse: Array
    scale: Array

    @classmethod
    def of(cls, equations: "Formulation", s: Array, start: StageStart) -> "ImplicitStages":
        """The stages of a step from its start."""
        fixed, step, (t, y, rtol, atol) = lax.stop_gradient((equations, s, start))
        z, internal = _unknowns(fixed, y)
        matrix = jax.jacfwd(_residual(_with_implicit_laws(fixed, step, internal), step, t, z))(z)
        return cls(equations, s, square.inverse(matrix), atol + rtol * jnp.abs(z))

    def rate(self, t: Array, y: tuple) -> tuple[tuple, Array]:
        """The rate, and True if it was found."""
        equations, s = self.equations, self.step
        start, internal = _unknowns(equations, y)
        eliminated = _with_implicit_laws(equations, s, internal)
        residual = eqx.filter_closure_convert(_residual(eliminated, s, t, start), start)
        z, found = _root(residual, *lax.stop_gradient((start, self.scale, self.inverse)))
        psi, second = _halves(equations, z)
        at = configuration(equations.system, equations.P, psi, t)
        at = with_velocities(equations.system, at, equations.velocities_of(at, second))
        rates = internal_rates(eliminated.system, at)
        powers = equations.powers(with_internal(equations.system, internal + s * rates), at)
        nq, end = psi.size, z.size - psi.size
        r = (z - start) / s
        return (r[:nq], jnp.concatenate([r[nq:], rates / equations.scale[end:]]), powers), found


def _unknowns(equations, y):
    """(coordinates and second half, scaled, in one vector; internal states, not scaled) of y."""
    psi, p, _ = y
    end = p.size - equations.system.topology.num_internal
    return jnp.concatenate([psi, p[:end]]), p[end:] * equations.scale[end:]


def _halves(equations, z):
    """Coordinates, and second half, not scaled."""
    nq = equations.system.topology.num_coordinates
    return z[:nq], z[nq:] * equations.scale[: z.size - nq]


def _with_implicit_laws(equations, s, internal):
    """The equations whose laws find their internal states from those at the start of the stage."""

    def implicit(group, states):
        return ImplicitLaw(group.law, states, jnp.broadcast_to(s, len(group.names)))

    return eqx.tree_at(lambda e: e.system, equations, with_internal(equations.system, internal, implicit))


def _residual(equations, s, t, start):
    """`z - start - s f(z)` as a function of z."""

    def residual(z):
        psi, second = _halves(equations, z)
        rates = equations.rates_of(configuration(equations.system, equations.P, psi, t), second)
        second_rate = rates.second / equations.scale[: second.size]
        return z - start - s * jnp.concatenate([rates.psi, second_rate])

    return residual


@eqx.filter_custom_jvp
def _root(residual, z, scale, inverse):
    """(root near z, True if it was found), by Newton's method with one inverse."""

    def iterate(carry):
        z, _, count = carry
        change = inverse @ residual(z)
        return z - change, jnp.max(jnp.abs(change) / scale), count + 1

    def unfinished(carry):
        _, size, count = carry
        return (size > _CONVERGED) & (count < _MOST_ITERATIONS)

    found, size, _ = lax.while_loop(unfinished, iterate, (z, jnp.asarray(jnp.inf, z.dtype), 0))
    converged = size <= _CONVERGED
    return jnp.where(converged, found, z), converged


@_root.def_jvp
def _root_jvp(primals, tangents):
    residual = primals[0]
    z, converged = _root(*primals)
    change = eqx.filter_jvp(lambda residual: residual(z), (residual,), (tangents[0],))[1]
    along = jax.linearize(residual, z)[1]
    matrix = jax.vmap(along, 1, 1)(jnp.eye(z.size, dtype=z.dtype))
    return (z, converged), (-square.solve(matrix, change), None)
