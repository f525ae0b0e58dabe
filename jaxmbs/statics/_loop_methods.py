"""Self-equilibrated wrenches of least compliance: by the parameters of the loops, or by the twists of the nodes.

Both answer one question, for wrenches y of the chains of bonds (`series_reduction`): among those that load no body,
which makes `1/2 y.C y + d.y` least?  `factor(network, C)` is done once; `correct(network, factors, d)` answers for d
(m, 6).  C (m, 6, 6) is positive definite, about one common origin.

`penalty` (double, single precision) is the stiffness of the free directions relative to the weakest bond: as large as
rounding permits.  Nodes permit less, since a ladder of n loops has a condition number of n^4 by itself.  Each of the
proximal `iterations` reduces the error by the ratio of that penalty to the stiffness of a loop, which is little on
nearly singular loops.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .. import blocksparse
from ..blocksparse import BlockMatrix, Pattern
from ..math._spd import refined, spd_inverse
from ..runtime import constant_product, tuning
from ._cycles import cycle_pattern
from ._network import BodyNetwork
from ._series_reduction import series_reduction


class ForceMethod:
    """y = Y lambda with `(Y^T C Y) lambda = -Y^T d`, dense, each chain of bonds as one.  Source: S1 (28)-(29)."""

    penalty, iterations = {8: 1e8, 4: 1e3}, 4

    @staticmethod
    def factor(network: BodyNetwork, C):
        """Compliance of the loops (6 S, 6 S) and its inverse."""
        Y = _chain_pattern(network)
        m, S = Y.shape
        pairs = jnp.asarray((Y[:, :, None] * Y[:, None, :]).reshape(m, S * S), C.dtype)
        blocks = (pairs.T @ C.reshape(m, 36)).reshape(S, S, 6, 6)
        matrix = blocks.transpose(0, 2, 1, 3).reshape(6 * S, 6 * S)
        return matrix, spd_inverse(matrix)

    @staticmethod
    def correct(network: BodyNetwork, factors, d):
        """y (m, 6)."""
        Y = jnp.asarray(_chain_pattern(network), d.dtype)
        matrix, inverse = factors
        parameters = refined(lambda r: inverse @ r, lambda x: matrix @ x, -(Y.T @ d).reshape(-1), 1)
        return Y @ parameters.reshape(-1, 6)


class _NodalFactors(NamedTuple):
    stiffness: jax.Array  # (m, 6, 6) of every chain of bonds
    nodes: blocksparse.Factor | None


class NodalMethod:
    """Chains of bonds as springs between nodes: one symmetric positive definite block-sparse system for the nodes."""

    penalty, iterations = {8: 1e6, 4: 1e2}, 2

    @staticmethod
    def factor(network: BodyNetwork, C):
        """Stiffnesses of the chains and the factor of the nodes' equilibrium."""
        r, stiffness = series_reduction(network), jax.vmap(spd_inverse)(C)
        if r.num_nodes == 0:
            return _NodalFactors(stiffness, None)
        first, last = np.where(r.ends[:, 0] == r.ends[:, 1], r.num_nodes, r.ends.T)
        diagonal = jnp.zeros((r.num_nodes + 1, 6, 6), C.dtype).at[first].add(stiffness).at[last].add(stiffness)[:-1]
        upper = jnp.zeros((len(r.edges) + 1, 6, 6), C.dtype).at[r.edge].add(-stiffness)[:-1]
        matrix = BlockMatrix(Pattern(r.num_nodes, 6, r.edges), diagonal, upper)
        return _NodalFactors(stiffness, blocksparse.factor(matrix, "cholesky"))

    @staticmethod
    def correct(network: BodyNetwork, factors, d):
        """y (m, 6)."""
        r = series_reduction(network)
        first, last = r.ends.T
        load = jnp.einsum("mij,mj->mi", factors.stiffness, d)
        twist = jnp.zeros((r.num_nodes + 1, 6), d.dtype)
        if r.num_nodes:
            twist = twist.at[last].add(load).at[first].add(-load)
            twist = twist.at[:-1].set(blocksparse.solve(factors.nodes, twist[:-1])).at[-1].set(0.0)
        return jnp.einsum("mij,mj->mi", factors.stiffness, twist[last] - twist[first]) - load


def _chain_pattern(network):
    """Cycle pattern by chains (m, S): all bonds of a chain belong to the same loops."""
    r, Y = series_reduction(network), cycle_pattern(network)
    bonds = np.unique(r.chain, return_index=True)[1][: r.num_chains]
    return r.sign[bonds, None] * Y[bonds]


def chain_compliance(network: BodyNetwork, C):
    """Compliance (m, ...) of every chain: the sum of its bonds' (q, ...), (6, 6) each or a number."""
    r = series_reduction(network)
    if r.is_small:
        return constant_product(np.abs(r.chain_matrix), C)
    return jnp.zeros((r.num_chains + 1, *C.shape[1:]), C.dtype).at[r.chain].add(C)[:-1]


def chain_twists(network: BodyNetwork, d):
    """Sum (m, 6) of the bonds' twists (q, 6) along every chain."""
    r = series_reduction(network)
    if r.is_small:
        return constant_product(r.chain_matrix, d)
    signed = jnp.asarray(r.sign, d.dtype)[:, None] * d
    return jnp.zeros((r.num_chains + 1, 6), d.dtype).at[r.chain].add(signed)[:-1]


def chain_to_bond_wrenches(network: BodyNetwork, y):
    """Wrenches (q, 6) of the bonds from those of their chains (m, 6); transpose of the above."""
    r = series_reduction(network)
    if r.is_small:
        return constant_product(r.chain_matrix.T, y)
    padded = jnp.concatenate([y, jnp.zeros((1, 6), y.dtype)])
    return jnp.asarray(r.sign, y.dtype)[:, None] * padded[r.chain]


METHODS = {"force": ForceMethod, "nodal": NodalMethod}


def choose_method(network: BodyNetwork, method: str):
    """The method of that name; "auto" takes the force method for few loops.  Raises: ValueError for other names."""
    if method == "auto":
        method = "force" if network.num_loops <= tuning.NETWORK_LOOPS else "nodal"
    if method not in METHODS:
        raise ValueError(f"method must be 'auto', 'force' or 'nodal', got {method!r}")
    return METHODS[method]
