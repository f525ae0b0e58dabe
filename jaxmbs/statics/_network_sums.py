"""Sums over a network: of bonds on bodies, and along its spanning tree by pointer doubling (log2 of its depth steps);
in small networks each is one product with a matrix, which compiles and runs in a fraction of the time.

Wrenches are (force, moment) and twists (linear, angular), in world axes about one common origin, so that a wrench
passes from body to body unchanged and no factorisation is needed on a tree.
"""

import jax.numpy as jnp

from ..runtime import constant_product
from ._network import BodyNetwork


def subtree_sums(network: BodyNetwork, x):
    """Sum of the rows of x (p, ...) over each body and all that hang on it in the spanning tree."""
    for low, high in network.tree.jumps:
        x = x.at[high].add(x[low])
    return x


def ancestor_sums(network: BodyNetwork, x):
    """Sum of the rows of x (p, ...) over each body and all between it and the ground; transpose of the above."""
    for low, high in network.tree.jumps:
        x = x.at[low].add(x[high])
    return x


def body_wrenches(network: BodyNetwork, wrench):
    """Sum of the bonds' wrenches (q, 6) on every body (p, 6), plus on children, minus on parents: `I_E w`.

    Source: S1 (27).
    """
    if network.is_small:
        return constant_product(network.incidence, wrench)
    parent, child = network.ends
    total = jnp.zeros((len(network.bodies) + 1, 6), wrench.dtype)
    return total.at[child].add(wrench).at[parent].add(-wrench)[:-1]


def bond_twists(network: BodyNetwork, twist):
    """Twist of every bond's child less its parent's (q, 6), from the bodies' (p, 6); transpose of `body_wrenches`."""
    if network.is_small:
        return constant_product(network.incidence.T, twist)
    parent, child = network.ends
    twist = jnp.concatenate([twist, jnp.zeros((1, 6), twist.dtype)])
    return twist[child] - twist[parent]


def tree_wrenches(network: BodyNetwork, loads):
    """Wrenches (q, 6) of the tree's bonds that balance the loads (p, 6), zero in the bonds that close loops.

    The load of the reference body of a floating part is not used: it must balance the others.
    Source: S1 (28), the particular solution.
    """
    if network.is_small:
        return constant_product(network.load_paths, loads)
    tree, held = network.tree, network.tree.attached_bodies
    carried = subtree_sums(network, loads)[held] * jnp.asarray(tree.sign[held], loads.dtype)[:, None]
    return jnp.zeros((len(network.bonds), 6), loads.dtype).at[tree.bond[held]].set(carried)


def tree_twists(network: BodyNetwork, across):
    """Twists of the bodies (p, 6) from those across the tree's bonds (q, 6); transpose of `tree_wrenches`."""
    if network.is_small:
        return constant_product(network.load_paths.T, across)
    tree, held = network.tree, network.tree.attached_bodies
    steps = across[tree.bond[held]] * jnp.asarray(tree.sign[held], across.dtype)[:, None]
    return ancestor_sums(network, jnp.zeros((len(network.bodies), 6), across.dtype).at[held].set(steps))
