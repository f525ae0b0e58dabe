"""Primal assembly: components joined at shared interface displacements, the reactions of bonds and their balance."""

from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..blocksparse import BlockMatrix
from ..elements._base import as_real
from ..linear._rigid_motions import rigid_rows
from ..linear._system import LinearSystem
from ..reductions._base import Reduced, interface_first
from ..runtime import jit
from ..typing import ArrayLike
from ._component_groups import ComponentGroup, assemble_groups, block_layout, component_groups
from ._group_reactions import gather_group_forces, group_coordinates, group_reactions, group_shares

#: Roundings of its terms by which a sum of forces may differ from zero.
ROUNDING_FACTOR = 16.0


class Assembly(LinearSystem):
    """Coupled components, `rho_c = beta_c xi`: displacements of the joints first, then each component's own
    coordinates.

    Attributes:
        components: reduced systems, interface first.
        places: index of each component's coordinates among the joined ones, -1 for the ground: the columns of beta.
        transformation: (all, N) of the joined coordinates by xi, where some follow from rigid bodies, else None.
        groups: the components by size, where the matrices are stored in blocks, else ().
    """

    components: tuple[Reduced, ...]
    places: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    transformation: Array | None
    groups: tuple[ComponentGroup, ...]

    def __init__(
        self,
        *,
        components: Iterable[Reduced],
        places: Iterable[tuple[int, ...]],
        transformation: Array | None = None,
        groups: Iterable[ComponentGroup] = (),
        **options: Any,
    ) -> None:
        super().__init__(**options)
        self.components, self.places, self.transformation = tuple(components), tuple(places), transformation
        self.groups = tuple(groups)

    @property
    def linear_solver(self) -> str:
        """ "dense", or "multifrontal" of matrices in blocks."""
        return "multifrontal" if isinstance(self.stiffness, BlockMatrix) else "dense"

    @property
    def num_joined(self) -> int:
        """Number of joined coordinates before those that follow from rigid bodies are eliminated."""
        return self.num_rows if self.transformation is None else len(self.transformation)

    def coupling_to_ground(self) -> Array | None:
        """Sum over the components of `ground_inertia`, and of the mass between what is tied to the ground and other
        coordinates; None where nothing is.  Components without positions have no part in it."""
        shares = [_ground_share(c, places) for c, places in zip(self.components, self.places, strict=True)]
        return None if all(share is None for share in shares) else self.gather_forces(shares)

    def component_coordinates(self, xi: ArrayLike) -> tuple[Array, ...]:
        """Coordinates `rho_c = beta_c xi` (r_c, ...) of every component.  Source: S1 (7), (11), (21)-(24)."""
        xi = jnp.asarray(xi)
        if self.groups:
            return group_coordinates(self.groups, xi)
        if self.transformation is not None:
            xi = _matmul(self.transformation, xi)
        padded = jnp.concatenate([xi, jnp.zeros_like(xi[:1])])
        return tuple(padded[np.array(p)] for p in self.places)

    def gather_forces(self, shares: Sequence) -> Array:
        """Joined forces `Q = sum beta_c^T Q_c` (N, ...) of generalised forces on components (r_c, ...) or None.

        Source: S1 (18), (21)-(25).
        """
        if self.groups:
            return gather_group_forces(self.groups, shares, self.num_rows)
        joined = _sum(self.places, shares, self.num_joined)
        return joined if self.transformation is None else _matmul(self.transformation.T, joined)


def _ground_share(component, places):
    """Forces (r_c, 6) on a component by motions of the ground beyond those of its free coordinates, or None."""
    tied, ground = np.flatnonzero(np.array(places) < 0), component.coupling_to_ground()
    if component.positions is None or not len(tied):
        return ground
    motions = rigid_rows(component, jnp.zeros(3, component.positions.dtype))
    found = component.mass[:, tied] @ motions[tied]
    return found if ground is None else found + ground


class InterfaceReactions(eqx.Module):
    """Forces of the bonds on every component, with the residual of their balance.

    Attributes:
        forces: by component (b_c, ...), along its interface coordinates.
        residual: largest sum of the forces at a joint, relative to the largest force: zero by S1 (25).
        rounding: bound of the residual by rounding: forces of a stiff component are small differences of large terms.
    """

    forces: tuple
    residual: Array
    rounding: Array


