"""Implicit stages of a mechanism, by Newton's method with one matrix a step.

Force elements and blocks may have internal states; a step still costs what the mechanism costs.  The states of a law
that no signal reads are seen by their element alone, so the stage equations have an arrow of blocks: at given
coordinates, second half and other internal states each such element finds its own (`ImplicitLaw`), and only these are
left to Newton's method (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8).  Derivatives by the
implicit function theorem: the adjoint has the transposed elimination.
"""

import dataclasses
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..kinematics._configuration import configuration, with_internal, with_velocities
from ..math import _square as square
from ..math._newton import newton_root
from ..model._internal_states import group_size, group_states
from ..model._signals import internal_reads
from ..ode._stages_of_equations import StageStart
from ..runtime import gather_static
from ..signal_flow._internal_states import internal_rates
from ..signal_flow._signals import with_signals

if TYPE_CHECKING:
    from ._formulation import Formulation

_MOST_ITERATIONS = 12
#: Change of the last iteration over the tolerance of a step that counts as none (Hairer and Wanner's kappa).
_CONVERGED = 1e-2


class ImplicitStages(eqx.Module):
    """The stages of a step: rates r of (coordinates, p, work) with `r = f(t, y + s r)`.

    Attributes:
        step: s.
        inverse: of the derivative of the stage equations at the start of the step by the unknowns of the stage.
        scale: tolerance of every unknown.
    """

    equations: "Formulation"
    step: Array
    inverse: Array
    scale: Array

    @classmethod
    def of(cls, equations: "Formulation", s: Array, start: StageStart) -> "ImplicitStages":
        """The stages of a step from its start."""
        fixed, step, (t, y, rtol, atol) = lax.stop_gradient((equations, s, start))
        stage = _ImplicitEquations(fixed, step, t, y)
        z = stage.start
        return cls(equations, s, square.inverse(stage.matrix(z)), atol + rtol * jnp.abs(z))

    def rate(self, t: Array, y: tuple) -> tuple[tuple, Array]:
        """The rate, and True if it was found."""
        stage = _ImplicitEquations(self.equations, self.step, t, y)
        residual = eqx.filter_closure_convert(stage.residual, stage.start)
        start, scale, inverse = lax.stop_gradient((stage.start, self.scale, self.inverse))
        z, size = newton_root(residual, start, scale, inverse, _CONVERGED, _MOST_ITERATIONS)
        found = size <= _CONVERGED
        return stage.rates(jnp.where(found, z, start)), found


class _ImplicitEquations:
    """The equations of one stage in z: coordinates, second half and the internal states that are not eliminated, all
    but the first divided by their scales; at given z the laws find their own internal states."""

    def __init__(self, equations, s, t, y):
        psi, p, _ = y
        self.equations, self.step, self.t = equations, s, t
        eliminated = eliminated_states(equations.system)
        self.nq, self.end = psi.size, p.size - eliminated.size
        self.kept, self.eliminated = np.flatnonzero(~eliminated), np.flatnonzero(eliminated)
        self.internal = p[self.end :] * equations.scale[self.end :]
        self.start = jnp.concatenate([psi, p[: self.end], gather_static(p[self.end :], self.kept)])

    def matrix(self, z):
        """Derivative of the residual; by many internal states apart, as the kinematics have none by these."""
        mechanism = self.nq + self.end
        if self.kept.size <= mechanism:
            return jax.jacfwd(self.residual)(z)
        by_mechanism = jax.jacfwd(lambda x: self.residual(jnp.concatenate([x, z[mechanism:]])))(z[:mechanism])
        by_states = jax.jacfwd(lambda s: self.residual(jnp.concatenate([z[:mechanism], s])))(z[mechanism:])
        return jnp.concatenate([by_mechanism, by_states], axis=1)

    def residual(self, z):
        """`z - start - s f(z)`."""
        equations, (at, second) = self.equations, self._at(z)
        rates, scale = equations.rates_of(at, second), equations.scale
        parts = [rates.psi, rates.second / scale[: self.end]]
        if self.kept.size:
            rate = internal_rates(equations.system, rates.here(equations.system, at))
            parts.append(gather_static(rate / scale[self.end :], self.kept))
        return z - self.start - self.step * jnp.concatenate(parts)

    def rates(self, z):
        """Rates of (coordinates, p, work) at the solution z."""
        equations, (at, second) = self.equations, self._at(z)
        at = with_signals(
            equations.system, with_velocities(equations.system, at, equations.velocities_of(at, second))
        )
        r = (z - self.start) / self.step
        rate = r[self.nq : self.nq + self.end]
        if not self.internal.size:
            return r[: self.nq], rate, equations.powers(at)
        own = internal_rates(equations.system, at)
        found = self._internal(z).at[self.eliminated].add(self.step * gather_static(own, self.eliminated))
        powers = equations.powers(with_internal(equations.system, at, found))
        return r[: self.nq], jnp.concatenate([rate, own / equations.scale[self.end :]]), powers

    def _at(self, z):
        """The configuration at the internal states in z, and the second half, not scaled."""
        equations, system = self.equations, self.equations.system
        at = configuration(system, equations.P, z[: self.nq], self.t)
        if (s := group_states(system, self._internal(z))) is not None:
            implicit = _implicit_laws(system)
            steps = (
                jnp.broadcast_to(self.step, len(group.names)) if group.names in implicit else None
                for group in system.forces
            )
            at = dataclasses.replace(at, s=s._replace(steps=tuple(steps)))
        return at, z[self.nq : self.nq + self.end] * equations.scale[: self.end]

    def _internal(self, z):
        """Internal states: those in z, and of eliminated ones those at the start of the stage."""
        kept = z[self.nq + self.end :] * gather_static(self.equations.scale[self.end :], self.kept)
        return self.internal.at[self.kept].set(kept) if self.kept.size else self.internal


def _implicit_laws(system) -> set[tuple[str, ...]]:
    """Names of the groups of laws whose internal states no signal reads.

    None where these states are fewer than coordinates and velocities: the matrix of all is then the cheaper one.
    """
    read, top = internal_reads(system), system.topology
    groups = [group for group in system.forces if group.internal]
    alone = [g for g in groups if read.isdisjoint(f"{e}.{name}" for e in g.names for name, *_ in g.internal)]
    number = sum(len(group.names) * group_size(group) for group in alone)
    are_many = number > top.num_coordinates + top.num_velocities
    return {group.names for group in alone} if are_many else set()


def eliminated_states(system) -> np.ndarray:
    """True (ns,) for each internal state that its law finds alone in an implicit stage (static)."""
    implicit = _implicit_laws(system)
    sizes = [(group.names in implicit, len(group.names) * group_size(group)) for group in system.forces]
    of_laws = np.repeat(*np.array(sizes, dtype=int).reshape(-1, 2).T).astype(bool)
    return np.concatenate([of_laws, np.zeros(system.topology.num_internal - of_laws.size, bool)])
