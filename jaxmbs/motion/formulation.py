"""What is integrated: the second half of the state, its rate, and the way back to velocities.

canonical    (psi, P): S2 (42)-(44) in all velocities, any loops and drives; the default
independent  (psi, p): the paper's own momenta, a fixed independent set
velocity     (psi, u): accelerations, for semi-implicit Euler
prescribed   (psi, nothing): systems without freedom, whose rows alone give the velocities
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..dynamics import hamiltonian
from ..dynamics.efforts import efforts
from ..dynamics.newton_euler import accelerations
from ..kinematics import constraints
from ..kinematics.assembly import metric, newton_step
from ..kinematics.configuration import Configuration, configuration, moving
from ..kinematics.elastic import mass_matrix
from ..kinematics.influence import velocity_map
from ..kinematics.poses import coordinate_rate, normalise, step_coordinates
from ..math.linalg import saddle_factor, saddle_solve
from ..model.system import System

FORMULATIONS = ("canonical", "independent", "velocity", "prescribed")
_OWN = 1e-6  # of the inertia that the loops lend: less is none
_ROUNDING = {8: 1e-11, 4: 1e-5}  # residuals [m, rad] that say nothing about convergence


class Problem(eqx.Module):
    """Arguments of the vector field: the system, its tree parameters and the scale of the second state."""

    system: System
    P: jnp.ndarray
    scale: jnp.ndarray
    formulation: str = eqx.field(static=True)

    @classmethod
    def begin(cls, system, P, formulation, psi, u, t):
        """The problem and the scaled second half of its state: momenta in units of velocity, divided by the inertia
        that each velocity sees at the start.

        A column without inertia of its own has no momentum to keep: what its efforts feed in during a step is taken
        up by the rows, and moves the system as the inertia that the loops lend it says."""
        if formulation in ("velocity", "prescribed"):
            u = u if formulation == "velocity" else u[:0]
            return cls(system, P, jnp.ones_like(u), formulation), u
        at = configuration(system, P, psi, t)
        M = mass_matrix(system, at)
        p = M @ u
        if formulation == "independent":
            Gamma = velocity_map(system, at)[0]
            p, scale = Gamma.T @ p, jnp.diagonal(Gamma.T @ M @ Gamma)
        else:
            scale = _seen_inertia(system, at, M)
        scale = lax.stop_gradient(jnp.maximum(scale, 1e-9 * jnp.max(scale, initial=0.0)))
        return cls(system, P, scale, formulation), p / scale

    def velocities(self, t, psi, p):
        """Velocities (nv,) of the scaled second half of the state."""
        return self.velocities_at(configuration(self.system, self.P, psi, t), p)

    def velocities_at(self, at: Configuration, p):
        """`velocities` at a configuration."""
        p = p * self.scale
        if self.formulation == "velocity":
            return p
        if self.formulation == "independent":
            return hamiltonian.independent_velocities(self.system, at, p)
        if self.formulation == "prescribed":
            return constrained_velocities(self.system, at)
        return hamiltonian.velocities(self.system, at, p)[0]

    def rate(self, t, y):
        """Rate of (psi, scaled p, work): the vector field."""
        (psi, p, _), system = y, self.system
        at, multipliers = configuration(system, self.P, psi, t), None
        if self.formulation in ("velocity", "prescribed"):
            here = moving(system, at, self.velocities_at(at, p))
            F, Q, powers = efforts(system, here)
            rate, multipliers, _ = accelerations(system, here, loads=(F, Q))
            psi_dot, rate = coordinate_rate(system.topology, psi, here.u), rate[: p.shape[0]]
        else:
            independent = self.formulation == "independent"
            equations = hamiltonian.independent_rate if independent else hamiltonian.canonical_rate
            psi_dot, rate, powers, u = equations(system, at, p * self.scale)
        if is_rheonomic(system):
            if multipliers is None:
                multipliers = accelerations(system, moving(system, at, u))[1]
            drive = -jnp.dot(multipliers, constraints.time_rate(system, at.psi, at.t))
            powers = jnp.concatenate([powers, drive[None]])
        return psi_dot, rate / self.scale, powers

    def project(self, t, y):
        """Positions and velocities back on the constraints, quaternions of unit length; and how far that moved each
        coordinate (nq,)."""
        before, p, work = y
        if self.formulation in ("independent", "prescribed"):
            psi, closes = self.project_position(t, before)
        else:
            psi, p, closes = self._closed(t, before, p)
        return (psi, p, work), jnp.where(closes, jnp.abs(psi - before), jnp.inf)

    def _closed(self, t, psi, p):
        """`project_position` and the second half of the state for velocities that keep the rows.

        One scan: the third pass solves for velocities with the masses where two before it solve for steps with the
        metric, so that the walk and the solver are compiled once.
        """
        system, P, rows = self.system, self.P, constraints.row_scale(self.system)
        weight, is_position = jnp.diag(metric(system)), np.zeros((len(rows.block), 1), bool)
        is_position[system.topology.position_rows] = True

        def once(psi, last):
            at = configuration(system, P, psi, t)
            A, f = constraints.jacobian(system, at), constraints.residual(system, at)
            f_t = constraints.time_rate(system, psi, t)
            momentum = p * self.scale
            if self.formulation == "velocity":
                momentum = hamiltonian.momenta(system, moving(system, at, momentum))
            K = jnp.where(last, mass_matrix(system, at), weight)
            gap = jnp.where(last, f_t, jnp.zeros_like(f_t).at[system.topology.position_rows].set(f))
            A = jnp.where(last | is_position, A, 0.0)
            u, _ = saddle_solve(K, A, jnp.where(last, momentum, 0.0), -gap, rows)
            then = u if self.formulation == "velocity" else hamiltonian.momenta(system, moving(system, at, u))
            moved = normalise(system.topology, step_coordinates(system.topology, psi, u))
            return jnp.where(last, psi, moved), (jnp.max(jnp.abs(f), initial=0.0), then / self.scale)

        psi, (gaps, then) = lax.scan(once, psi, jnp.array([False, False, True]))
        return psi, then[2], _nearly_closed(gaps)

    def project_position(self, t, psi):
        """Two Newton steps onto the loops, quaternions of unit length; and whether the first one nearly closed them:
        it does not where the mechanism is locked, however near it is."""
        closes = jnp.asarray(True)
        if self.system.has_constraints:
            free = jnp.ones(self.system.topology.num_velocities, psi.dtype)
            psi, gaps = lax.scan(lambda q, _: newton_step(self.system, self.P, q, t, free), psi, length=2)
            closes = _nearly_closed(gaps)
        return normalise(self.system.topology, psi), closes


def _nearly_closed(gaps):
    """Whether the first of two steps nearly closed the rows: it does not where the mechanism is locked."""
    return gaps[1] <= 0.1 * gaps[0] + _ROUNDING[gaps.dtype.itemsize]


def _seen_inertia(system, at, M):
    """Inertia (nv,) that each column sees: its own, or where that is nothing beside it what the rows lend it,
    1 / K_ii of `u = K p`, the inverse of M on the motions that the rows allow."""
    own = jnp.diagonal(M)
    if not system.has_constraints:
        return own
    rows = constraints.row_scale(system)
    A = rows.unit[:, None] * constraints.jacobian(system, at)
    lent = 1.0 / jnp.diagonal(saddle_factor(M, A, rows.block)[0])
    return jnp.where(own > _OWN * lent, own, lent)


def constrained_velocities(system, at):
    """Velocities (nv,) that the rows prescribe, `A u = -f_t`."""
    A, b = constraints.jacobian(system, at), -constraints.time_rate(system, at.psi, at.t)
    weight = jnp.diag(metric(system))
    return saddle_solve(weight, A, jnp.zeros(A.shape[1], A.dtype), b, constraints.row_scale(system))[0]


def is_rheonomic(system: System) -> bool:
    """Whether some row may depend on time."""
    return any(row.may_depend_on_time for row in system.rows)


def num_powers(system: System) -> int:
    """Entries of the work account: one per force element, one for all drives."""
    return sum(len(group.names) for group in (*system.forces, *system.elastic)) + int(is_rheonomic(system))
