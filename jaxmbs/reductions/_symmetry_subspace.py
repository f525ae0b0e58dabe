"""Symmetry subspace: one family of motions of a structure made of equal parts, described by one part."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from ..linear._storage import as_inexact
from ..linear._system import LinearSystem
from ..typing import AnyArray
from ._base import Reduced


class SymmetrySubspace(Reduced):
    """A family of motions of a structure in which each part repeats the first one: of a mirror image or of a ring.

    It is a linear system whose coordinates, forces and reactions are those of the first part; a force on it by name
    acts on the other parts too, with the symmetry of the family.  Components joined to it must be of the same family.
    Families are uncoupled: all families together are the structure, `gather_forces` distributes any forces among
    them, and the motion is the sum of their `part_displacements`.

    Attributes:
        copies: (parts, n, r), displacements of all coordinates of every part, in its own axes, which are rotated or
            mirrored with it.
        axes: (parts, 3, 3), these axes in those of the first part, as in `rotate`.
        share: fraction of the energy of the structure that the matrices contain: one over the number of parts, or
            twice that for travelling patterns.
    """

    copies: Inexact[Array, "parts n r"]
    axes: Float[Array, "parts 3 3"]
    share: float = eqx.field(static=True)

    def __init__(
        self,
        whole: LinearSystem,
        copies: Array,
        axes: Array,
        share: float,
        num_interface: int | None = None,
        **options: Any,
    ) -> None:
        super().__init__(whole, copies[0], num_interface, **options)
        self.copies, self.axes, self.share = copies, axes, share

    def part_displacements(self, rho: AnyArray) -> Array:
        """Displacements (..., parts, n) of all parts, each in its own axes, from reduced ones (..., r).

        Source: S1 (5), section 5.
        """
        rho = as_inexact(rho)
        return jnp.einsum("pnr,...r->...pn", self.copies.astype(rho.dtype), rho)

    def gather_forces(self, forces: AnyArray) -> Array:
        """Generalised forces (..., r) of the family from forces (..., parts, n) on all parts, each in its own axes.

        Source: S1 (18), section 5.
        """
        forces = as_inexact(forces)
        return self.share * jnp.einsum("pnr,...pn->...r", self.copies.astype(forces.dtype), forces)

    def chain_to(self, whole: Reduced) -> "SymmetrySubspace":
        """The same system expanded to the component that `whole` was reduced from; copies of copies multiply."""
        outer, axes, share = whole.basis[None], jnp.eye(3, dtype=self.axes.dtype)[None], self.share
        if isinstance(whole, SymmetrySubspace):
            outer, axes, share = whole.copies, whole.axes, whole.share * share
        copies = jnp.einsum("anm,bmr->banr", outer, self.copies).reshape(-1, outer.shape[1], self.copies.shape[2])
        axes = jnp.einsum("bij,ajk->baik", self.axes, axes).reshape(-1, 3, 3)
        return self.replace(basis=copies[0], copies=copies, axes=axes, share=share, whole=whole.whole)
