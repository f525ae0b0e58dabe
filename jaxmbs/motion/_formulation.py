"""Formulations of the equations of motion: the second half of the state beside the coordinates, its rate and its way
back to velocities.  The projection onto the constraint rows is common to all.
"""

import abc
import functools
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..assembly._assembly import closing_step
from ..assembly._state import State
from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._linear_rows import metric, metric_matrix
from ..constraints._linear_solver import linear_solver
from ..constraints._rows import is_rheonomic
from ..constraints._saddle_operator import constraint_operator
from ..dynamics._corners import sides_of_corners
from ..dynamics._newton_euler import accelerations, all_efforts
from ..dynamics._saddle import saddle_without_matrix
from ..kinematics._configuration import Configuration, VelocityKinematics, configuration, with_velocities
from ..kinematics._elastic import mass_matrix
from ..kinematics._poses import normalise, step_coordinates
from ..math._linalg import saddle_solve
from ..model._internal_states import InternalStates
from ..model._system import System
from ..ode._problem import Projection
from ..runtime import gather_static, remat
from ..signal_flow._internal_states import internal_rates, internal_scale
from ..signal_flow._sampling import sampled_values
from ..signal_flow._signals import with_signals
from ..typing import ScalarLike
from ._implicit_stages import ImplicitStages
from ._saved_step import SavedStep

#: Residuals [m, rad] by the size of a number [bytes] that are rounding of lengths up to a hundred metres: they do not
#: tell whether a Newton step converges.
_ROUNDING = {8: 1e-11, 4: 1e-5}
#: A Newton step that leaves more than this part of the residual has not converged: near a solution it leaves the
#: square, so a tenth is what a step from a tenth of the radius of convergence leaves.
_CONVERGING = 0.1
#: Size up to which the error of momenta along the rows counts, as a multiple of what is left without it.  Away from
#: singular poses it is below, and steps are what they are.  Beside them it is a choice: velocities of a row of 160
#: four-bars err after 10 s at 1e-10 by 1.3e-8 rad/s in 400 steps with a multiple of 64, by 8e-9 in 440 with 256; one
#: of ten at 1e-8 by 1e-7 in 550 steps where all of it counts, in 150 with 64, by 3e-7 in 120 with 16.
_ALONG_ROWS = 256.0
#: Inertia lent to every column where positions are projected, of the whole mass: too little to matter beside another.
_LENT = 1e-12
#: Least scale of a component of the second half, of the largest: components of smaller inertia are not told apart.
_LEAST_SCALE = 1e-9


class Rates(NamedTuple):
    """Rates of the state and what was found on the way.

    Attributes:
        psi, second: rates of the coordinates (nq,) and of the second half.
        powers: of the force elements, None where the rates do not need them.
        u: velocities (nv,).
        multipliers: of the accelerations, None where the rates do not need them.
        at: the configuration with u and the signals of blocks, None where the rates do not need it.
    """

    psi: Array
    second: Array
    powers: Array | None
    u: Array
    multipliers: Array | None = None
    at: VelocityKinematics | None = None

    def here(self, system: System, at: Configuration) -> VelocityKinematics:
        """The configuration with u and the signals of blocks."""
        return with_signals(system, with_velocities(system, at, self.u)) if self.at is None else self.at


