"""A linear system: mass, damping and stiffness over named coordinates, some of them an interface to others."""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from ..checks import known, no_such
from ..elements import DIRECTIONS
from ..elements.base import number
from ..errors import ModelError

#: Above this many coordinates a dense matrix is refused; reduce first, or keep blocks.
LARGEST = 10000


class LinearSystem(eqx.Module):
    """Matrices `M x'' + C x' + K x = F + R` of one component, or of many.  Source: S1 (3).

    Args:
        mass, stiffness: (n, n) arrays or SciPy sparse matrices (those of scikit-fem as they are).
        damping: likewise, or None.
        interface: what is joined to other components: numbers of rows, or labels, or names of nodes (all their rows).
        coordinates: label of each row: `(node, direction)`, direction one of x y z rx ry rz or "" (a mode), or plain
            strings; default "0", "1", ...
        positions: (3,) [m] by name of node, or the names and an array (nodes, 3), for the checks of rigid motions.

    Raises: ModelError with every fault: shapes, repeated or missing labels, an interface that is not there.
    """

    mass: Inexact[Array, "n n"]
    stiffness: Inexact[Array, "n n"]
    damping: Inexact[Array, "n n"] | None
    positions: Float[Array, "nodes 3"] | None
    nodes: tuple[str, ...] = eqx.field(static=True)
    interface: tuple[int, ...] = eqx.field(static=True)
    coordinates: tuple[tuple[str, str], ...] = eqx.field(static=True)

    def __init__(self, *, mass, stiffness, damping=None, interface: Sequence = (), coordinates=None, positions=None):
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
        self.nodes, self.positions = _places(positions, self.coordinates, faults)
        if faults:
            raise ModelError(faults)

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

    def label(self, row) -> str:
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
            faults.append(f"{name} has {shape[0]} rows, more than {LARGEST}: too many, see block_matrices")
            return jnp.zeros((1, 1))
        value = value.toarray()
    value = jnp.asarray(value) if jnp.iscomplexobj(value) else number(value)
    if known(value) and not np.all(np.isfinite(np.asarray(value))):
        row, column = np.argwhere(~np.isfinite(np.asarray(value)))[0]
        faults.append(f"{name} is not finite at row {row}, column {column}")
    return value


def _labels(coordinates, n, faults):
    given = [str(i) for i in range(n)] if coordinates is None else list(coordinates)
    labels = tuple(_label(item) for item in given)
    if len(labels) != n:
        faults.append(f"{len(labels)} coordinates are named, the matrices have {n} rows")
    unique = len(set(labels)) == len(labels)
    repeated = [] if unique else sorted({" ".join(label).strip() for label in labels if labels.count(label) > 1})
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
    found, places = [], {}
    for i, (node, direction) in enumerate(labels):
        places.setdefault((node, direction), []).append(i)
        if direction:
            places.setdefault((node, ""), []).append(i)
    for name in names:
        if isinstance(name, int | np.integer) and not isinstance(name, bool):
            hits = [int(name)] if 0 <= name < len(labels) else []
        else:
            hits = places.get(_label(name), [])
        if not hits:
            labelled = [" ".join(place).strip() for place in places]
            faults.append(f"interface: {no_such('coordinate or node', name, labelled)}")
        found += hits
    if len(set(found)) < len(found):
        faults.append("interface: coordinates are named twice")
    return tuple(found)


def _places(positions, labels, faults):
    """Names and positions (nodes, 3) of nodes."""
    if positions is None:
        return (), None
    mapped = isinstance(positions, Mapping)
    names, places = (positions.keys(), positions.values()) if mapped else positions
    names = tuple(str(name) for name in names)
    if mapped and all(np.shape(place) == (3,) for place in places):
        places = jnp.stack([jnp.asarray(place) for place in places])
    elif mapped:
        wrong = [name for name, place in zip(names, places, strict=True) if np.shape(place) != (3,)]
        faults.append(f"positions need three components each: {', '.join(wrong[:5])}")
        return names, None
    elif np.shape(places) != (len(names), 3):
        faults.append(f"{len(names)} nodes need positions of shape ({len(names)}, 3), got {np.shape(places)}")
    missing = sorted({node for node, direction in labels if direction} - set(names))
    if missing:
        faults.append(f"positions of nodes are missing: {', '.join(missing[:5])}")
    return names, number(places)