def join(components: Sequence[LinearSystem], joints: Sequence[Sequence[int]]) -> Assembly:
    """Assemble components on common joint displacements by number; `connect` does it by name.

    Args:
        joints: for each component, the number of the joint displacement of each of its interface coordinates; -1
            fixes it to the ground.  Directions that a joint leaves free have numbers of their own.

    Raises: ValueError for a wrong count, or numbers that are not 0, 1, 2, ...  Source: S1 (1)-(3), (9)-(12).
    """
    parts = tuple(map(interface_first, components))
    places, labels = joint_coordinates(parts, joints)
    return Assembly(**joined_system(parts, places, labels), components=parts, places=places)


def joined_system(parts: Sequence[Reduced], places, labels, linear_solver: str = "dense") -> dict:
    """Arguments of an `Assembly` of components on common coordinates.  Source: S1 (9)-(12)."""
    matrices = _joined_matrices(parts, places, len(labels), linear_solver)
    heavy = {p for place, c in zip(places, parts, strict=True) for k, p in enumerate(place) if k not in c.massless}
    return matrices | {"coordinates": labels, "massless": [i for i in range(len(labels)) if i not in heavy]}


def _joined_matrices(parts, places, size, linear_solver):
    """Matrices of joined components, dense or in blocks, and in blocks the groups of the components."""
    if linear_solver == "multifrontal":
        groups = component_groups(parts, places, size)
        pattern, rows = block_layout(groups, size)
        return {**assemble_groups(groups, pattern, rows), "block_rows": rows, "groups": groups}
    kinds = ("mass", "stiffness", "damping")
    return {kind: _assemble(places, [getattr(c, kind) for c in parts], size) for kind in kinds}


def elastic_bond(stiffness, damping=None, mass=None) -> LinearSystem:
    """Component of a bushing between two frames; its interface are the coordinates of the one, then of the other.

    Args: stiffness, damping, mass: (k, k), or the k numbers of a diagonal; damping and mass may be None.  The mass is
        distributed as that of a uniform rod, a third at each end and a third between them.

    Raises: ValueError for matrices of different sizes.
    """
    stiffness = _as_square_matrix(stiffness)
    damping, mass = (None if A is None else _as_square_matrix(A) for A in (damping, mass))
    shapes = {A.shape for A in (stiffness, damping, mass) if A is not None}
    if len(shapes) > 1:
        raise ValueError(f"stiffness, damping and mass of a bushing must be of one shape, not {sorted(shapes)}")
    two = jnp.array([[1, -1], [-1, 1]], stiffness.dtype)
    K, C = jnp.kron(two, stiffness), None if damping is None else jnp.kron(two, damping)
    M = jnp.zeros_like(K) if mass is None else jnp.kron(jnp.array([[2, 1], [1, 2]], stiffness.dtype) / 6, mass)
    b = range(len(K))
    return LinearSystem(mass=M, stiffness=K, damping=C, interface=b, massless=b if mass is None else ())


def interface_reactions(
    assembly: Assembly, xi, xi_ddot, xi_dot=None, shares: Sequence | None = None
) -> InterfaceReactions:
    """Forces of the bonds on each component in a motion: `phi^T R = M rho'' + C rho' + K rho - Q`.

    Args:
        xi, xi_ddot, xi_dot: (N, ...), at any number of times, or complex amplitudes.
        shares: generalised forces on the components (r_c, ...), None for none.

    With fixed-interface modes these forces are those of mode acceleration.  Source: S1 (3), (17)-(25).
    """
    if assembly.groups:
        return _split_reactions(assembly, *joint_reactions(assembly, (xi, xi_dot, xi_ddot), shares))
    motions = [
        assembly.component_coordinates(x) if x is not None else (None,) * len(assembly.components)
        for x in (xi, xi_dot, xi_ddot)
    ]
    found, sizes = [], []
    for c, rho, rho_dot, rho_ddot, given in zip(
        assembly.components, *motions, shares or (None,) * len(assembly.components), strict=True
    ):
        terms = [(c.stiffness, rho), (c.mass, rho_ddot), (c.damping, rho_dot)]
        terms = [(A[: c.num_interface], x) for A, x in terms if A is not None and x is not None]
        load = 0.0 if given is None else given[: c.num_interface].astype(rho.dtype)
        found.append(sum(_matmul(A, x) for A, x in terms) - load)
        sizes.append(sum(_matmul(jnp.abs(A), jnp.abs(x)) for A, x in terms) + jnp.abs(load))
    return balance_reactions(assembly, found, sizes)


