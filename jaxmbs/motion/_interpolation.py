"""States between the saved ones of a motion: quintic polynomials through coordinates, rates and accelerations."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from .. import dynamics  # by its room: few motions are asked for states between the saved ones
from ..assembly._assembly import closing_step, consistent_velocities
from ..assembly._state import State
from ..kinematics._configuration import configuration, with_velocities
from ..kinematics._poses import coordinate_rate, node_parameters, normalise
from ..model._changes import Changes, with_changes
from ..model._internal_states import InternalStates
from ..model._system import System
from ..signal_flow._internal_states import internal_rates


class Knots(NamedTuple):
    """Saved states: times (k,), coordinates, their rates and second rates (k, nq); of one of them without k.  The
    internal states of force elements follow the coordinates.  `changes` are those of the states."""

    t: Array
    psi: Array
    rate: Array
    second: Array
    changes: Changes | None

    def number(self, k: Array | int) -> "Knots":
        """One of them."""
        return jax.tree.map(lambda x: x[k], self)


def knots_of(system: System, states: State) -> Knots:
    """Of states (k,), with accelerations by forward dynamics."""
    top = system.topology

    def at(state):
        a, _ = dynamics.forward_dynamics(system, state)
        psi, u = state.coordinates, state.velocities
        rate = coordinate_rate(top, psi, u)
        found = psi, *jax.jvp(lambda psi, u: coordinate_rate(top, psi, u), (psi, u), (rate, a))
        if state.internal is None:
            return found
        return tuple(map(_concatenated, found, _internal_knot(system, state, rate, a)))

    psi, rate, second = jax.vmap(at)(states)
    return Knots(states.t, psi, rate, second, states.changes)


def _concatenated(*parts):
    return jnp.concatenate(parts)


def _internal_knot(system, state, psi_dot, a):
    """Internal states (ns,) of a state, their rates and second rates along the motion."""
    system = with_changes(system, state)
    P, values = node_parameters(system), state.internal.values

    def rates(psi, u, values, t):
        at = configuration(system, P, psi, t, inertias=False, internal=values)
        return internal_rates(system, with_velocities(system, at, u))

    at = state.coordinates, state.velocities, values, state.t
    rate = rates(*at)
    return values, *jax.jvp(rates, at, (psi_dot, a, rate, jnp.ones_like(state.t)))


def between(system: System, P: Array, first: Knots, second: Knots, t: Array) -> State:
    """The state at a time t () between two knots, on all constraints, of the mechanism in force at the first."""
    if first.changes is not None:
        system = with_changes(system, first)
        P = node_parameters(system)
    psi, rate = _quintic(first, second, t)
    internal, top = None, system.topology
    if top.internal:
        internal = InternalStates(psi[top.num_coordinates :], top.internal)
        psi, rate = psi[: top.num_coordinates], rate[: top.num_coordinates]
    free = jnp.ones(top.num_velocities, psi.dtype)
    if system.has_constraints:
        psi = lax.scan(lambda q, _: closing_step(system, P, q, t, free), psi, length=2)[0]
    psi = normalise(top, psi)
    u = consistent_velocities(system, P, psi, _velocities(top, psi, rate), t, free)
    return State(t, psi, u, structure=top.structure, internal=internal, changes=first.changes)


def _quintic(first: Knots, second: Knots, t):
    """Value and rate at t of the polynomial that has both rates of both ends."""
    width = second.t - first.t
    h = jnp.where(width > 0.0, width, 1.0)  # knots of equal time: the first one stands
    s = (t - first.t) / h
    c = [first.psi, h * first.rate, h**2 * first.second / 2.0]
    gap = second.psi - (c[0] + c[1] + c[2])
    slope = h * second.rate - (c[1] + 2.0 * c[2])
    bend = (h**2 * second.second - 2.0 * c[2]) / 2.0
    c += [10.0 * gap - 4.0 * slope + bend, -15.0 * gap + 7.0 * slope - 2.0 * bend, 6.0 * gap - 3.0 * slope + bend]
    value = sum(x * s**k for k, x in enumerate(c))
    return value, sum(k * x * s ** (k - 1) for k, x in enumerate(c) if k) / h


def _velocities(top, psi, rate):
    """Velocities (nv,) of the rates of the coordinates (nq,).

    The map from velocities to rates is the identity for simple joints, for balls half a map with orthonormal
    columns; so its transpose, times four for balls, takes rates back.
    """
    u = jax.ShapeDtypeStruct((top.num_velocities,), psi.dtype)
    (u,) = jax.linear_transpose(lambda u: coordinate_rate(top, psi, u), u)(rate)
    return u * jnp.asarray([4.0 if kind == "ball" else 1.0 for kind in top.node_kind], u.dtype)
