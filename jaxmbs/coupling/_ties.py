"""Ties of named bonds: ends, directions and joint numbers, all found on the host."""

from collections.abc import Mapping
from typing import NamedTuple

from jaxtyping import Array

from ..checks import are_axes, no_such
from ..elements import DIRECTIONS
from ..errors import ModelError, UnknownNameError
from ..linear._labels import find_rows
from ..linear._system import LinearSystem
from ._bonds import GROUND, Bond

#: Fault of a name that would be confused with a node of a component.
DOTTED_NAME = "names must not contain a dot, as 'stage.top' is the node 'top' of 'stage', nor be 'ground'"


class Channels(NamedTuple):
    """Coordinates that bonds may tie, of a component with others of its own (a rigid body, measured data)."""

    coordinates: tuple[tuple[str, str], ...]
    positions: Array | None = None
    nodes: tuple[str, ...] = ()

    @property
    def interface(self) -> range:
        return range(len(self.coordinates))

    @property
    def num_interface(self) -> int:
        return len(self.coordinates)


class Ties(NamedTuple):
    """Coordinates tied by a bond: interface coordinates `(component, number)`, None for the ground.

    Attributes:
        labels: directions of the bond.
        kept: indices of the directions that are tied.
        pairs: at its first end and, of a bushing, at its second: `(first, second)` for each tied direction.
        ends: coordinates of the components at its two ends.
    """

    labels: tuple[str, ...]
    kept: tuple[int, ...]
    pairs: tuple[tuple[tuple, ...], ...]
    ends: tuple[tuple, tuple]


def bond_ties(components: Mapping, bonds: Mapping[str, Bond]) -> dict[str, Ties]:
    """Ties of each bond, by name.  Raises: ModelError with every fault: names, counts, directions."""
    kinds = {name: type(c).__name__ for name, c in components.items() if not isinstance(c, LinearSystem | Channels)}
    faults = [f"component {name!r} is a {kind}, not a LinearSystem" for name, kind in kinds.items()]
    found: dict[str, Ties] = {}
    faults += [f"component {name!r}: {DOTTED_NAME}" for name in components if "." in name or name == GROUND]
    for name, bond in bonds.items() if not kinds else ():
        own = []
        if name in components or name == GROUND:
            own.append("a component has this name")
        if bond.element is not None and "." in name:
            own.append(DOTTED_NAME)
        ends = [_end_coordinates(end, components, own) for end in bond.ends]
        if not own:
            found[name] = _bond_ties(name, bond, ends, own)
        faults += [f"bond {name!r}: {fault}" for fault in own]
    if faults:
        raise ModelError(faults)
    return found


def _bond_ties(name, bond, ends, faults):
    (first, labels), (second, others) = ends
    count, grounded = len(first), bond.ends[1][0] == GROUND
    if not first:
        faults.append("its first end is the ground, which must be the second end")
    if not grounded and (len(second) != count or _directions_differ(labels, others)):
        faults.append(f"its ends have different directions: {' '.join(labels)} and {' '.join(others)}")
    stray = [str(f) for f in bond.free if f not in labels and f not in range(count)]
    if stray:
        faults.append(f"its ends have no direction {', '.join(stray)}, only {' '.join(labels)}")
    if bond.axes is not None and count not in (3, 6):
        faults.append(f"a bond with axes needs nodes of 3 or 6 coordinates as ends, not {count} coordinates")
    if bond.axes is not None and not are_axes(bond.axes):
        faults.append("its axes must be three right-handed orthogonal unit vectors")
    if bond.element is not None and bond.element.num_interface != 2 * count:
        faults.append(f"its stiffness has {bond.element.num_interface // 2} directions, its ends {count} coordinates")
    if faults:
        return None
    kept = tuple(k for k in range(count) if k not in bond.free and labels[k] not in bond.free)
    second = [None] * count if grounded else second
    if bond.element is None:
        pairs = (tuple((first[k], second[k]) for k in kept),)
    else:
        pairs = (
            tuple((c, (name, k)) for k, c in enumerate(first)),
            tuple(((name, count + k), c) for k, c in enumerate(second)),
        )
    return Ties(labels, kept, pairs, (tuple(first), tuple(c for c in second if c is not None)))


def _end_coordinates(end, components, faults):
    """Interface coordinates of an end (none of the ground) and their directions."""
    name, which = end
    if name == GROUND:
        return [], ()
    if name not in components:
        faults.append(no_such("component", name, components))
        return [], ()
    component = components[name]
    count, names = component.num_interface, [component.coordinates[i] for i in component.interface]
    nodes = [w for w in which or () if isinstance(w, str)]
    missing = []
    at = find_rows(nodes, names, missing)
    stray = [k for k in which or () if not isinstance(k, str) and not 0 <= k < count]
    if missing:
        faults.append(f"interface of {name!r}: {missing[0]}")
    if stray:
        faults.append(f"{name!r} has no interface coordinate number {stray[0]}, only 0 ... {count - 1}")
    if missing or stray:
        return [], ()
    chosen = range(count) if which is None else which
    if nodes:
        chosen = at
    labels = tuple(names[k][1] or str(place) for place, k in enumerate(chosen))
    return [(name, int(k)) for k in chosen], labels


def axes_faults(bonds: Mapping[str, Bond], found: Mapping[str, Ties]) -> list[str]:
    """Faults of bonds with axes whose ends are joined by other bonds too."""
    used: dict[tuple, list] = {}
    for name, bond in found.items():
        for coordinate in (c for end in bond.ends for c in end):
            used.setdefault(coordinate, []).append(name)
    faults = []
    for name, bond in bonds.items():
        for end in found[name].ends if bond.axes is not None else ():
            others = sorted({other for c in end for other in used[c]} - {name})
            if others:
                faults.append(f"bond {name!r} has axes: {', '.join(others)} must not join the same coordinates")
    return faults


def _directions_differ(first, second):
    """True if two ends have different directions at some place."""
    pairs = zip(first, second, strict=True)
    return any(a != b for a, b in pairs if a in DIRECTIONS and b in DIRECTIONS)


def split_component(name, components) -> tuple:
    """Split a name "stage.top z" or ("stage", "top z") into component and coordinate.  Raises: UnknownNameError."""
    component, own = name.partition(".")[::2] if isinstance(name, str) else name
    if component not in components:
        raise UnknownNameError(no_such("component", component, components))
    return component, own


def joint_numbers(sizes: Mapping[str, int], found: Mapping[str, Ties]) -> tuple[tuple[int, ...], ...]:
    """Joint numbers of the interface coordinates of each component, -1 for the ground.

    Args: sizes: numbers of interface coordinates of the components and bushings.

    Raises: ModelError for bonds between coordinates that are tied already.
    """
    root = {(name, k): (name, k) for name, size in sizes.items() for k in range(size)} | {None: None}

    def top(c):
        while root[c] != c:
            c = root[c]
        return c

    faults = {}
    for name, bond in found.items():
        for first, second in (pair for side in bond.pairs for pair in side):
            a, b = top(first), top(second)
            if a == b:
                faults[f"bond {name!r}: its ends are tied by other bonds already"] = None
            root[b if a is None else a] = a if a is None else b
    if faults:
        raise ModelError(list(faults))
    numbers = {None: -1}
    return tuple(
        tuple(numbers.setdefault(top((name, k)), len(numbers) - 1) for k in range(size))
        for name, size in sizes.items()
    )
