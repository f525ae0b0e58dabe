"""What is integrated: the second half of the state beside the coordinates, its rate, and the way back to velocities.

A formulation says how velocities become its second half and back, and its rate; projection onto the rows is common.
"""

import abc
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..dynamics._efforts import efforts
from ..dynamics._newton_euler import accelerations
from ..kinematics import _constraints as constraints
from ..kinematics._assembly import metric_matrix, newton_step
from ..kinematics._configuration import Configuration, configuration, with_velocities
from ..kinematics._elastic import mass_matrix
from ..kinematics._poses import normalise, step_coordinates
from ..math._linalg import saddle_solve
from ..model._system import System
from ..runtime import gather_static, remat
from ..typing import ScalarLike

_ROUNDING = {8: 1e-11, 4: 1e-5}  # residuals [m, rad] that say nothing about convergence


class Rates(NamedTuple):
    """Of the coordinates (nq,) and of the second half; powers of the force elements, velocities u (nv,), and the
    multipliers of the accelerations; powers and multipliers None where the rates do not need them."""

    psi: Array
    second: Array
    powers: Array | None
    u: Array
    multipliers: Array | None = None


class Formulation(eqx.Module):
    """Arguments of the vector field: the system, its tree parameters and the scale of the second half.

    Attributes:
        keeps_momenta: whether the second half is projected together with the coordinates.
        follows_rows: whether the rows alone give the coordinates; error control then looks at them and the work.
    """

    system: System
    P: Array
    scale: Array

    keeps_momenta: ClassVar[bool] = True
    follows_rows: ClassVar[bool] = False

    @classmethod
    def begin(cls, system: System, at: Configuration, u: Array) -> tuple["Formulation", Array]:
        """The problem and the scaled second half of its state."""
        second, scale = cls.start(system, at, u)
        scale = lax.stop_gradient(jnp.maximum(scale, 1e-9 * jnp.max(scale, initial=0.0)))
        return cls(system, at.P, scale), second / scale

    @classmethod
    @abc.abstractmethod
    def start(cls, system: System, at: Configuration, u: Array) -> tuple[Array, Array]:
        """(second half, its scale) of velocities u (nv,)."""

    @abc.abstractmethod
    def velocities_of(self, at: Configuration, second: Array) -> Array:
        """Velocities (nv,) of the second half, not scaled."""

    @abc.abstractmethod
    def rates_of(self, at: Configuration, second: Array) -> Rates:
        """Its rates, not scaled."""

    def momenta_of(self, at: Configuration, second: Array) -> Array:
        """Momenta (nv,) of the second half, where it is projected."""
        return second

    def second_of(self, at: Configuration, u: Array) -> Array:
        """The second half of velocities u (nv,) that keep the rows, where it is projected."""
        return self.start(self.system, at, u)[0]

    def velocities(self, t: ScalarLike, psi: Array, p: Array) -> Array:
        """Velocities (nv,) of the scaled second half."""
        return self.velocities_at(configuration(self.system, self.P, psi, t), p)

    def velocities_at(self, at: Configuration, p: Array) -> Array:
        """`velocities` at a configuration."""
        return self.velocities_of(at, p * self.scale)

    def rate(self, t: ScalarLike, y: tuple) -> tuple[Array, Array, Array]:
        """Rate of (psi, scaled second half, work): the vector field."""
        (psi, p, _), system = y, self.system
        at = configuration(system, self.P, psi, t)
        psi_dot, rate, powers, u, multipliers = self.rates_of(at, p * self.scale)
        powers = efforts(system, with_velocities(system, at, u))[2] if powers is None else powers
        if is_rheonomic(system):
            if multipliers is None:
                multipliers = accelerations(system, with_velocities(system, at, u))[1]
            drive = -jnp.dot(multipliers, constraints.time_rate(system, at))
            powers = jnp.concatenate([powers, drive[None]])
        return psi_dot, rate / self.scale, powers

    def project(self, t: ScalarLike, y: tuple) -> tuple[tuple, Array, tuple | None]:
        """Positions and velocities back on the constraints, quaternions of unit length; how far that moved each
        coordinate (nq,); and (coordinates, velocities, work) where the second half is projected."""
        before, p, work = y
        if self.keeps_momenta:
            psi, p, u, closes = self._closed(t, before, p)
        else:
            (psi, closes), u = self.project_position(t, before), None
        moved = jnp.where(closes, jnp.abs(psi - before), jnp.inf)
        return (psi, p, work), moved, None if u is None else (psi, u, work)

    def _closed(self, t, psi, p):
        """`project_position`, and the second half of the state for velocities that keep the rows, and those.

        One scan: the third pass solves for velocities with the masses where two before it solve for steps with the
        metric, so that the walk and the solver are compiled once.
        """
        system, P, rows = self.system, self.P, constraints.row_scale(self.system)
        weight, is_position = metric_matrix(system), np.zeros((len(rows.block), 1), bool)
        is_position[system.topology.position_rows] = True
        row_of = np.where(is_position[:, 0], np.cumsum(is_position) - 1, is_position.sum())  # the last one is zero

        def once(psi, last):
            at = configuration(system, P, psi, t)
            (f, A), f_t = constraints.residual_and_jacobian(system, at), constraints.time_rate(system, at)
            momentum = self.momenta_of(at, p * self.scale)
            K = jnp.where(last, mass_matrix(system, at), weight)
            gap = jnp.where(last, f_t, gather_static(jnp.concatenate([f, jnp.zeros(1, f.dtype)]), row_of))
            A = jnp.where(last | is_position, A, 0.0)
            u, _ = saddle_solve(K, A, jnp.where(last, momentum, 0.0), -gap, rows)
            then = self.second_of(at, u) / self.scale
            moved = normalise(system.topology, step_coordinates(system.topology, psi, u))
            return jnp.where(last, psi, moved), (jnp.max(jnp.abs(f), initial=0.0), then, u)

        # to keep all that a pass makes costs more, compiled and run
        psi, (gaps, then, u) = lax.scan(remat(once), psi, np.array([False, False, True]))
        return psi, then[2], u[2], _nearly_closed(gaps)

    def project_position(self, t: ScalarLike, psi: Array) -> tuple[Array, Array]:
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


def is_rheonomic(system: System) -> bool:
    """Whether some row may depend on time."""
    return bool(system.paths) or any(row.may_depend_on_time for row in system.rows)


def num_powers(system: System) -> int:
    """Entries of the work account: one per force element, one for all drives."""
    return sum(len(group.names) for group in (*system.forces, *system.elastic)) + int(is_rheonomic(system))
