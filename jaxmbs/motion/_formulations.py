"""The formulations that `simulate` offers by name.

canonical    (psi, P): S2 (42)-(44) in all velocities, any loops and drives; the default
independent  (psi, p): the paper's own momenta, a fixed independent set
velocity     (psi, u): accelerations, for semi-implicit Euler
prescribed   (psi, nothing): systems without freedom, whose rows alone give the velocities
"""

import jax.numpy as jnp

from ..constraints import _constraints as constraints
from ..constraints._kic import velocity_map
from ..constraints._linear_rows import metric_matrix
from ..constraints._linear_solver import linear_solver
from ..dynamics import _hamilton as hamilton
from ..dynamics._efforts import efforts
from ..dynamics._modal_condensation import column_inertia, condense_modes, lumped_inertia
from ..dynamics._newton_euler import accelerations, motion_with_friction
from ..kinematics._configuration import with_velocities
from ..kinematics._elastic import mass_matrix
from ..kinematics._poses import coordinate_rate
from ..kinematics._tree import subtrees
from ..math._linalg import diagonal, saddle_factor, saddle_solve
from ..math._spatial import dot, momentum
from ..runtime import gather_static
from ..signal_flow._signals import with_signals
from ._formulation import Formulation, Rates

_OWN = 1e-6  # of the inertia that the loops lend: less is none


class Canonical(Formulation):
    """Momenta of all velocities, in units of velocity: divided by the inertia that each sees at the start.

    A column without inertia of its own has no momentum to keep: what its efforts feed in during a step is taken up by
    the rows, and moves the system as the inertia that the loops lend it says.
    """

    gathers_impulses = True

    @classmethod
    def start(cls, system, at, u):
        if linear_solver(system) != "dense":
            return hamilton.momenta(system, with_velocities(system, at, u)), _composite_inertia(system, at)
        M = mass_matrix(system, at)
        return M @ u, _seen_inertia(system, at, M)

    def velocities_of(self, at, second):
        return hamilton.velocities(self.system, at, second)[0]

    def rates_of(self, at, second):
        return _of_momenta(*hamilton.canonical_rate(self.system, at, second))

    def second_of(self, at, u):
        return hamilton.momenta(self.system, with_velocities(self.system, at, u))


class Independent(Formulation):
    """The paper's momenta of a fixed independent set."""

    keeps_momenta = False

    @classmethod
    def start(cls, system, at, u):
        M, Gamma = mass_matrix(system, at), velocity_map(system, at)[0]
        return Gamma.T @ (M @ u), diagonal(Gamma.T @ M @ Gamma)

    def velocities_of(self, at, second):
        return hamilton.independent_velocities(self.system, at, second)

    def rates_of(self, at, second):
        return _of_momenta(*hamilton.independent_rate(self.system, at, second))


class Velocity(Formulation):
    """The velocities themselves."""

    @classmethod
    def start(cls, system, at, u):
        return u, jnp.ones_like(u)

    def velocities_of(self, at, second):
        return second

    def rates_of(self, at, second):
        return _of_accelerations(self.system, at, second)

    def momenta_of(self, at, second):
        return hamilton.momenta(self.system, with_velocities(self.system, at, second))

    def close(self, t, psi, p):
        """Velocities do not follow from the rows, as those of momenta do: they are projected too."""
        return self._project_both(t, psi, p)[:2] if self.system.has_constraints else super().close(t, psi, p)


class Prescribed(Formulation):
    """Nothing: the rows give coordinates and velocities, `A u = -f_t`."""

    keeps_momenta = False
    follows_rows = True

    @classmethod
    def start(cls, system, at, u):
        return u[:0], jnp.ones_like(u[:0])

    def velocities_of(self, at, second):
        rows, A = constraints.row_scale(self.system), constraints.jacobian(self.system, at)
        f_t, weight = constraints.time_rate(self.system, at), metric_matrix(self.system)
        return saddle_solve(weight, A, jnp.zeros(A.shape[1], A.dtype), -f_t, rows)[0]

    def rates_of(self, at, second):
        rates = _of_accelerations(self.system, at, self.velocities_of(at, second))
        return rates._replace(second=rates.second[:0])


FORMULATIONS = {
    "canonical": Canonical,
    "independent": Independent,
    "velocity": Velocity,
    "prescribed": Prescribed,
}


def _of_momenta(psi_dot, rate, powers, here):
    return Rates(psi_dot, rate, powers, here.u, at=here)


def _of_accelerations(system, at, u):
    """Rates with the accelerations for those of the second half."""
    here = with_signals(system, with_velocities(system, at, u))
    F, Q, powers = efforts(system, here)
    if system.friction is not None:
        found = motion_with_friction(system, here, loads=(F, Q))
        powers = jnp.concatenate([powers, found.powers])
        a, multipliers = found.accelerations, found.multipliers
    else:
        a, multipliers, _ = accelerations(system, here, loads=(F, Q))
    return Rates(coordinate_rate(system.topology, at.psi, u), a, powers, u, multipliers, here)


def _seen_inertia(system, at, M):
    """Inertia (nv,) that each column sees: its own, or where that is nothing beside it what the rows lend it,
    1 / K_ii of `u = K p`, the inverse of M on the motions that the rows allow."""
    own = diagonal(M)
    if not system.has_constraints:
        return own
    rows = constraints.row_scale(system)
    A = rows.unit[:, None] * constraints.jacobian(system, at)
    lent = 1.0 / diagonal(saddle_factor(M, A, rows.block)[0])
    return jnp.where(own > _OWN * lent, own, lent)


def _composite_inertia(system, at):
    """Inertia (nv,) of what each column carries, or where that is nothing beside it of what its parent carries."""
    nodes, parts = system.topology.nodes, condense_modes(system, at, 1.0, jnp.zeros_like(at.S[:, 0]))
    composite = subtrees(nodes, lumped_inertia(system, at.J, parts))
    above = gather_static(jnp.concatenate([composite, jnp.zeros_like(composite[:1])]), nodes.parent_or_size)
    own, lent = column_inertia(system, at.S, composite, parts), dot(at.S, momentum(above, at.S))
    return jnp.where(own > _OWN * lent, own, lent)
