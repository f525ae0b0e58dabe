"""Condensation of the modes of elastic bodies: the condensed inertia couples their interfaces on the body graph."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..kinematics._elastic import interface_inertia
from ..math._spatial import dot, momentum
from ..math._spd import spd_inverse
from ..model._system import System
from ._body_graph import BodyGraph
from ._body_matrix import JointMaps, solve_columns

_SPIN = (0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)


class CondensedBodies(NamedTuple):
    """Inertia of the bodies of one elastic group on the world twists of their interfaces, modes condensed.

    Attributes:
        whole, inertia (bodies, i, i, 6, 6): before and after their modes are eliminated.
        follow (bodies, modes, i, 6): minus the rates of the modes per twist rate of the interfaces, without load.
        modal (bodies, modes, modes): inertia of the modes, `inverse` of it with the weight.
    """

    whole: Array
    inertia: Array
    follow: Array
    modal: Array
    inverse: Array


def condense_modes(system: System, at, mass, weight) -> list[CondensedBodies]:
    """Condensed inertias of all elastic groups at a configuration.

    Args: mass: () factor of the inertias; weight (nv,): added to the modes' own, which `modal` leaves out.
    """
    return [
        _condense(mass * interface_inertia(system, group, at), weight[np.array(group.columns, int)])
        for group in system.elastic
    ]


def _condense(E, weight):
    k = E.shape[1] - weight.shape[1]
    i = k // 6
    whole, modal = E[:, :k, :k], E[:, k:, k:] + jax.vmap(jnp.diag)(weight)
    inverse = jax.vmap(spd_inverse)(modal)
    follow = inverse @ E[:, k:, :k]
    blocks = [x.reshape(-1, i, 6, i, 6).transpose(0, 1, 3, 2, 4) for x in (whole, whole - E[:, :k, k:] @ follow)]
    return CondensedBodies(*blocks, follow.reshape(*follow.shape[:2], i, 6), E[:, k:, k:], inverse)


def lumped_inertia(system: System, J, parts):
    """Inertias (nodes, 10) with each elastic body's rigid inertia in equal parts on its interfaces; only for
    scaling."""
    J = jnp.concatenate([J, jnp.zeros((1, 10), J.dtype)])
    for group, part in zip(system.elastic, parts, strict=True):
        E = jnp.sum(part.whole, axis=(1, 2)) / part.whole.shape[1]
        rigid = [E[:, 3, 3], E[:, 1, 5] * -1.0, E[:, 0, 5], E[:, 0, 4] * -1.0, *(E[:, a, b] for a, b in _SPIN)]
        at = np.asarray(system.topology.frame_node)[np.array(group.frames)]
        J = J.at[at].add(jnp.stack(rigid, axis=1)[:, None])
    return J[:-1]


def column_inertia(system: System, S, composite, parts):
    """Inertia (nv,) of what each column carries; composite: inertias (nodes, 10) of subtrees."""
    size = dot(S, momentum(composite, S))
    for group, part in zip(system.elastic, parts, strict=True):
        size = size.at[np.array(group.columns, int)].set(jnp.diagonal(part.modal, axis1=1, axis2=2))
    return size


def solve_with_modes(system: System, graph: BodyGraph, maps: JointMaps, parts, factor, r):
    """Accelerations (nv,) from efforts r (nv,) on the tree's columns and the modes."""
    load = jnp.zeros((len(graph.node) + 1, 6), r.dtype)
    for group, at, part in zip(system.elastic, graph.clusters, parts, strict=True):
        wrench = -jnp.einsum("emib,em->eib", part.follow, r[np.array(group.columns, int)])
        load = load.at[at].add(jnp.einsum("eiba,eib->eia", maps.world[at], wrench))
    a, v = solve_columns(graph, maps, factor, r, load)
    for group, at, part in zip(system.elastic, graph.clusters, parts, strict=True):
        columns = np.array(group.columns, int)
        twist = jnp.einsum("eiab,eib->eia", maps.world[at], v[at])
        rates = jnp.einsum("emn,en->em", part.inverse, r[columns]) - jnp.einsum("emib,eib->em", part.follow, twist)
        a = a.at[columns].set(rates)
    return a
