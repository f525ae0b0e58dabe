"""A substructure: mass, stiffness, damping and interface of one component, from elements or from elsewhere."""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..elements import DIRECTIONS
from ..errors import ModelError
from .assembly import assemble_dense
from .structure import Structure

#: Above this many coordinates a dense matrix is refused; reduce first, or keep blocks.
LARGEST = 20000


class Substructure(eqx.Module):
    """Matrices of one component, `M x'' + C x' + K x = F + R`.  Source: S1 (3).

    Args:
        mass, stiffness: (n, n) arrays or SciPy sparse matrices (those of scikit-fem as they are).
        damping: likewise, or None.
        interface: what is joined to other components: numbers of rows, or labels, or names of nodes (all their rows).
        coordinates: label of each row: `(node, direction)`, direction one of x y z rx ry rz or "" (a mode), or plain
            strings; default "0", "1", ...
        positions: (3,) by node [m], for the checks of rigid motions; None where unknown.

    Raises: ModelError with every fault: shapes, repeated or missing labels, an interface that is not there.
    """

    mass: Inexact[Array, "n n"]
    stiffness: Inexact[Array, "n n"]
    damping: Inexact[Array, "n n"] | None
    positions: dict[str, Array] | None
    interface: tuple[int, ...] = eqx.field(static=True)
    coordinates: tuple[tuple[str, str], ...] = eqx.field(static=True)

    def __init__(self, mass, stiffness, damping=None, interface: Sequence = (), coordinates=None, positions=None):
        faults = []
        self.mass, self.stiffness = _matrix("mass", mass, faults), _matrix("stiffness", stiffness, faults)
        self.damping = None if damping is None else _matrix("damping", damping, faults)
        if faults:
            raise ModelError(faults)
        n = len(self.stiffness)
        for name in ("mass", "damping"):
            matrix = getattr(self, name)
            if matrix is not None and len(matrix) != n:
                faults.append(f"mass, stiffness and damping differ in size: {name} has {len(matrix)} rows, not {n}")
        self.coordinates = _labels(coordinates, n, faults)
        self.interface = _rows(interface, self.coordinates, faults)
        self.positions = None if positions is None else _places(positions, self.coordinates, faults)
        if faults:
            raise ModelError(faults)

    @classmethod
    def of(cls, structure: Structure, interface: Sequence = ()) -> "Substructure":
        """From finite elements; the interface by node names or labels.  Damping only where elements damp."""
        damped = any(getattr(group.element, "damper", None) is not None for group in structure.groups.values())
        kinds = ("mass", "stiffness", "damping") if damped else ("mass", "stiffness")
        matrices = assemble_dense(structure, kinds)
        positions = {name: structure.positions[i] for i, name in enumerate(structure.names)}
        return cls(*matrices, interface=interface, coordinates=structure.labels, positions=positions)

    @property
    def num_rows(self) -> int:
        return len(self.coordinates)

    @property
    def interior(self) -> tuple[int, ...]:
        """Rows that are not in the interface."""
        at = set(self.interface)
        return tuple(i for i in range(self.num_rows) if i not in at)

    def rows(self, *names) -> tuple[int, ...]:
        """Rows of labels `(node, direction)`, or of all the coordinates of nodes. Raises: ModelError."""
        faults = []
        found = _rows(names, self.coordinates, faults)
        if faults:
            raise ModelError(faults)
        return found

    def label(self, row: int) -> str:
        """Name of a coordinate: "tip rz"."""
        return " ".join(self.coordinates[row]).strip()


def _matrix(name, value, faults):
    """Square array of numbers from an array or a SciPy sparse matrix."""
    shape = np.shape(value) if not hasattr(value, "shape") else tuple(value.shape)
    if len(shape) != 2 or shape[0] != shape[1] or shape[0] == 0:
        faults.append(f"{name} must be a square matrix, got shape {shape}")
        return jnp.zeros((1, 1))
    if hasattr(value, "toarray"):
        if shape[0] > LARGEST:
            faults.append(f"{name} has {shape[0]} rows, more than {LARGEST}: reduce it before it becomes dense")
            return jnp.zeros((1, 1))
        value = value.toarray()
    value = jnp.asarray(value)
    value = value if jnp.issubdtype(value.dtype, jnp.inexact) else value.astype(float)
    if not isinstance(value, jax.core.Tracer) and not np.all(np.isfinite(np.asarray(value))):
        row, column = np.argwhere(~np.isfinite(np.asarray(value)))[0]
        faults.append(f"{name} is not finite at row {row}, column {column}")
    return value


def _labels(coordinates, n, faults):
    given = [str(i) for i in range(n)] if coordinates is None else list(coordinates)
    labels = tuple(_label(item) for item in given)
    if len(labels) != n:
        faults.append(f"{len(labels)} coordinates are named, the matrices have {n} rows")
    repeated = (
        sorted({" ".join(label).strip() for label in labels if labels.count(label) > 1})
        if len(set(labels)) < len(labels)
        else []
    )
    if repeated:
        faults.append(f"coordinates named twice: {', '.join(repeated[:5])}")
    wrong = sorted({direction for _, direction in labels} - {*DIRECTIONS, ""})
    if wrong:
        faults.append(f"directions {wrong} are none of {', '.join(DIRECTIONS)}")
    return labels


def _label(item) -> tuple[str, str]:
    if isinstance(item, str):
        node, _, direction = item.rpartition(" ")
        return (node, direction) if node and direction in DIRECTIONS else (item, "")
    node, direction = item
    return str(node), str(direction)


def _rows(names, labels, faults):
    found = []
    for name in names:
        if isinstance(name, int | np.integer) and not isinstance(name, bool):
            hits = [int(name)] if 0 <= name < len(labels) else []
        else:
            label = _label(name)
            hits = [i for i, own in enumerate(labels) if own == label or (label[1] == "" and own[0] == label[0])]
        if not hits:
            faults.append(f"interface: there is no coordinate or node {name!r}")
        found += hits
    if len(set(found)) < len(found):
        faults.append("interface: coordinates are named twice")
    return tuple(found)


def _places(positions, labels, faults):
    if not isinstance(positions, Mapping):
        faults.append("positions is a mapping from node names to (3,)")
        return None
    known = {str(name): jnp.asarray(place) for name, place in positions.items()}
    missing = sorted({node for node, direction in labels if direction and node not in known})
    if missing:
        faults.append(f"positions of nodes are missing: {', '.join(missing[:5])}")
    faults += [f"position of {name} has shape {p.shape}, not (3,)" for name, p in known.items() if p.shape != (3,)]
    return known
