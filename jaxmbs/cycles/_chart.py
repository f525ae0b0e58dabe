"""Charts: as many free numbers as a mechanism has freedoms, for the states near one that keep all constraints.

Directions are an orthonormal basis of what the rows leave free, so that no set of independent coordinates has to be
chosen, which becomes singular at some pose of a turn.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..analysis._linearise import independent_positions
from ..assembly._state import State
from ..constraints import _constraints as constraints
from ..constraints._kic import independent_columns
from ..kinematics._configuration import at_state
from ..kinematics._poses import coordinate_rate, node_parameters, normalise, step_coordinates
from ..math._eigen import eig
from ..math._linalg import full_rank_lstsq
from ..model._internal_states import InternalStates
from ..model._system import System
from ..motion._formulations import Velocity
from ..ode._loop import stop_gradients
from ..runtime import lapack
from ..signal_flow._internal_states import internal_scale

_CLOSINGS = 2  # projections, of two Newton steps each


class Chart(eqx.Module):
    """Numbers xi (n,) of the states near one, zero there: displacements, velocities over a rate, internal states.

    Attributes:
        state: where xi is zero; without derivative, as all of the chart.
        positions: (nv, a) directions of the displacements; velocities: (nv, b) those of the velocities.
        rate: () [1/s] that makes velocities comparable with displacements.
        scale: (ns,) of the internal states.
    """

    state: State
    positions: Array
    velocities: Array
    rate: Array
    scale: Array

    @classmethod
    def at(cls, system: System, state: State, rate: Array) -> "Chart":
        """The chart of a state on the constraints."""
        system, state, rate = stop_gradients((system, state, rate))
        sizes = len(independent_positions(system)), len(independent_columns(system))
        dtype = state.coordinates.dtype
        scale = internal_scale(system).astype(dtype) if system.topology.internal else jnp.zeros(0, dtype)
        if not system.has_constraints:
            eye = jnp.eye(system.topology.num_velocities, dtype=dtype)
            return cls(state, eye, eye, rate, scale)
        A = constraints.jacobian(system, at_state(system, state, inertias=False))
        rows = A[system.topology.position_rows], A
        positions, velocities = (_null_space(A, n) for A, n in zip(rows, sizes, strict=True))
        return cls(state, positions, velocities, rate, scale)

    @property
    def num_numbers(self) -> int:
        """Number n of the free numbers, of each of several charts."""
        return self.positions.shape[-1] + self.velocities.shape[-1] + self.scale.shape[-1]

    def state_at(self, system: System, xi: Array, t: Array) -> State:
        """The state of xi (n,) at a time t, on the constraints."""
        top, near = system.topology, self.state
        a, b = self.positions.shape[1], self.positions.shape[1] + self.velocities.shape[1]
        psi = step_coordinates(top, near.coordinates, self.positions @ xi[:a])
        u = near.velocities + self.rate * (self.velocities @ xi[a:b])
        internal = None
        if near.internal is not None:
            internal = InternalStates(near.internal.values + self.scale * xi[b:], top.internal)
        psi, u = on_constraints(system, t, psi, u, internal)
        return State(t, psi, u, structure=top.structure, internal=internal)

    def numbers_of(self, system: System, state: State, gain: Array, winds: Array) -> Array:
        """xi (n,) of a state nearby, to first order.

        Args: gain: (nv,) that the coordinates have gained; winds: (nv,) True where they count modulo a turn.
        """
        moved, faster = self.differences(system, state, gain, winds)
        parts = [self.positions.T @ moved, self.velocities.T @ faster]
        if state.internal is not None and self.state.internal is not None:
            parts.append((state.internal.values - self.state.internal.values) / self.scale)
        return jnp.concatenate(parts)

    def differences(self, system: System, state: State, gain: Array, winds: Array) -> tuple[Array, Array]:
        """Displacements (nv,) and differences of the velocities (nv,) over the rate, from the chart's state to
        another."""
        moved = displacement(system.topology, self.state.coordinates, state.coordinates) - gain
        turn = 2.0 * np.pi
        moved = jnp.where(winds, moved - turn * jnp.round(moved / turn), moved)
        return moved, (state.velocities - self.state.velocities) / self.rate


def on_constraints(
    system: System, t: Array, psi: Array, u: Array, internal: InternalStates | None
) -> tuple[Array, Array]:
    """Coordinates (nq,) and velocities (nv,) on the constraints, near those given, at internal states."""
    if not system.has_constraints:
        return normalise(system.topology, psi), u
    equations = _equations(system, u, internal)
    for _ in range(_CLOSINGS):
        psi, p, _ = equations.project(t, (psi, equations.join(u, internal), jnp.zeros(0, u.dtype))).y
        u = equations.split(p)[0]
    return psi, u


def _equations(system, u, internal):
    """The formulation in velocities, without scales."""
    parts = (u,) if internal is None else (u, internal.values)
    return Velocity(system, node_parameters(system), jnp.ones_like(jnp.concatenate(parts)))


def displacement(topology, start: Array, end: Array) -> Array:
    """Displacements (nv,) of all columns from coordinates (nq,) to others nearby; exact for joints of one freedom."""
    if topology.is_simple:
        return end - start
    first = np.asarray(topology.node_coordinate)[topology.balls]
    for k in first:  # a quaternion and its negative are one pose
        part = slice(int(k), int(k) + 4)
        end = end.at[part].multiply(jnp.where(jnp.dot(start[part], end[part]) < 0.0, -1.0, 1.0))
    eye = jnp.eye(topology.num_velocities, dtype=start.dtype)
    T = jnp.stack([coordinate_rate(topology, start, e) for e in eye], axis=1)
    return full_rank_lstsq(T, (end - start)[:, None])[:, 0]


def rate_of_numbers(system: System, chart: Chart) -> Array:
    """Rates (n,) of xi along the motion through the chart's state [1/s]."""
    return rates_seen(system, chart, chart.state)


