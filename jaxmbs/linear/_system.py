"""`LinearSystem`: mass, damping and stiffness matrices over named coordinates, some of them an interface."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import require_numbers
from ..errors import ModelError, UnknownNameError
from ..runtime import as_array, as_dtype
from ..tables import table_repr
from ..typing import ArrayLike, CoordinateLike
from ._block_rows import BlockRows
from ._labels import coordinate_labels, find_rows, format_label, node_positions
from ._rigid_motions import rigid_motions
from ._storage import Matrix, MatrixLike, dtype_of, num_rows, to_dense, unify_storage

SystemT = TypeVar("SystemT", bound="LinearSystem")


def _table_rows(system):
    """Summary line and table of a linear system: the coordinates of every node."""
    by_node: dict[str, list[str]] = {}
    for node, direction in system.coordinates:
        by_node.setdefault(node, []).append(direction)
    storage = type(system.stiffness).__name__ if not isinstance(system.stiffness, Array | np.ndarray) else "dense"
    damped = "no damping" if system.damping is None else "damped"
    summary = f"{system.num_rows} coordinates, {system.num_interface} of them interface, {storage} matrices, {damped}"
    outer = {system.coordinates[k][0] for k in system.interface}
    rows = [(node, " ".join(own), "interface" if node in outer else "") for node, own in by_node.items()]
    return summary, [("node", "directions", ""), *rows]


class LinearSystem(eqx.Module):
    """Linear system `M x'' + C x' + K x = F + R` of one component, or of many joined.  Source: S1 (3).

    Args:
        mass, stiffness: (n, n) arrays, block matrices on one pattern, or SciPy sparse matrices (those of scikit-fem
            as they are; with an array among them all become arrays).  Algorithms are chosen by that type.
        damping: likewise, or None.
        interface: coordinates by which the component is joined to others: row numbers, labels, or names of nodes
            (all their rows).
        coordinates: label of each row: `(node, direction)`, direction one of x y z rx ry rz or "" (a mode), or plain
            strings; default "0", "1", ...
        positions: (3,) [m] by name of node, or the names and an array (nodes, 3); needed for rigid motions.
        massless: rows known to have no mass, also under tracing: `modes` condenses them, which is exact.
        block_rows: of block matrices, the rows at the places of their blocks; default `size * block + place`, the
            padding of smaller blocks included.
        ground_inertia: (n, 6), or None where nothing was held: forces on the coordinates [N, N m] in unit rigid
            accelerations of the ground, rotations about the origin, beyond those of the same motion of the
            coordinates themselves: `M_fb R_b` of held coordinates b, in all matrices that have lost them.

    Raises: ModelError with every fault: shapes, repeated or missing labels, an unknown interface.
    """

    mass: Matrix
    stiffness: Matrix
    damping: Matrix | None
    positions: Float[Array, "nodes 3"] | None
    nodes: tuple[str, ...] = eqx.field(static=True)
    interface: tuple[int, ...] = eqx.field(static=True)
    coordinates: tuple[tuple[str, str], ...] = eqx.field(static=True)
    massless: tuple[int, ...] = eqx.field(static=True)
    block_rows: BlockRows | None = eqx.field(static=True)
    ground_inertia: Float[Array, "n 6"] | None

    __repr__, _repr_html_ = table_repr(_table_rows)

    def __init__(
        self,
        *,
        mass: MatrixLike,
        stiffness: MatrixLike,
        damping: MatrixLike | None = None,
        interface: Iterable[CoordinateLike] = (),
        coordinates: Iterable | None = None,
        positions: Mapping | Sequence | None = None,
        massless: Iterable[int] = (),
        block_rows: BlockRows | None = None,
        ground_inertia: ArrayLike | None = None,
    ) -> None:
        faults = []
        self.mass, self.stiffness, self.damping = unify_storage(
            faults, mass=mass, stiffness=stiffness, damping=damping
        )
        if faults:
            raise ModelError(faults)
        self.block_rows = block_rows
        n = num_rows(self.stiffness) if block_rows is None else len(block_rows)
        faults += _size_faults(num_rows(self.stiffness), mass=self.mass, damping=self.damping)
        self.coordinates = coordinate_labels(coordinates, n, faults)
        self.interface = _interface_rows(interface, self.coordinates, faults)
        self.nodes, self.positions = node_positions(positions, self.coordinates, faults)
        self.massless = tuple(massless)
        faults += [f"massless: there is no row {row!r}" for row in self.massless if row not in range(n)]
        self.ground_inertia = None if ground_inertia is None else jnp.asarray(ground_inertia)
        if self.ground_inertia is not None and self.ground_inertia.shape != (n, 6):
            faults.append(f"ground_inertia has shape {self.ground_inertia.shape}, not ({n}, 6)")
        if faults:
            raise ModelError(faults)

    @property
    def num_rows(self) -> int:
        return len(self.coordinates)

    @property
    def num_interface(self) -> int:
        return len(self.interface)

    @property
    def interior(self) -> tuple[int, ...]:
        """Rows outside the interface."""
        at = set(self.interface)
        return tuple(i for i in range(self.num_rows) if i not in at)

    def rows(self, *names: CoordinateLike) -> tuple[int, ...]:
        """Row numbers of labels `(node, direction)`, or of all coordinates of nodes.  Raises: UnknownNameError."""
        faults = []
        found = find_rows(names, self.coordinates, faults)
        if faults:
            raise UnknownNameError("; ".join(faults))
        return found

    def label(self, row: int | np.integer) -> str:
        """Name of the coordinate of a row: "tip rz"."""
        return format_label(self.coordinates[row])

    def outputs(self, *names: CoordinateLike) -> tuple[Array, tuple[str, ...]]:
        """Output matrix (k, n) of the displacements at the given names, and the k labels.

        Args: names: as in `rows`.

        Its transpose applies forces there.  Raises: UnknownNameError.
        """
        rows = self.rows(*names)
        unit = np.zeros((len(rows), self.num_rows))
        unit[np.arange(len(rows)), np.array(rows, int)] = 1.0
        return as_array(unit, self.dtype), tuple(map(self.label, rows))

    @property
    def dtype(self) -> np.dtype:
        """Data type of the matrices."""
        return dtype_of(self.stiffness)

    def load(self, forces: Mapping | ArrayLike) -> Array:
        """Load vectors (..., n) of forces [N, N m] given by name.

        Args: forces: by name as in `outputs`: (...) for one coordinate, (..., k) for a node with k coordinates;
            times, frequencies or load cases first.  Or already an array (..., n).  Complex forces are amplitudes.

        Raises: UnknownNameError; ValueError for another shape; TypeError for other things than numbers.
        """
        require_numbers(forces=forces)
        if not isinstance(forces, Mapping):
            forces = jnp.asarray(forces)
            if forces.shape[-1:] != (self.num_rows,):
                raise ValueError(f"forces have shape {forces.shape}, not (..., {self.num_rows})")
            return forces
        given = {name: jnp.asarray(force) for name, force in forces.items()}
        dtype = np.result_type(self.dtype, np.complex64) if any(map(jnp.iscomplexobj, given.values())) else self.dtype
        parts = []
        for name, force in given.items():
            rows, labels = self.outputs(name)
            force = force.astype(dtype)
            force = force[..., None] if len(labels) == 1 else force
            if force.shape[-1:] != (len(labels),):
                raise ValueError(f"forces on {name!r} have shape {force.shape}, not (..., {len(labels)})")
            parts.append(force @ rows.astype(dtype))
        shape = np.broadcast_shapes((self.num_rows,), *(part.shape for part in parts))
        return sum((jnp.broadcast_to(part, shape) for part in parts), jnp.zeros(shape, dtype))

    def coupling_to_ground(self) -> Array | None:
        """`ground_inertia` (n, 6), or None."""
        return self.ground_inertia

    def with_interface(self: SystemT, *names: CoordinateLike) -> SystemT:
        """The same system with another interface.  Raises: ModelError."""
        faults = []
        rows = _interface_rows(names, self.coordinates, faults)
        if faults:
            raise ModelError(faults)
        return self.replace(interface=rows)

    def translate(self: SystemT, by: ArrayLike) -> SystemT:
        """The same system with all nodes shifted by (3,) [m].  Raises: ModelError without positions."""
        if self.positions is None:
            raise ModelError(["`translate` needs the positions of the nodes: LinearSystem(..., positions=...)"])
        by, ground = as_dtype(by, self.positions.dtype)[None], self.ground_inertia
        ground = None if ground is None else ground @ rigid_motions(by)[0]
        return self.replace(positions=self.positions + by, ground_inertia=ground)

    def with_damping(self: SystemT, damping: MatrixLike | None) -> SystemT:
        """The same system with another damping matrix (n, n), such as `rayleigh_damping` or `modal_damping`.

        Raises: ModelError for one of another size, or blocks beside arrays.
        """
        faults: list[str] = []
        mass, stiffness, damping = unify_storage(faults, mass=self.mass, stiffness=self.stiffness, damping=damping)
        faults = faults or _size_faults(num_rows(stiffness), damping=damping)
        if faults:
            raise ModelError(faults)
        return self.replace(mass=mass, stiffness=stiffness, damping=damping)

    def to_dense(self: SystemT) -> SystemT:
        """The same system with dense matrices.  Raises: ModelError for one that is too large."""
        names = ("mass", "stiffness", "damping")
        matrices = {name: to_dense(getattr(self, name), self.block_rows) for name in names}
        return self.replace(**matrices, block_rows=None)

    def replace(self: SystemT, **fields: Any) -> SystemT:
        """The same system with some fields replaced, which are not validated."""
        new = object.__new__(type(self))
        for field in dataclasses.fields(self):
            object.__setattr__(new, field.name, fields.get(field.name, getattr(self, field.name)))
        return new


def _size_faults(n, **matrices):
    """Faults of matrices whose size differs from that of the stiffness."""
    rows = {name: num_rows(A) for name, A in matrices.items() if A is not None}
    wrong = [f"{name} has {k} rows, not {n}" for name, k in rows.items() if k != n]
    return [f"mass, stiffness and damping differ in size: {fault}" for fault in wrong]


def _interface_rows(interface, labels, faults):
    own = []
    rows = find_rows(interface, labels, own)
    faults += [f"interface: {fault}" for fault in own]
    return rows
