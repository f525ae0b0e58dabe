"""Momenta and loads of elastic bodies on the nodes that carry their interfaces, and on their modes.

With flows `y = B u_e` of interface twists u_e, momenta `pi = dT/dy` and loads f on y, each body obeys
`pi_dot + g = f` with its gyroscopic loads g.  So its interfaces carry the momenta `h = B^T pi` and
`h_dot = B^T f + (B_dot^T pi - B^T g)`: elastic bodies add h and the loads on the right to those of rigid bodies.
Source: S2 (29), (38)-(42) for bodies that deform.
"""

import jax
import jax.numpy as jnp

from ..errors import ModelError
from ..kinematics.configuration import Configuration, Moving, resting
from ..kinematics.elastic import (
    ElasticState,
    Parts,
    along_motion,
    elastic_state,
    flow_map,
    flow_rate,
    on_interfaces,
    summed,
)
from ..model.system import System


def elastic_momenta(system: System, at: Moving) -> Parts:
    """Momenta `B^T pi` of the elastic bodies."""

    def momenta(body, s: ElasticState):
        return on_interfaces(body, s.R, s.x, s.q, body.momenta(s.q, s.flow))

    return summed(momenta, system, at)


def inertial_loads(system: System, at: Moving) -> Parts:
    """What the motion does to the momenta, `B_dot^T pi - B^T g`, and gravity."""

    def loads(body, s: ElasticState):
        pi = body.momenta(s.q, s.flow)
        turning = jax.jvp(lambda R, x, q: on_interfaces(body, R, x, q, pi), (s.R, s.x, s.q), along_motion(s))[1]
        load = body.gravity_loads(s.q, system.gravity @ s.R) - body.gyroscopic_loads(s.q, s.flow)
        return jax.tree.map(jnp.add, turning, on_interfaces(body, s.R, s.x, s.q, load))

    return summed(loads, system, at)


def needed_loads(system: System, at: Moving, V_dot, u_dot, owner=None) -> Parts:
    """Loads that the elastic bodies need beside gravity for twist rates V_dot (nodes, 6), accelerations u_dot."""

    def loads(body, s: ElasticState, V_dot, rates_dot):
        load = needed(body, s, flow_rate(body, s, V_dot, rates_dot), system.gravity @ s.R)
        return on_interfaces(body, s.R, s.x, s.q, load)

    return summed(loads, system, at, (V_dot, u_dot), owner)


def needed(body, s: ElasticState, rate, gravity):
    """Load (6 + m,) on the flow of one body that its rate (6 + m,) needs beside gravity (3,), floating axes."""
    pi_dot = jax.jvp(body.momenta, (s.q, s.flow), (s.flow[6:], rate))[1]
    return pi_dot + body.gyroscopic_loads(s.q, s.flow) - body.gravity_loads(s.q, gravity)


def elastic_efforts(system: System, at: Moving, owner=None) -> tuple[Parts, jnp.ndarray]:
    """Loads of stiffness and damping, and the power of the dampers of every elastic body (bodies,).

    Source: S2 (56)-(57), (72) with the strains in place of springs.
    """

    def loads(body, s: ElasticState):
        return on_interfaces(body, s.R, s.x, s.q, body.strain_loads(s.q, s.flow))

    powers = []
    for group in system.elastic:
        rates = elastic_state(system, group, at).flow[:, 6:]
        powers.append(-jnp.einsum("ek,ekl,el->e", rates, group.body.damping, rates))
    return summed(loads, system, at, owner=owner), jnp.concatenate(powers)


def gravity_loads(system: System, at: Configuration) -> Parts:
    """Loads of gravity on the elastic bodies.  Source: S2 (75)."""

    def loads(body, s: ElasticState):
        return on_interfaces(body, s.R, s.x, s.q, body.gravity_loads(s.q, system.gravity @ s.R))

    return summed(loads, system, resting(system, at))


def strain_energy(system: System, at: Configuration):
    """Strain energy [J] of the elastic bodies.  Source: S2 (70)."""
    total = jnp.zeros((), at.psi.dtype)
    for group in system.elastic:
        q = elastic_state(system, group, resting(system, at)).q
        total = total + 0.5 * jnp.einsum("ek,ekl,el->", q, group.body.stiffness, q)
    return total


def elastic_energies(system: System, at: Moving):
    """(kinetic energy, potential of gravity) [J] of the elastic bodies."""
    kinetic = potential = jnp.zeros((), at.psi.dtype)
    for group in system.elastic:
        s = elastic_state(system, group, at)
        kinetic = kinetic + jnp.sum(jax.vmap(lambda body, s: body.kinetic_energy(s.q, s.flow))(group.body, s))
        moment = jnp.einsum("eij,ej->ei", s.R, jax.vmap(lambda body, q: body.first_moment(q))(group.body, s.q))
        lifted = group.body.inertia[:, 3, 3] @ (s.x[:, 0] + at.origin[None]) + jnp.sum(moment, axis=0)
        potential = potential - jnp.dot(system.gravity, lifted)
    return kinetic, potential


def elastic_body_stiffness(system: System, at: Configuration, Gamma):
    """`sum G^T K G` (N, N) with the rates of deformation G per independent velocity.  Source: S2 (68)-(71)."""
    total = jnp.zeros((Gamma.shape[1],) * 2, at.psi.dtype)
    for group in system.elastic:
        s = elastic_state(system, group, resting(system, at))
        G = flow_map(system, group, at, s)[:, 6:] @ Gamma
        total = total + jnp.einsum("ekn,ekl,elm->nm", G, group.body.stiffness, G)
    return total


def total_mass(system: System):
    """Mass [kg] of all rigid and elastic bodies."""
    return jnp.sum(system.mass) + sum(jnp.sum(group.body.inertia[:, 3, 3]) for group in system.elastic)


def refuse_elastic(system: System, what: str) -> None:
    """Raises: ModelError for a question that is answered for rigid bodies only."""
    names = [name for group in system.elastic for name in group.names]
    if names:
        raise ModelError([f"{what} are of rigid bodies; elastic are: {', '.join(names)} (mass_matrix holds them)"])
