"""The family of reactions in equilibrium with the loads: a particular solution plus self-stresses of the loops."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..model._describe import COMPONENTS
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..typing import ArrayLike
from ._bonds import Bonds, as_loads
from ._cycles import cycle_pattern
from ._network import BodyNetwork
from ._network_sums import tree_wrenches


class ReactionFamily(Reported, eqx.Module):
    """`w = particular + Y parameters`: every set of bond wrenches in equilibrium with the loads, 6 S of them.

    The bonds' free directions then fix parameters, and the compliance those that stay open; see `bond_reactions`.
    `particular` (q, 6): world wrenches about the world origin, zero in the bonds that close loops.
    Source: S1 (28).
    """

    network: BodyNetwork = eqx.field(static=True)
    particular: Float[Array, "q 6"]

    def report(self) -> Report:
        axes = (Axis("bond", self.network.bonds), Axis("component", COMPONENTS))
        return Report(
            [Quantity("particular", self.particular, "N or N m", axes)], f"{len(self.network.chords)} loops"
        )

    @property
    def homogeneous(self) -> np.ndarray:
        """Y (q, S): what a unit wrench round each loop adds to every bond."""
        return cycle_pattern(self.network)

    def wrench(self, parameters: Array) -> Array:
        """World wrenches (q, 6) on the bonds' children for the wrenches (S, 6) of the bonds that close the loops."""
        return self.particular + jnp.asarray(self.homogeneous, parameters.dtype) @ parameters


def reaction_family(bonds: Bonds, loads: ArrayLike) -> ReactionFamily:
    """The family of reactions for the loads (p, 6) that `bond_reactions` takes.  Source: S1 (28)."""
    return ReactionFamily(bonds.network, tree_wrenches(bonds.network, as_loads(bonds, loads)))
