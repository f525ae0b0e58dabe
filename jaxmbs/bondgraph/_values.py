"""Values of a bond graph at a state: moduli of transformers, flows of junctions, efforts of the elements.

All flows are linear in the rates w = (phi_dot, s) at the roots, s the prescribed rates: `u = L w`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..assembly._state import State
from ..constraints import _constraints as constraints
from ..constraints._kic import independent_columns
from ..dynamics._efforts import element_efforts
from ..dynamics._loads import Loads, on_columns
from ..dynamics._newton_euler import all_efforts, motion_with_friction
from ..dynamics.paper._fields import world_inertias
from ..kinematics._configuration import Configuration, VelocityKinematics, configuration, node_motion, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._poses import body_frame, coordinate_rate, frame_twists
from ..math._linalg import full_rank_lstsq
from ..model._system import System
from ..runtime import jit
from ..signal_flow._acting_laws import acting_laws
from ..signal_flow._signals import with_signals
from ._elastic import elastic_fields, elastic_values, field_gyristor, field_inertia, field_weight
from ._views import drive_rows


def rate_map(system: System, at: Configuration):
    """L (nv, N + D): velocities per independent velocity and per prescribed rate, `u = L (phi_dot, s)`.

    Its first N columns are Gamma of `velocity_map`, the others times s its b.  Source: S2 (3)-(5).
    """
    n, driven = system.topology.num_velocities, drive_rows(system)
    pick = np.eye(n)[independent_columns(system)]
    if not system.has_constraints:
        return jnp.asarray(pick.T, at.psi.dtype)
    A = constraints.jacobian(system, at)
    right = np.zeros((A.shape[0] + len(pick), len(pick) + len(driven)))
    right[A.shape[0] :, : len(pick)] = np.eye(len(pick))
    right[driven, len(pick) + np.arange(len(driven))] = 1.0
    rows = jnp.concatenate([A, jnp.asarray(pick, at.psi.dtype)])
    return full_rank_lstsq(rows, jnp.asarray(right, at.psi.dtype))


def root_rates(system: System, P, psi, u, t):
    """w (N + D,): the independent velocities, then the prescribed rates s = -f_t."""
    at = configuration(system, P, psi, t, inertias=False)
    prescribed = -constraints.time_rate(system, at)[np.asarray(drive_rows(system), int)]
    return jnp.concatenate([u[independent_columns(system)], prescribed])


def body_flows(system: System, at: Configuration, V):
    """Angular velocity and velocity of the centre of mass (bodies, 6) from node twists V (nodes, 6)."""
    own = body_frame(system.topology)
    twist = frame_twists(system, V)[own]
    com = at.x[own] + jnp.einsum("bij,bj->bi", at.R[own], system.com)
    return jnp.concatenate([twist[:, :3], twist[:, 3:] + jnp.cross(twist[:, :3], com)], axis=1)


def apply_inertia(system: System, inertia, flow):
    """Angular momentum about the centre of mass, then momentum (bodies, 6, ...), of flows (bodies, 6, ...).

    Source: S2 (31)-(32).
    """
    turning = jnp.einsum("bij,bj...->bi...", inertia, flow[:, :3])
    return jnp.concatenate([turning, jnp.einsum("b,bi...->bi...", system.mass, flow[:, 3:])], axis=1)


def _moduli_and_inertia(system, P, psi, t, internal=None):
    """Body moduli G (bodies, 6, r), those of elastic bodies and I* (r, r), the drives' columns included; beside them
    the configuration, the rate map, its twists (r, nodes, 6), the world inertias and the fields of elastic bodies.
    Source: S2 (11)-(15), (35)."""
    at = configuration(system, P, psi, t, internal=internal)
    L, inertia = rate_map(system, at), world_inertias(system, at)
    twists = jax.vmap(lambda u: node_motion(system.topology, at.S, u), 1)(L)
    G = jax.vmap(lambda V: body_flows(system, at, V), out_axes=-1)(twists)
    deforming = elastic_fields(system, at, L)
    I = jnp.einsum("bki,bkj->ij", G, apply_inertia(system, inertia, G)) + field_inertia(deforming)
    return (G, tuple(f.modulus for f in deforming), I), (at, L, twists, inertia, deforming)


def body_moduli(system: System, P, psi, t):
    """G (bodies, 6, N + D), and by elastic group G_y (bodies, k, N + D): flows of the bodies per root rate.

    Source: S2 (11)-(15)."""
    return _moduli_and_inertia(system, P, psi, t)[0][:2]


class GraphValues(NamedTuple):
    """Values of all views at a state; r = N + D root rates, bodies' flows being (angular 3, linear 3).

    Attributes:
        at: velocity kinematics of the tree.
        rates (r,), map L (nv, r): `u = L w`.
        modulus, modulus_rate (bodies, 6, r), flow (bodies, 6), inertias (bodies, 3, 3): of the bodies.
        inertia, inertia_rate (r, r): I* and its rate; gyristor (r, r): GR.
        ports: by force group modulus (n, size, r), flow, stored and total effort (n, size).
        elastic: by group of elastic bodies.
        gravity (r,): its effort; total (r,): the effort Q of all ports and gravity.
        friction: moduli, flows and efforts of the rubbing surfaces, empty without any.
    """

    at: VelocityKinematics
    rates: Array
    map: Array
    modulus: Array
    modulus_rate: Array
    flow: Array
    inertias: Array
    inertia: Array
    inertia_rate: Array
    gyristor: Array
    ports: list
    elastic: tuple
    gravity: Array
    total: Array
    friction: tuple = ()


@jit
def graph_values(system: System, P, state: State) -> GraphValues:
    """Values of the graph at a state; accelerations are not needed.  Source: S2 (31)-(41), (56)-(76)."""
    psi, u, t = state.coordinates, state.velocities, state.t
    rates = (coordinate_rate(system.topology, psi, u), jnp.ones_like(t))
    (G, _, I), (G_dot, G_y_dot, I_dot), (at, L, twists, inertias, deforming) = jax.jvp(
        lambda psi, t: _moduli_and_inertia(system, P, psi, t, state.internal), (psi, t), rates, has_aux=True
    )
    at, ports = with_signals(system, with_velocities(system, at, u)), []
    for group, law in acting_laws(system, at):
        port, of_flow = group.port, lambda V, u, group=group: element_flows(system, group, at, V, u)[2]
        _, displacement, flow = element_flows(system, group, at, at.V, u)
        stored = jax.vmap(lambda law, x, f, port=port: port.stored_effort(law, x, f, t))(law, displacement, flow)
        modulus = jax.vmap(of_flow, in_axes=(0, 1), out_axes=-1)(twists, L)
        ports.append((modulus, flow, stored, element_efforts(group, law, displacement, flow, t)))
    elastic = elastic_values(system, at, deforming, G_y_dot)
    gyristor = jnp.einsum("bki,bkj->ij", G_dot, apply_inertia(system, inertias, G))
    gravity = jnp.einsum("b,bci,c->i", system.mass, G[:, 3:], system.gravity) + field_weight(elastic)
    return GraphValues(
        at=at,
        rates=root_rates(system, P, psi, u, t),
        map=L,
        modulus=G,
        modulus_rate=G_dot,
        flow=body_flows(system, at, at.V),
        inertias=inertias,
        inertia=I,
        inertia_rate=I_dot,
        gyristor=gyristor + field_gyristor(system, elastic),
        ports=ports,
        elastic=elastic,
        gravity=gravity,
        total=L.T @ applied_efforts(system, at) + gravity,
        friction=() if system.friction is None else _friction_ports(system, at, twists),
    )


def _friction_ports(system, at, twists):
    """Moduli (n, 6, r), flows (n, 6) and efforts (n, 6) of the rubbing surfaces: twist of the child relative to the
    parent, and the wrench against it."""
    f = system.friction

    def slipping(V):
        frames = frame_twists(system, V)
        return frames[np.asarray(f.children)] - frames[np.asarray(f.parents)]

    modulus = jax.vmap(slipping, out_axes=-1)(twists)
    return modulus, slipping(at.V), -motion_with_friction(system, at).wrench


def applied_efforts(system: System, at: VelocityKinematics):
    """Efforts (nv,) of force elements, strains and friction on the tree's velocities.  Source: S2 (76)."""
    F, Q, _ = all_efforts(system, at)
    return on_columns(system, at, Loads(F, Q))