def joint_reactions(assembly: Assembly, motions, shares: Sequence | None = None) -> tuple[Array, Array, Array]:
    """Forces (b, ...) of the bonds on all interfaces of an assembly in blocks, their residual and its rounding.

    Args: motions: displacement, velocity, acceleration (N, ...), None for zero; shares as in `interface_reactions`.
    """
    own = group_shares(assembly.groups, shares or (None,) * len(assembly.components))
    forces, gap, rounding = group_reactions(assembly.groups, assembly.num_rows, tuple(motions), own)
    largest = jnp.max(jnp.abs(forces), initial=0.0)
    largest, eps = jnp.where(largest > 0, largest, 1.0), jnp.finfo(largest.dtype).eps
    return forces, gap / largest, ROUNDING_FACTOR * eps * rounding / largest


def _split_reactions(assembly, forces, residual, rounding):
    ends = np.cumsum([c.num_interface for c in assembly.components])[:-1]
    return InterfaceReactions(tuple(jnp.split(forces, ends)), residual, rounding)


def balance_reactions(assembly: Assembly, forces: Sequence, sizes: Sequence | None = None) -> InterfaceReactions:
    """Balance of the forces (b_c, ...) on each component at the joints.

    Args: sizes: magnitudes of the terms of these forces, likewise; default the forces themselves.

    Source: S1 (2), (25).
    """
    sizes = [jnp.abs(f) for f in forces] if sizes is None else sizes
    largest = jnp.max(jnp.stack([jnp.max(jnp.abs(f), initial=0.0) for f in forces]))
    largest, eps = jnp.where(largest > 0, largest, 1.0), jnp.finfo(largest.dtype).eps
    T = assembly.transformation
    pairs = ((forces, T), (sizes, None if T is None else jnp.abs(T)))
    gaps = (jnp.max(jnp.abs(_sum_at_joints(assembly, *pair)), initial=0.0) for pair in pairs)
    residual, rounding = (gap / largest for gap in gaps)
    return InterfaceReactions(tuple(forces), residual, ROUNDING_FACTOR * eps * rounding)


def _sum_at_joints(assembly, parts, T):
    """Sums (N, ...) over the components of quantities at their interfaces (b_c, ...); T: the transformation."""
    padded = [
        jnp.zeros_like(f, shape=(len(p), *f.shape[1:])).at[: len(f)].set(f)
        for f, p in zip(parts, assembly.places, strict=True)
    ]
    joined = _sum(assembly.places, padded, assembly.num_joined)
    return joined if T is None else _matmul(T.T, joined)


def joint_coordinates(components: Sequence[Reduced], joints: Sequence[Sequence[int]]):
    """Indices of every component's coordinates among the joined ones, and labels.  Raises: ValueError as `join`."""
    if len(joints) != len(components):
        raise ValueError(f"{len(components)} components, but joints of {len(joints)}")
    for k, (c, row) in enumerate(zip(components, joints, strict=True)):
        if len(row) != c.num_interface:
            raise ValueError(f"component {k} has {c.num_interface} interface coordinates, its joints are {len(row)}")
    used = sorted({int(j) for row in joints for j in row if j >= 0})
    if used != list(range(len(used))):
        raise ValueError(f"joint displacements must be numbered 0, 1, 2, ..., not {used}")
    places, labels = [], [f"joint {j}" for j in used]
    for k, (c, row) in enumerate(zip(components, joints, strict=True)):
        own = range(len(row), c.num_rows)
        places.append((*(max(int(j), -1) for j in row), *range(len(labels), len(labels) + len(own))))
        labels += [f"component {k} {c.label(i)}" for i in own]
    return tuple(places), tuple(labels)


@jit
def _assemble(places, blocks, size):
    if all(b is None for b in blocks):
        return None
    total = jnp.zeros((size + 1, size + 1), next(b for b in blocks if b is not None).dtype)
    for place, block in zip(places, blocks, strict=True):
        if block is not None:
            total = total.at[np.ix_(place, place)].add(block)
    return total[:-1, :-1]


@jit
def _sum(places, parts, size):
    given = [(p, f) for p, f in zip(places, parts, strict=True) if f is not None]
    total = jnp.zeros((size + 1, *given[0][1].shape[1:]), np.result_type(*(f.dtype for _, f in given)))
    for place, f in given:
        total = total.at[np.array(place)].add(f.astype(total.dtype))
    return total[:-1]


def _as_square_matrix(value):
    value = as_real(value)
    return jnp.diag(value) if value.ndim == 1 else value


def _matmul(A, x):
    return A.astype(x.dtype) @ x