class Formulation(eqx.Module):
    """Equations of motion of the first order in (coordinates, second half divided by its scale, work).

    The internal states of force elements follow the second half, each divided by its declared scale; the methods that
    a formulation defines see the second half alone, and a configuration with the internal states.

    Attributes:
        system, P: the system and its tree parameters.
        scale: of the second half and the internal states.
        keeps_momenta: project the second half together with the coordinates.
        gathers_impulses: the second half holds the impulses of the rows since the last projection.
        follows_rows: the constraint rows alone give the coordinates; error control then looks at them and the work.
    """

    system: System
    P: Array
    scale: Array

    keeps_momenta: ClassVar[bool] = True
    gathers_impulses: ClassVar[bool] = False
    follows_rows: ClassVar[bool] = False

    @classmethod
    def begin(
        cls, system: System, at: Configuration, u: Array, internal: InternalStates | None = None
    ) -> tuple["Formulation", Array]:
        """The problem and the scaled second half of its state, the internal states with it."""
        second, scale = cls.start(system, at, u)
        scale = lax.stop_gradient(jnp.maximum(scale, _LEAST_SCALE * jnp.max(scale, initial=0.0)))
        if internal is not None:
            second = jnp.concatenate([second, internal.values])
            scale = jnp.concatenate([scale, lax.stop_gradient(internal_scale(system)).astype(scale.dtype)])
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

    def split(self, p: Array) -> tuple[Array, InternalStates | None]:
        """The second half alone, not scaled, and the internal states in p; None for a system without."""
        second, number = p * self.scale, self.system.topology.num_internal
        if not number:
            return second, None
        end = second.shape[-1] - number
        return second[..., :end], InternalStates(second[..., end:], self.system.topology.internal)

    def join(self, second: Array, internal: InternalStates | None) -> Array:
        """p of a second half and internal states, not scaled."""
        parts = second if internal is None else jnp.concatenate([second, internal.values])
        return parts / self.scale

    @property
    def implicit_stages(self) -> Callable:
        """Stages of implicit methods, from s = h a_ii [s] and a `StageStart`: one matrix a step, the internal states
        of laws eliminated."""
        return functools.partial(ImplicitStages.of, self)

    def sides(self, t: ScalarLike, y: tuple) -> Array:
        """Numbers (n,) that are constant beside the corners of the rate."""
        return sides_of_corners(self.system, configuration(self.system, self.P, y[0], t, inertias=False))

    def velocities(self, t: ScalarLike, psi: Array, p: Array) -> Array:
        """Velocities (nv,) of the scaled second half."""
        return self.velocities_at(configuration(self.system, self.P, psi, t), p)

    def velocities_at(self, at: Configuration, p: Array) -> Array:
        """`velocities` at a configuration."""
        return self.velocities_of(at, self.split(p)[0])

    def at(self, t: ScalarLike, psi: Array, p: Array) -> VelocityKinematics:
        """The configuration of coordinates, scaled second half and internal states."""
        second, internal = self.split(p)
        at = configuration(self.system, self.P, psi, t, internal=internal)
        return with_velocities(self.system, at, self.velocities_of(at, second))

    def rate(self, t: ScalarLike, y: tuple) -> tuple[Array, Array, Array]:
        """Rate of (psi, scaled second half, work): the vector field."""
        psi, p, _ = y
        system, (second, internal) = self.system, self.split(p)
        at = configuration(system, self.P, psi, t, internal=internal)
        found = self.rates_of(at, second)
        rate, powers, multipliers, here = found.second, found.powers, found.multipliers, found.here(system, at)
        powers = all_efforts(system, here)[2] if powers is None else powers
        if is_rheonomic(system):
            multipliers = accelerations(system, here)[1] if multipliers is None else multipliers
            powers = jnp.concatenate([powers, _drive_power(system, at, multipliers)])
        if internal is not None:
            rate = jnp.concatenate([rate, internal_rates(system, here)])
        return found.psi, rate / self.scale, powers

    def sample(self, t: ScalarLike, y: tuple, due: Array) -> tuple[Array, Array, Array]:
        """y after the samples of blocks whose periods are due (m,)."""
        psi, p, work = y
        second, internal = self.split(p)
        values = sampled_values(self.system, self.at(t, psi, p), internal.values, due)  # type: ignore[union-attr]
        return psi, self.join(second, InternalStates(values, internal.records)), work  # type: ignore[union-attr]

    def powers(self, at: VelocityKinematics) -> Array:
        """Powers of the work account (n,) at a configuration with the internal states."""
        system = self.system
        powers = all_efforts(system, at)[2]
        if not is_rheonomic(system):
            return powers
        return jnp.concatenate([powers, _drive_power(system, at, accelerations(system, at)[1])])

    def state_at(self, t: Array, y: tuple) -> State:
        """The state of (psi, scaled second half, work), which an event is a function of."""
        psi, p = y[0], y[1]
        u, internal = self.velocities(t, psi, p), self.split(p)[1]
        return State(t, psi, u, structure=self.system.topology.structure, internal=internal)

    def project(self, t: Array, y: tuple) -> Projection:
        """Positions and velocities back on the constraints, quaternions of unit length."""
        before, p, work = y
        if self.keeps_momenta:
            psi, p, saved, converged = self._project_both(t, before, p)
        else:
            (psi, converged), saved = self.project_position(t, before), None
        correction = jnp.where(converged, jnp.abs(psi - before), jnp.inf)
        return Projection((psi, p, work), correction, None if saved is None else tuple(SavedStep(psi, saved, work)))

    @property
    def projects_error(self) -> bool:
        """True if the error of a step counts without what the projection takes away of it."""
        return self.gathers_impulses and self.system.has_constraints and linear_solver(self.system) == "frontal"

    def project_error(self, t: Array, y: tuple, error: tuple) -> tuple:
        """The error of a step to y, that of its momenta at most a multiple of what is left without the efforts along
        the rows, which the projection takes away.

        Beside a singular pose momenta gather impulses along rows that fade, as s log s of the distance s: steps that
        follow them shrink until they end at the pose, where rounding is largest.
        """
        second, internal = self.split(error[1])
        size = lambda part: jnp.linalg.norm(part / self.scale[: len(part)])
        left, whole = size(self._without_rows(t, y[0], second)), size(second)
        # what is projected away takes energy with it, as its square: of velocities v the part d^2 / 2 v
        energy = 0.5 * whole**2 / jnp.maximum(size(self.split(y[1])[0]), jnp.finfo(second.dtype).tiny)
        counted = jnp.minimum(1.0, (_ALONG_ROWS * left + energy) / jnp.where(whole > 0.0, whole, 1.0))
        return error[0], self.join(counted * second, internal), *error[2:]

    def _without_rows(self, t, psi, second):
        """The second half (n,) without its part along the rows, by a block-sparse solver."""
        system = self.system
        at = closures.with_directions(system, configuration(system, self.P, psi, t))
        rows, still = constraint_operator(system, at), jnp.zeros(system.topology.num_rows, second.dtype)
        momenta = self.momenta_of(at, second)
        return self.second_of(at, saddle_without_matrix(linear_solver(system), system, at, rows, momenta, still)[0])

    def _project_both(self, t, psi, p):
        """(coordinates, p, velocities) on the constraints, and True if the first Newton step converged; the
        velocities are followed by the internal states.

        One scan of three passes, so that kinematics and solver are compiled once.  Each solves the saddle system

            [K  A^T] [u]   [m]
            [A   0 ] [l] = [g]

        The first two are Newton steps of the positions: K is the metric of the coordinates, A the rows of positions
        alone, m = 0, g minus their residual, and u the step.  The last one projects the velocities: K is the mass
        matrix, A all rows, m the momentum, g minus their rates in time, and u the velocities nearest in energy.
        """
        system, is_dense = self.system, linear_solver(self.system) == "dense"
        is_position = np.zeros(system.topology.num_rows, bool)
        is_position[system.topology.position_rows] = True
        row_of = np.where(is_position, np.cumsum(is_position) - 1, is_position.sum())  # the last one is zero

        def one_pass(psi, last):
            at = configuration(system, self.P, psi, t)
            parts, at = closures.residual_and_directions(system, at)
            f, f_t = constraints.rows_together(system, at, parts), constraints.time_rate(system, at)
            second, internal = self.split(p)
            momentum = jnp.where(last, self.momenta_of(at, second), 0.0)
            gap = jnp.where(last, f_t, gather_static(jnp.concatenate([f, jnp.zeros(1, f.dtype)]), row_of))
            solve = self._saddle_of_matrices if is_dense else self._saddle_without_matrix
            u = solve(at, last, last | is_position, momentum, -gap)
            then = self.join(self.second_of(at, u), internal)
            moved = normalise(system.topology, step_coordinates(system.topology, psi, u))
            return jnp.where(last, psi, moved), (jnp.max(jnp.abs(f), initial=0.0), then, u)

        # to keep all that a pass makes costs more, compiled and run
        psi, (gaps, then, u) = lax.scan(remat(one_pass), psi, np.array([False, False, True]))
        saved = u[2]
        if system.topology.internal:
            saved = jnp.concatenate([saved, self.split(then[2])[1].values])  # type: ignore[union-attr]
        return psi, then[2], saved, _has_converged(gaps)

    def _saddle_of_matrices(self, at, of_velocities, active, m, g):
        """u of the system of `_project_both`, for the rows that are active."""
        system = self.system
        K = jnp.where(of_velocities, mass_matrix(system, at), metric_matrix(system))
        A = jnp.where(active[:, None], constraints.jacobian(system, at), 0.0)
        return saddle_solve(K, A, m, g, constraints.row_scale(system))[0]

    def _saddle_without_matrix(self, at, of_velocities, active, m, g):
        """The same without a matrix."""
        system, method = self.system, linear_solver(self.system)
        rows = constraint_operator(system, at).masked(active)
        if self.projects_error:
            # along M^-1 A^T, as reactions push: another way back changes the energy beside a singular pose
            lent = jnp.where(of_velocities, 0.0, _LENT * lax.stop_gradient(jnp.sum(at.J[:, 0])))
            return saddle_without_matrix(method, system, at, rows, m, g, weight=jnp.full_like(m, lent))[0]
        mass = jnp.where(of_velocities, 1.0, 0.0).astype(m.dtype)
        weight = (1.0 - mass) * metric(system).astype(m.dtype)
        return saddle_without_matrix(method, system, at, rows, m, g, mass, weight)[0]

    def close(self, t: Array, psi: Array, p: Array) -> tuple[Array, Array]:
        """(coordinates, p) of a state between steps, coordinates on constraints: momenta give velocities there."""
        return self.project_position(t, psi)[0], p

    def project_position(self, t: ScalarLike, psi: Array) -> tuple[Array, Array]:
        """Coordinates after two Newton steps onto the constraints, quaternions of unit length; and True if the first
        step converged."""
        converged = jnp.asarray(True)
        if self.system.has_constraints:
            free = jnp.ones(self.system.topology.num_velocities, psi.dtype)
            psi, gaps = lax.scan(lambda q, _: closing_step(self.system, self.P, q, t, free), psi, length=2)
            converged = _has_converged(gaps)
        return normalise(self.system.topology, psi), converged


def _drive_power(system, at, multipliers):
    """Power (1,) of all drives."""
    return -jnp.dot(multipliers, constraints.time_rate(system, at))[None]


def _has_converged(gaps):
    """True if the first of two Newton steps nearly closed the rows; where the mechanism is locked it never does."""
    return gaps[1] <= _CONVERGING * gaps[0] + _ROUNDING[gaps.dtype.itemsize]


def num_powers(system: System) -> int:
    """Number of entries of the work account: one per force element and rubbing surface, one for all drives."""
    groups: tuple[Any, ...] = (*system.forces, *system.elastic)
    rubbing = 0 if system.friction is None else len(system.friction.names)
    return sum(len(group.names) for group in groups) + rubbing + int(is_rheonomic(system))
