"""Elastic bodies on the tree: from node twists to their flows, and from loads on flows back to wrenches on nodes."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..math._linalg import skew
from ..math._spatial import dot, momentum
from ..model._elastic import ElasticGroup
from ..model._system import System
from ._configuration import Configuration, VelocityKinematics, at_rest, node_motion
from ._tree import subtrees
from ._tree import tree_mass_matrix as tree_mass_matrix


class ElasticState(NamedTuple):
    """Motion of one elastic body or many: rotation R of the floating frame, positions x and world twists V of the
    interfaces, modal rates; deformations q and flow of `ElasticBody`."""

    R: Array
    x: Array
    V: Array
    rates: Array
    q: Array
    flow: Array


def elastic_state(system: System, group: ElasticGroup, at: VelocityKinematics) -> ElasticState:
    """Motion of the bodies of a group."""
    frames = np.array(group.frames)
    R, x, modal = at.R[frames], at.x[frames], at.psi[np.array(group.coordinates, int)]
    twists, rates = interface_rates(system, group, at.V, at.u)

    def of_body(body, R, x, V, modal, rates):
        q = body.deformations(R, x, modal)
        return ElasticState(R[0], x, V, rates, q, body.flow(R[0], x, q, V, rates))

    return jax.vmap(of_body)(group.body, R, x, twists, modal, rates)


def interface_rates(system: System, group: ElasticGroup, V, u):
    """Twists, or their rates, of the interfaces (bodies, interfaces, 6) and modal parts of u (bodies, modes)."""
    node = np.asarray(system.topology.frame_node)[np.array(group.frames)]
    return jnp.concatenate([V, jnp.zeros((1, 6), V.dtype)])[node], u[np.array(group.columns, int)]


def interface_wrenches(body, R, x, q, load):
    """Wrenches (interfaces, 6) about the world origin and modal parts (modes,) of a load (6 + m,) on the flow."""
    at_rest = jnp.zeros((len(x), 6), load.dtype), jnp.zeros(body.num_modes, load.dtype)
    return jax.linear_transpose(lambda V, rates: body.flow(R, x, q, V, rates), *at_rest)(load)


def pose_rates(s: ElasticState):
    """Rates of (R, x, q)."""
    return skew(s.V[0, :3]) @ s.R, s.V[:, 3:] + jnp.cross(s.V[:, :3], s.x), s.flow[6:]


def flow_rate(body, s: ElasticState, V_dot, rates_dot):
    """Rate of the flow (6 + m,) at rates V_dot (interfaces, 6) of the twists and accelerations of the modes."""
    moving = (*pose_rates(s), V_dot, rates_dot)
    return jax.jvp(body.flow, (s.R, s.x, s.q, s.V, s.rates), moving)[1]


def flow_map(system: System, group: ElasticGroup, at: Configuration, s: ElasticState):
    """Flows (bodies, 6 + m, nv) per unit velocity."""
    top, S = system.topology, at.S
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])
    path = path[np.asarray(top.frame_node)[np.array(group.frames)]]
    twists = jnp.asarray(path, S.dtype)[:, :, None, :] * S.T[None, None]
    rates = jnp.asarray(np.array(group.columns, int)[..., None] == np.arange(top.num_velocities), S.dtype)

    def of_body(body, s, twists, rates):
        return jax.vmap(lambda V, rates: body.flow(s.R, s.x, s.q, V, rates), (2, 1), 1)(twists, rates)

    return jax.vmap(of_body)(group.body, s, twists, rates)


def mass_matrix(system: System, at: Configuration):
    """Mass matrix (nv, nv) of the tree of rigid and elastic bodies.  Source: S2 (35), every column independent."""
    M = tree_mass_matrix(system.topology.nodes, at.S, at.J)
    for group in system.elastic:
        s = elastic_state(system, group, at_rest(system, at))
        flows = flow_map(system, group, at, s)
        z = jax.vmap(lambda body, q, flows: jax.vmap(body.speeds, (None, 1), 1)(q, flows))(group.body, s.q, flows)
        M = M + jnp.einsum("ekn,ekm->nm", z, group.body.inertia @ z)
    return M


def mass_operator(system: System, at: Configuration):
    """Function that gives the momenta (nv,) of velocities (nv,): products with `mass_matrix`, which is not formed."""
    top = system.topology
    inertias = [interface_inertia(system, group, at) for group in system.elastic]

    def momenta(u):
        twist, column = node_motion(top, at.S, u), jnp.zeros_like(u)
        wrench = jnp.concatenate([momentum(at.J, twist), jnp.zeros((1, 6), u.dtype)])
        for group, E in zip(system.elastic, inertias, strict=True):
            V, rates = interface_rates(system, group, twist, u)
            load = jnp.einsum("ekl,el->ek", E, jnp.concatenate([V.reshape(len(V), -1), rates], axis=1))
            on = np.asarray(top.frame_node)[np.array(group.frames)]
            wrench = wrench.at[on].add(load[:, : 6 * on.shape[1]].reshape(V.shape))
            column = column.at[np.array(group.columns, int)].add(load[:, 6 * on.shape[1] :])
        return dot(at.S, subtrees(top.nodes, wrench[:-1])) + column

    return momenta


def interface_inertia(system: System, group: ElasticGroup, at: Configuration):
    """Inertia (bodies, k, k) of elastic bodies on world twists of their interfaces, then on the rates of modes.

    Source: S2 (35) for one body.
    """
    s = elastic_state(system, group, at_rest(system, at))
    count = 6 * s.x.shape[1]
    unit = jnp.eye(count + len(group.columns[0]), dtype=at.psi.dtype)

    def of_body(body, s):
        def speeds(rates):
            flow = body.flow(s.R, s.x, s.q, rates[:count].reshape(-1, 6), rates[count:])
            return body.speeds(s.q, flow)

        Z = jax.vmap(speeds, out_axes=1)(unit)
        return Z.T @ body.inertia @ Z

    return jax.vmap(of_body)(group.body, s)
