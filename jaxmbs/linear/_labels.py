"""Labels `(node, direction)` of coordinates, the rows that they denote, and positions of nodes."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from ..checks import list_faults, no_such, repeated
from ..elements import DIRECTIONS
from ..elements._base import as_real


def parse_label(item) -> tuple[str, str]:
    """Parse a name into `(node, direction)`: "tip rz", ("tip", "rz"), or "mode" without a direction."""
    if isinstance(item, str):
        node, _, direction = item.rpartition(" ")
        return (node, direction) if node and direction in DIRECTIONS else (item, "")
    node, direction = item
    return str(node), str(direction)


def format_label(item: tuple[str, str]) -> str:
    """Format a label as one name: "tip rz"."""
    return " ".join(item).strip()


def coordinate_labels(coordinates, n: int, faults: list) -> tuple[tuple[str, str], ...]:
    """Labels of n rows, by default their numbers; faults are appended to the list."""
    if isinstance(coordinates, str):
        faults += list_faults("coordinates", coordinates)
        coordinates = None
    given = [str(i) for i in range(n)] if coordinates is None else list(coordinates)
    labels = tuple(parse_label(item) for item in given)
    if len(labels) != n:
        faults.append(f"{len(labels)} coordinates are named, but the matrices have {n} rows")
    twice = [format_label(item) for item in repeated(labels)]
    if twice:
        faults.append(f"coordinates named twice: {', '.join(twice[:5])}")
    wrong = sorted({direction for _, direction in labels} - {*DIRECTIONS, ""})
    if wrong:
        faults.append(f"unknown directions {', '.join(wrong)}: the directions are {', '.join(DIRECTIONS)}")
    return labels


def find_rows(names, labels, faults: list) -> tuple[int, ...]:
    """Rows denoted by labels, by nodes (all their coordinates) or by numbers; faults are appended to the list."""
    if isinstance(names, str):
        faults += list_faults("names", names)
        return ()
    found, places = [], {}
    for i, (node, direction) in enumerate(labels):
        places.setdefault((node, direction), []).append(i)
        if direction:
            places.setdefault((node, ""), []).append(i)
    for name in names:
        if isinstance(name, int | np.integer) and not isinstance(name, bool):
            hits = [int(name)] if 0 <= name < len(labels) else []
        else:
            hits = places.get(parse_label(name), [])
        if not hits:
            faults.append(no_such("coordinate or node", name, map(format_label, places)))
        found += hits
    twice = repeated(found)
    if twice:
        faults.append(f"{', '.join(format_label(labels[row]) for row in twice[:5])} stands there twice")
    return tuple(found)


def node_positions(positions, labels, faults: list):
    """Names (nodes,) and positions (nodes, 3) of nodes; faults are appended to the list."""
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
    return names, as_real(places)
