"""What named bonds tie together: ends, directions and joint numbers, all found on the host."""

from collections.abc import Mapping
from typing import NamedTuple

from jaxtyping import Array

from ..checks import are_axes, no_such
from ..elements import DIRECTIONS
from ..errors import ModelError, UnknownNameError
from ..linear._labels import find_rows
from ..linear._system import LinearSystem
from ._bonds import GROUND, Bond

#: The fault of a name that could not be told from a component's node.
DOTTED_NAME = "a name without a dot, please: 'stage.top' is the node 'top' of 'stage'"


class Channels(NamedTuple):
    """What bonds may tie of a component whose own coordinates are others, or none: a rigid body, measured data."""

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
    """What a bond ties: interface coordinates `(component, number)`, None for those of the ground.

    Attributes:
        labels: its directions.
        kept: places among them that are tied.
        pairs: at its first end and, of a bushing, at its second: `(first, second)` for each that is kept.
        ends: coordinates of the components at its two ends.
    """

    labels: tuple[str, ...]
    kept: tuple[int, ...]
    pairs: tuple[tuple[tuple, ...], ...]
    ends: tuple[tuple, tuple]


def bond_ties(components: Mapping, bonds: Mapping[str, Bond]) -> dict[str, Ties]:
    """What each bond ties.  Raises: ModelError with every fault: names, counts, directions."""
    kinds = {name: type(c).__name__ for name, c in components.items() if not isinstance(c, LinearSystem | Channels)}
    faults = [f"component {name!r} is a {kind}, not a LinearSystem" for name, kind in kinds.items()]
    found: dict[str, Ties] = {}
    faults += [f"component {name!r}: {DOTTED_NAME}" for name in components if "." in name or name == GROUND]
    for name, bond in bonds.items() if not kinds else ():
        own = []
        if name in components or name == GROUND:
            own.append("a component has that name")
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
        faults.append("its first end is the ground: let that be the second")
    if not grounded and (len(second) != count or _directions_differ(labels, others)):
        faults.append(f"its ends do not match: {' '.join(labels)} and {' '.join(others)}")
    stray = [str(f) for f in bond.free if f not in labels and f not in range(count)]
    if stray:
        faults.append(f"no direction {', '.join(stray)} among {' '.join(labels)}")
    if bond.axes is not None and count not in (3, 6):
        faults.append(f"it has axes, so its ends must be nodes of 3 or 6 coordinates, not {count}")
    if bond.axes is not None and not are_axes(bond.axes):
        faults.append("its axes must be three unit vectors, square to each other and right-handed")
    if bond.element is not None and bond.element.num_interface != 2 * count:
        faults.append(f"stiffness of {bond.element.num_interface // 2} directions for {count} coordinates")
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
    """Interface coordinates of an end, none of the ground, and their directions."""
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
        faults.append(f"{name!r} has {count} interface coordinates, none with the number {stray[0]}")
    if missing or stray:
        return [], ()
    chosen = range(count) if which is None else which
    if nodes:
        chosen = at
    labels = tuple(names[k][1] or str(place) for place, k in enumerate(chosen))
    return [(name, int(k)) for k in chosen], labels


def axes_faults(bonds: Mapping[str, Bond], found: Mapping[str, Ties]) -> list[str]:
    """Faults of bonds with axes whose ends other bonds join too."""
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
    """Directions that are named on both sides and are not the same."""
    pairs = zip(first, second, strict=True)
    return any(a != b for a, b in pairs if a in DIRECTIONS and b in DIRECTIONS)


def split_component(name, components) -> tuple:
    """(component, what of it) of a name: "stage.top z" or ("stage", "top z").  Raises: UnknownNameError."""
    component, own = name.partition(".")[::2] if isinstance(name, str) else name
    if component not in components:
        raise UnknownNameError(no_such("component", component, components))
    return component, own


def joint_numbers(sizes: Mapping[str, int], found: Mapping[str, Ties]) -> tuple[tuple[int, ...], ...]:
    """For each component the number of the joint of every interface coordinate, -1 for the ground's.

    Args: sizes: how many interface coordinates the components and bushings have.

    Raises: ModelError for bonds that tie what is tied already.
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
                faults[f"bond {name!r}: other bonds tie its ends already"] = None
            root[b if a is None else a] = a if a is None else b
    if faults:
        raise ModelError(list(faults))
    numbers = {None: -1}
    return tuple(
        tuple(numbers.setdefault(top((name, k)), len(numbers) - 1) for k in range(size))
        for name, size in sizes.items()
    )
