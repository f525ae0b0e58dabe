"""Mirror symmetry: symmetric structures, modelled by one half."""

from collections.abc import Iterable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..checks import distinct_names, is_concrete
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..typing import CoordinateLike
from ._base import AbstractReduction
from ._placement import POSITION_TOLERANCE
from ._symmetry_subspace import SymmetrySubspace


def _as_tuple(nodes: Iterable[CoordinateLike] | None) -> tuple | None:
    return None if nodes is None else distinct_names("nodes", nodes)


class Mirror(AbstractReduction):
    """Symmetric or antisymmetric motions of a structure with a plane of symmetry, from one half.

    `reduce(half, Mirror("x"))` and `reduce(half, Mirror("x", antisymmetric=True))` together are the structure.
    On the plane a symmetric motion has no displacement along the normal and no rotation about lines in the plane; an
    antisymmetric one has only these.  Elements in the plane belong to the half with half of their stiffness and mass.
    For two planes: `reduce(reduce(quarter, Mirror("x", left)), Mirror("y", front))`.

    Coordinates: those of the half [m, rad], interface first, that the plane leaves free, with their signs.

    Attributes:
        normal: normal of the plane, "x", "y" or "z".
        nodes: names or numbers of the nodes on the plane; default the interface, `()` for a component that does not
            reach the plane.
        antisymmetric: True for the antisymmetric motions.

    Returns (of `reduce`): a `SymmetrySubspace` of two parts, the half and its image.

    Raises: ModelError for another normal, coordinates on the plane without a direction, nodes that are not in one
    plane across the normal.  Source: S1 (5)-(8), section 5.
    """

    keeps_all = True

    normal: str = eqx.field(static=True)
    nodes: tuple | None = eqx.field(static=True, default=None, converter=_as_tuple)
    antisymmetric: bool = eqx.field(static=True, default=False)

    def of(self, system: LinearSystem) -> SymmetrySubspace:
        system = system.to_dense()
        if self.normal not in DIRECTIONS[:3]:
            raise ModelError([f"unknown normal {self.normal!r}: give one of {', '.join(DIRECTIONS[:3])}"])
        plane = system.interface if self.nodes is None else system.rows(*self.nodes)
        _check_plane(system, plane, self.normal, self.nodes is None and not plane)
        image, family = image_signs(system, self.normal), -1.0 if self.antisymmetric else 1.0
        gone = {i for i in plane if image[i] != family}
        interface = [i for i in system.interface if i not in gone]
        kept = np.array(interface + [i for i in system.interior if i not in gone], int)
        matrices = {name: getattr(system, name) for name in ("mass", "stiffness", "damping")}
        basis = jnp.eye(system.num_rows, dtype=system.dtype)[:, kept]
        across = np.eye(3) - 2 * np.diag([float(d == self.normal) for d in DIRECTIONS[:3]])
        return SymmetrySubspace(
            system,
            jnp.stack([basis, family * basis]),
            jnp.asarray(np.stack([np.eye(3), across]), system.dtype),
            0.5,
            len(interface),
            **{name: None if A is None else A[kept][:, kept] for name, A in matrices.items()},
            coordinates=[system.coordinates[i] for i in kept],
            massless=[k for k, i in enumerate(kept) if i in system.massless],
        )


def image_signs(system: LinearSystem, normal: str) -> np.ndarray:
    """Signs (n,) of the mirror image: -1 for displacements along the normal and rotations about other axes."""
    flipped = {normal, *(f"r{d}" for d in DIRECTIONS[:3] if d != normal)}
    return np.array([-1.0 if direction in flipped else 1.0 for _, direction in system.coordinates])


def _check_plane(system, plane, normal, unsaid):
    bare = [system.label(i) for i in plane if not system.coordinates[i][1]]
    faults = [f"coordinates on the plane need directions such as 'node z': {', '.join(bare[:5])}"] if bare else []
    faults += (
        ["no node is on the plane: give nodes, make them the interface, or nodes=() if there is none"]
        if unsaid
        else []
    )
    if plane and not faults and system.positions is not None and is_concrete(system.positions):
        nodes = list(dict.fromkeys(system.coordinates[i][0] for i in plane if system.coordinates[i][1]))
        places = np.asarray(system.positions)[[system.nodes.index(node) for node in nodes]]
        size = max(float(np.ptp(np.asarray(system.positions))), 1e-300)
        apart = np.abs(places[:, DIRECTIONS.index(normal)] - np.median(places[:, DIRECTIONS.index(normal)]))
        off = [node for node, gap in zip(nodes, apart, strict=True) if gap > POSITION_TOLERANCE * size]
        faults += (
            [f"nodes {', '.join(off[:5])} do not lie in one plane normal to {normal} with the others"] if off else []
        )
    if faults:
        raise ModelError(faults)
