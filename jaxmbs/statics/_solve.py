"""Reactions of all bonds of a network of rigid bodies."""

from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import place_of
from ..model._describe import COMPONENTS
from ..quantities import XYZ, Quantity
from ..reports import Report, Reported
from ..typing import ArrayLike
from ._bonds import Bonds, as_loads, shift_wrench
from ._least_compliance import least_compliance
from ._network import BodyNetwork
from ._network_sums import body_wrenches, tree_wrenches


class BondReaction(Reported, eqx.Module):
    """Wrench that the parent applies on the child through one bond, in the bond's axes about its origin.

    Attributes:
        force (..., 3) [N], moment (..., 3) [N m].
        undetermined: (force x y z, moment x y z) that statics alone leaves open; None where not computed.
    """

    force: Float[Array, "... 3"]
    moment: Float[Array, "... 3"]
    undetermined: tuple[bool, ...] | None = eqx.field(static=True)

    def report(self) -> Report:
        wrench = [Quantity("force", self.force, "N", (XYZ,)), Quantity("moment", self.moment, "N m", (XYZ,))]
        marks = self.undetermined or (False,) * len(COMPONENTS)
        open_ones = [name for name, mark in zip(COMPONENTS, marks, strict=True) if mark]
        return Report(wrench, f"undetermined: {', '.join(open_ones)}" if open_ones else "")

    def _unique(self, part):
        if self.undetermined is None:
            raise ValueError(
                "it is not known which components are unique: use bonds = statics.with_redundancy(bonds) in "
                "bond_reactions"
            )
        return ~np.array(self.undetermined[part])

    @property
    def unique_force(self) -> np.ndarray:
        return self._unique(slice(0, 3))

    @property
    def unique_moment(self) -> np.ndarray:
        return self._unique(slice(3, 6))


class BondReactions(Reported, eqx.Module):
    """Reactions by bond name, `loads["hinge"].force`.

    Attributes:
        wrench (..., q, 6): (force, moment) on the children in world axes about the world origin.
        components (..., q, 6): force, moment in the bonds' axes about their origins.
        parameters (..., S, 6): world wrenches of the bonds that close the loops, the parameters of S1 (28).
        residual: largest unbalanced load of a body; free_residual: largest gap between the reactions along the free
            twists and their efforts.  A movable network whose loads do not balance along its motions shows here.
        scale: largest reaction.  All three in N, moments divided by the characteristic length.
    """

    network: BodyNetwork = eqx.field(static=True)
    undetermined: tuple[tuple[bool, ...], ...] | None = eqx.field(static=True)
    wrench: Float[Array, "... q 6"]
    components: Float[Array, "... q 6"]
    residual: Float[Array, "..."]
    free_residual: Float[Array, "..."]
    scale: Float[Array, "..."]

    def report(self) -> Report:
        found = []
        for name, load in self.items():
            found += [
                Quantity(f"force of {name}", load.force, "N", (XYZ,)),
                Quantity(f"moment of {name}", load.moment, "N m", (XYZ,)),
            ]
        errors = {"relative residual": self.relative_residual, "relative free residual": self.relative_free_residual}
        return Report([*found, *(Quantity(*pair) for pair in errors.items())])

    @property
    def parameters(self) -> Float[Array, "... S 6"]:
        return self.wrench[..., self.network.chords, :]

    @property
    def relative_residual(self) -> Float[Array, "..."]:
        return self.residual / jnp.where(self.scale > 0.0, self.scale, 1.0)

    @property
    def relative_free_residual(self) -> Float[Array, "..."]:
        return self.free_residual / jnp.where(self.scale > 0.0, self.scale, 1.0)

    def __getitem__(self, name: str) -> BondReaction:
        e = place_of("bond", name, self.network.bonds)
        marks = None if self.undetermined is None else self.undetermined[e]
        return BondReaction(self.components[..., e, :3], self.components[..., e, 3:], marks)

    def __iter__(self):
        return iter(self.network.bonds)

    def items(self) -> Iterator[tuple[str, BondReaction]]:
        """Pairs of name and reaction."""
        return ((name, self[name]) for name in self)


def _largest(x):
    return jnp.max(jnp.abs(x), initial=0.0)


def bond_reactions(bonds: Bonds, loads: ArrayLike, method: str = "auto") -> BondReactions:
    """Reactions of all bonds for the loads that they must supply.

    Args:
        loads (p, 6): for every body (force, moment) of momentum rate less applied wrench, world axes, about the world
            origin: the right-hand side qz of `I_E w = qz`; at rest minus the applied wrench.
        method: for the loops, "force" (dense in 6 S parameters), "nodal" (block-sparse) or "auto" (by their number).

    Trees take sums over subtrees.  In loops, what the free directions leave open takes the least
    `1/2 sum w.C w`: distribution by the compliance of the bonds.  A part that floats is held at its first body, whose
    load must balance the others; see `residual`.

    Raises: ValueError for another method, or loads of another shape.  Source: S1 (26)-(29).
    """
    loads, network = as_loads(bonds, loads), bonds.network
    middle = lax.stop_gradient(jnp.mean(bonds.position, axis=0, keepdims=True))  # the origin with the shortest arms
    near = eqx.tree_at(lambda b: b.position, bonds, bonds.position - middle)
    near_loads = shift_wrench(loads, middle)
    if network.num_loops == 0:
        wrench = tree_wrenches(network, near_loads)
    else:
        wrench = least_compliance(
            near, jnp.zeros((len(near.effort), 6), loads.dtype), near.effort, near_loads, method
        )
    components = near.components(wrench)
    along = jnp.einsum("qic,qi->qc", near.free, components) - near.effort
    size = near.free_sizes()
    along = jnp.where(size > 0.0, along / jnp.sqrt(jnp.where(size > 0.0, size, 1.0)), 0.0)
    unit = jnp.concatenate([jnp.ones(3, loads.dtype), jnp.full(3, 1.0 / bonds.length)])[None]
    residual = _largest((near_loads - body_wrenches(network, wrench)) * unit)
    scale = _largest(components * unit)
    wrench = shift_wrench(wrench, -middle)
    return BondReactions(network, bonds.undetermined, wrench, components, residual, _largest(along), scale)