def rates_seen(system: System, chart: Chart, state: State) -> Array:
    """Rates (n,) of xi along the motion through a state nearby [1/s]."""
    u = state.velocities
    a, rates = jnp.split(accelerations_and_rates(stop_gradients(system), state), [u.shape[0]])
    return jnp.concatenate([chart.positions.T @ u, chart.velocities.T @ a / chart.rate, rates / chart.scale])


def accelerations_and_rates(system: System, state: State) -> Array:
    """Accelerations and rates of internal states (nv + ns,) at a state."""
    equations = _equations(system, state.velocities, state.internal)
    second = equations.join(state.velocities, state.internal)
    return equations.rate(state.t, (state.coordinates, second, jnp.zeros(0, second.dtype)))[1]


def quickest(system: System, charts: Chart) -> Array:
    """Largest size () of the rates at which small deviations from the states of charts (p,) change [1/s]."""
    if not charts.num_numbers:
        return jnp.zeros((), charts.rate.dtype)

    def size(chart):
        rates = lambda xi: rates_seen(system, chart, chart.state_at(system, xi, chart.state.t))
        A = value_and_slope(rates, jnp.zeros(chart.num_numbers, chart.rate.dtype))[1]
        return jnp.max(jnp.abs(eig(stop_gradients(A))[0]))

    return jnp.max(lax.map(size, charts))


def value_and_slope(function: Callable[[Array], Array], z: Array) -> tuple[Array, Array]:
    """(value (n,), slope (n, k)) of a function of z (k,), evaluated once."""
    if not z.shape[0]:
        value = function(z)
        return value, jnp.zeros((*value.shape, 0), value.dtype)
    along = lambda direction: jax.jvp(function, (z,), (direction,))
    return jax.vmap(along, out_axes=(None, 1))(jnp.eye(z.shape[0], dtype=z.dtype))


def _null_space(A: Array, size: int) -> Array:
    """Orthonormal directions (nv, size) that rows A (rows, nv) leave free, where so many are."""
    lengths = jnp.sqrt(jnp.sum(A * A, axis=1, keepdims=True))
    A = A / jnp.where(lengths > 0.0, lengths, 1.0)
    return lax.stop_gradient(lapack.eigh(A.T @ A)[1][:, :size])
