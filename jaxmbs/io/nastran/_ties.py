"""Ties among directions of nodes: each says that rows of coefficients times the displacements are zero.

Displacements and rotations of a node are those in its own displacement frame, whose axes are rows (3, 3).
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements._base import as_real
from ...elements._shared_matrices import rigid_arm
from ...typing import AnyArray, Convertible

Pair = tuple[int, int]  # place of a node, direction 0 to 5
Axes = Callable[[tuple[int, ...]], Array]  # (nodes, 3, 3) of many nodes


class AbstractTie(eqx.Module):
    """A few equations; `dependent` are the directions that they give, one each."""

    dependent: tuple[Pair, ...] = eqx.field(static=True)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Directions (node, component) of the columns of the equations."""
        raise NotImplementedError

    @property
    def implied_directions(self) -> tuple[Pair, ...]:
        """The `pairs` that can move even if no element gives the node such a coordinate."""
        return self.pairs

    @property
    def is_explicit(self) -> bool:
        """True if equation k has 1 at `dependent[k]` and 0 at the other dependent ones: none must be solved."""
        return True

    def equations(self, positions: AnyArray, axes: Axes) -> Float[Array, "equations columns"]:
        """Coefficients that make zero."""
        raise NotImplementedError


class RigidTie(AbstractTie):
    """RBE2: `dependent` follow the node `master` as one rigid body."""

    master: int = eqx.field(static=True)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The dependent directions, then those of the master."""
        return (*self.dependent, *((self.master, d) for d in range(6)))

    def equations(self, positions: AnyArray, axes: Axes) -> Float[Array, "equations columns"]:
        """`u_i - [E, -arm~; 0, E] u_master`."""
        rows = _rigid_motion_rows(self.dependent, self.master, positions, axes)
        rows = rows @ _six_axes(axes((self.master,)))[0].T
        return jnp.concatenate([jnp.eye(len(rows), dtype=rows.dtype), -rows], axis=1)


class MeanTie(AbstractTie):
    """RBE3: the node `reference` moves as the weighted mean of others, `S^T W S u_ref = S^T W u`.

    Weights of rotations are multiplied by the square of the mean distance from the reference.

    Attributes:
        directions: of the reference that are tied; averaged: (node, direction) of all terms; weights: (terms,).
    """

    reference: int = eqx.field(static=True)
    directions: tuple[int, ...] = eqx.field(static=True)
    averaged: tuple[Pair, ...] = eqx.field(static=True)
    weights: Convertible[Float[Array, " terms"]] = eqx.field(converter=as_real)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The directions of the reference, then those that are averaged."""
        return (*((self.reference, d) for d in self.directions), *self.averaged)

    @property
    def implied_directions(self) -> tuple[Pair, ...]:
        """The directions of the reference: what is averaged must have its coordinates from elements."""
        return self.pairs[: len(self.directions)]

    @property
    def is_explicit(self) -> bool:
        """False with directions that UM names instead of those of the reference."""
        return self.dependent == self.pairs[: len(self.directions)]

    def equations(self, positions: AnyArray, axes: Axes) -> Float[Array, "equations columns"]:
        """`u_ref - (S^T W S)^-1 S^T W u`, the rows of its directions."""
        S = _rigid_motion_rows(self.averaged, self.reference, positions, axes)
        W = self._weighed(positions).astype(S.dtype)
        mean = _six_axes(axes((self.reference,)))[0] @ jnp.linalg.solve((S.T * W[None]) @ S, S.T * W[None])
        tied = jnp.eye(len(self.directions), dtype=S.dtype)
        return jnp.concatenate([tied, -mean[np.array(self.directions)]], axis=1)

    def _weighed(self, positions):
        turns = np.array([d > 2 for _, d in self.averaged])
        if not np.any(turns):
            return self.weights
        nodes = np.array(tuple(dict.fromkeys(node for node, _ in self.averaged)))
        length = jnp.mean(jnp.linalg.norm(positions[nodes] - positions[self.reference][None], axis=1))
        return jnp.where(turns, self.weights * length**2, self.weights)

    def holds(self, positions: np.ndarray, axes: Callable[[int], np.ndarray]) -> bool:
        """True if the averaged directions determine the reference's motion in all six directions; looks at values."""
        rows = []
        for node, d in self.averaged:
            along = axes(node)[d % 3]
            arm = positions[node] - positions[self.reference]
            rows.append(np.concatenate([along, np.cross(arm, along)] if d < 3 else [np.zeros(3), along]))
        S = np.array(rows)
        scale = np.linalg.norm(S, axis=0)
        if len(S) < 6 or np.any(scale == 0):
            return False
        return bool(np.linalg.svd(S / scale, compute_uv=False)[-1] > 1e-9)


class MultipointTie(AbstractTie):
    """MPC: `terms[0]` is given by the others.

    Attributes:
        terms: (node, direction); factors: (terms,), the first one 1.
    """

    terms: tuple[Pair, ...] = eqx.field(static=True)
    factors: Convertible[Float[Array, " terms"]] = eqx.field(converter=as_real)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The terms."""
        return self.terms

    def equations(self, positions: AnyArray, axes: Axes) -> Float[Array, "equations columns"]:
        """The card's coefficients over the first one."""
        return self.factors.astype(positions.dtype)[None]


def _rigid_motion_rows(pairs, master, positions, axes):
    """(pairs, 6): motions of directions of nodes, in their own axes, by rigid ones of a node, in basic axes."""
    nodes = tuple(dict.fromkeys(node for node, _ in pairs))
    arms = positions[np.array(nodes)] - positions[master][None]
    full = _six_axes(axes(nodes)) @ jax.vmap(rigid_arm)(arms)
    place = {node: k for k, node in enumerate(nodes)}
    return full[np.array([place[node] for node, _ in pairs]), np.array([d for _, d in pairs])]


def _six_axes(axes):
    """(nodes, 6, 6) for displacements and rotations."""
    zero = jnp.zeros_like(axes)
    return jnp.concatenate([jnp.concatenate([axes, zero], axis=2), jnp.concatenate([zero, axes], axis=2)], axis=1)
