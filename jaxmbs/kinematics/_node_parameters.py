"""Parameters of the tree's nodes, packed into one array that recursions carry, with names for its columns."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ..math._spatial import rotations

_POSITION, _LEAD = slice(9, 12), 12
_MASS, _COM, _INERTIA = slice(13, 14), slice(14, 17), slice(17, 23)
_Z_AXIS = slice(2, 9, 3)  # third column of nine numbers of a rotation, row by row


class NodeParameters(NamedTuple):
    """Views of packed parameters P (nodes, 23[, batch]), in node axes.

    The placement of a node is its pose in the parent node at coordinate zero; mass, centre of mass and inertia are
    those of all bodies welded to the node.
    """

    packed: Array

    @staticmethod
    def pack(rotation: Array, position: Array, lead: Array, mass: Array, com: Array, inertia: Array) -> Array:
        """P (nodes, 23) of rotations (nodes, 3, 3), positions (nodes, 3), leads (nodes,), masses (nodes,), centres of
        mass (nodes, 3) and the upper triangles (nodes, 6) of inertias about these."""
        placement = rotation.reshape(len(rotation), 9)
        return jnp.concatenate([placement, position, lead[:, None], mass[:, None], com, inertia], axis=1)

    @property
    def rotation(self) -> Array:
        """Rotation (nodes, 3, 3, ...) of the placement."""
        return rotations(self.packed)

    @property
    def axis(self) -> Array:
        """Axis z (nodes, 3, ...) of the placement, in the parent node."""
        return z_axes(self.packed)

    @property
    def position(self) -> Array:
        """Position (nodes, 3, ...) of the placement [m]."""
        return positions(self.packed)

    @property
    def lead(self) -> Array:
        """Advance (nodes, ...) per unit of the coordinate: 1 for slides, m/rad for screws, 0 else."""
        return self.packed[:, _LEAD]

    @property
    def mass(self) -> Array:
        """Mass (nodes, 1, ...) [kg]."""
        return self.packed[:, _MASS]

    @property
    def com(self) -> Array:
        """Centre of mass (nodes, 3, ...) [m]."""
        return self.packed[:, _COM]

    @property
    def inertia(self) -> Array:
        """Inertia about the centre of mass (nodes, 6, ...): xx, xy, xz, yy, yz, zz [kg m^2]."""
        return self.packed[:, _INERTIA]


def z_axes(poses: Array) -> Array:
    """Axes z (nodes, 3, ...) of poses that begin with nine numbers of a rotation, row by row."""
    return poses[:, _Z_AXIS]


def positions(poses: Array) -> Array:
    """Positions (nodes, 3, ...) of poses: the three numbers after those of the rotation."""
    return poses[:, _POSITION]
