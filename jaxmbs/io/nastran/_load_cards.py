"""Cards of loads and temperatures as records; what is wrong with them is told where the set is asked for."""

from collections.abc import Iterable

import numpy as np

from ._cards import Card
from ._connections import Groups
from ._context import DeckContext
from ._loads import Acceleration, EnforcedPlaces, FacePressures, LoadSet, NodalForces, SpanLoads
from ._ties import Pair

#: Cards whose sets are read; others of a set make it unusable.
READ = """FORCE MOMENT FORCE1 MOMENT1 FORCE2 MOMENT2 SLOAD PLOAD PLOAD1 PLOAD2 PLOAD4 GRAV RFORCE SPCD""".split()
UNREAD = """ACCEL ACCEL1 PLOADX1 RFORCE1 PLOADB3 FORCEAX PRESAX PLOADX LOADCYH LOADCYN LOADCYT UXVEC""".split()
#: Cards of temperatures that make a set unusable.
UNREAD_WARMTH = "TEMPAX TEMPB3 TEMPF TEMPG TEMPN1 TEMPP1 TEMPP2 TEMPP3 TEMPRB".split()


def read_loads(
    found: dict[str, list[Card]], deck: DeckContext, elements: Groups, on_hold: set[Pair]
) -> dict[str, LoadSet]:
    """Sets by name, "LOAD 3": those of single cards, and of LOAD their sums; `on_hold`: directions of supports."""
    places = _Places(elements, on_hold)
    parts: dict[int, list] = {}
    wrong: dict[int, list[str]] = {}
    for name in (*READ, *UNREAD):
        for given in found.get(name, ()):
            card = _quiet(given)
            number = card.integer(1, "SID")
            if name in UNREAD:
                card.fault(f"{name} is not read")
            else:
                parts.setdefault(number, []).extend(_READERS[name](card, deck, places))
            wrong.setdefault(number, []).extend(card.faults[:5])
    made = {number: LoadSet(tuple(_gather(own)), None, tuple(wrong[number])) for number, own in parts.items()}
    made |= {number: LoadSet(refused=tuple(faults)) for number, faults in wrong.items() if number not in made}
    for given in found.get("LOAD", ()):
        card = _quiet(given)
        total = _sum(card, made)
        made[card.integer(1, "SID")] = total
    return {f"LOAD {number}": own for number, own in sorted(made.items())}


def read_temperatures(
    found: dict[str, list[Card]], deck: DeckContext
) -> tuple[dict[str, np.ndarray], tuple[tuple[str, str], ...]]:
    """Temperatures (nodes,) by name of their set, "TEMPERATURE 3", NaN where a set leaves a GRID out; and for sets
    that cannot be used why, (name, fault)."""
    made: dict[int, np.ndarray] = {}
    for given in found.get("TEMPD", ()):
        card = _quiet(given)
        for k in range(1, len(card) + 1, 2):
            made[card.integer(k, "SID")] = np.full(len(deck.ids), card.real(k + 1, "T"))
    for given in found.get("TEMP", ()):
        card = _quiet(given)
        own = made.setdefault(card.integer(1, "SID"), np.full(len(deck.ids), np.nan))
        for k in range(2, len(card) + 1, 2):
            if card.text(k):
                own[deck.node(card, k, "G")] = card.real(k + 1, "T")
    unread = {}
    for name in UNREAD_WARMTH:
        for card in map(_quiet, found.get(name, ())):
            number = card.integer(1, "SID")
            made.setdefault(number, np.full(len(deck.ids), np.nan))
            unread[f"TEMPERATURE {number}"] = f"{name} is not read: {card.place}"
    return {f"TEMPERATURE {number}": own for number, own in sorted(made.items())}, tuple(unread.items())


def read_enforced(found: dict[str, list[Card]], sets: set[int], deck: DeckContext) -> EnforcedPlaces | None:
    """Displacements D of the SPC cards of these sets, None where there are none."""
    pairs = []
    for card in found.get("SPC", ()):
        if card.integer(1, "SID") in sets:
            pairs += _enforced(_quiet(card), deck)
    return _gather_enforced(pairs) if any(value for *_, value, _ in pairs) else None


def _quiet(card):
    """A copy whose faults are its own."""
    copy = Card(card.name, card.place, [])
    copy.fields = list(card.fields)
    return copy


def _sum(card, made):
    whole, parts, factors, refused = card.real(2, "S"), [], [], []
    for k in range(3, len(card) + 1, 2):
        factor, number = card.real(k, "S"), card.integer(k + 1, "L")
        if number not in made:
            card.fault(f"there are no loads {number}")
            continue
        own = made[number]
        refused += own.refused
        parts += own.parts
        factors += [whole * factor] * len(own.parts)
    return LoadSet(tuple(parts), factors, (*card.faults, *refused))


class _Places:
    """Faces and nodes of elements by number, the places of bars in their groups, directions that supports hold."""

    def __init__(self, elements: Groups, on_hold: set[Pair]) -> None:
        self.on_hold = on_hold
        self.nodes: dict[int, tuple] = {}
        self.bars: dict[int, tuple[str, int]] = {}
        for name, own in elements.items():
            if name.split()[0] in ("CBAR", "CBEAM"):
                self.bars |= {number: (name, k) for k, number in enumerate(own.ids)}
            if name.split()[0] in ("CBAR", "CBEAM", "CROD", "CONROD", "CBUSH", "CTUBE", "CVISC", "CONM2"):
                continue
            faces = getattr(getattr(own, "kind", None), "rule", None)
            rows = () if faces is None else getattr(faces, "faces", ())
            for number, nodes in zip(own.ids, own.nodes, strict=True):
                self.nodes.setdefault(number, (tuple(nodes), rows, bool(getattr(own, "halves", ()))))


def _force(card, deck, places):
    scale, direction = card.real(4, "F"), card.reals(5, 3, "N")
    node = deck.node(card, 2, "G")
    value = scale * _basic(card, deck, card.integer(3, "CID", 0, low=0), direction, node)
    return [_nodal(card, node, value)]


def _force_between(card, deck, places):
    """From G1 to G2, or along the product of G1 to G2 and G3 to G4."""
    count = 4 if card.name.endswith("2") else 2
    node, *ends = (deck.node(card, k, "G") for k in (2, *range(4, 4 + count)))
    ways = np.diff(deck.positions[ends].reshape(-1, 2, 3), axis=1)[:, 0]
    way = ways[0] if count == 2 else np.cross(*ways)
    length = np.linalg.norm(way)
    if not length > 1e-12 * np.prod(np.linalg.norm(ways, axis=1)):
        card.fault("its nodes give no direction")
    return [_nodal(card, node, card.real(3, "F") * way / (length or 1.0))]


def _force_on_points(card, deck, places):
    """SLOAD: pairs of a scalar point and a force; of a GRID it acts along direction 1 of its displacements."""
    for k in range(2, len(card) + 1, 2):
        node = deck.node(card, k, "S")
        row = np.zeros(6)
        row[:3] = card.real(k + 1, "F") * (np.eye(3) if node in deck.scalars else deck.axes(node))[0]
        yield "nodal", node, row


def _nodal(card, node, value):
    row = np.zeros(6)
    row[slice(3, 6) if card.name.startswith("MOMENT") else slice(0, 3)] = value
    return "nodal", node, row


def _basic(card, deck, frame, vector, node):
    """A vector of a coordinate system at a node, in basic axes."""
    return np.asarray(vector) @ deck.frame(card, frame).at(deck.positions[node], np)


def _gravity(card, deck, places):
    return [Acceleration(card.real(3, "A") * _everywhere(card, deck, 2, card.reals(4, 3, "N")))]


def _everywhere(card, deck, k, vector):
    """A vector of the rectangular system of field k, in basic axes."""
    number = card.integer(k, "CID", 0, low=0)
    if deck.frame(card, number).kind != "R":
        card.fault(f"CID {number} is not rectangular: it gives other directions at other places")
    return _basic(card, deck, number, vector, 0)


def _rotation(card, deck, places):
    card.refuse_fields("RACC", 9)
    node = deck.node(card, 2, "G") if card.text(2) not in ("", "0") else None
    centre = np.zeros(3) if node is None else deck.positions[node]
    axis = _everywhere(card, deck, 3, card.reals(5, 3, "R"))
    return [Acceleration(np.zeros(3), 2 * np.pi * card.real(4, "A") * axis, centre)]


def _pressure(card, deck, places):
    nodes = [deck.node(card, k, "G") for k in (3, 4, 5, 6) if card.text(k)]
    return [("face", tuple(nodes), [card.real(2, "P")] * len(nodes), np.zeros(3))] if len(nodes) > 2 else []


def _pressure_on(card, deck, places):
    pressure = card.real(2, "P")
    for number in _numbers(card, card.identifiers(3, "EID"), places):
        face = _whole_face(card, places, number)
        yield "face", face, [pressure] * _corners(face), np.zeros(3)


def _pressure_of_element(card, deck, places):
    last = 8 if card.text(7).upper() == "THRU" else 2
    first = card.integer(2, "EID")
    numbers = range(first, card.integer(8, "EID") + 1) if last == 8 else range(first, first + 1)
    given = [card.real(k, "P", None) for k in (3, 4, 5, 6)]
    direction = np.zeros(3)
    if any(card.text(k) for k in (10, 11, 12)):
        direction = _everywhere(card, deck, 9, card.reals(10, 3, "N"))
        direction = direction / (np.linalg.norm(direction) or 1.0)
    card.refuse_fields("SORL", 13, harmless=("SURF",))
    card.refuse_fields("LDIR", 14, harmless=("NORM",))
    for number in _numbers(card, [numbers], places):
        inward = last != 8 and card.text(7) not in ("", "0")
        face = _named_face(card, deck, places, number) if inward else _whole_face(card, places, number)
        values = [(given[0] or 0.0) if p is None else p for p in given[: _corners(face)]]
        sign = -1.0 if inward and not np.any(direction) else 1.0
        yield "face", face, [sign * p for p in values], direction


_SPAN_TYPES = [f"{what}{axis}{frame}" for frame in ("", "E") for what in "FM" for axis in "XYZ"]


def _along_bar(card, deck, places):
    """PLOAD1 at X1, or linear from X1 to X2 where both are given and differ."""
    number, kind, scale = card.integer(2, "EID"), card.text(3).upper(), card.text(4).upper()
    if number not in places.bars:
        card.fault(f"there is no CBAR or CBEAM {number}")
        return
    if kind not in _SPAN_TYPES:
        card.fault(f"TYPE {kind} must be one of {', '.join(_SPAN_TYPES)}")
        return
    begin, first = card.real(5, "X1"), card.real(6, "P1")
    end = card.real(7, "X2", begin)
    last, spread = card.real(8, "P2", 0.0), end != begin
    if scale not in ("LE", "FR", "LEPR", "FRPR"):
        card.fault(f"SCALE {scale} must be LE, FR, LEPR or FRPR")
    across = spread and scale.endswith("PR")
    kind, own = _SPAN_TYPES.index(kind) % 6, kind.endswith("E")
    row = [begin, end], [first, last], scale.startswith("FR"), spread, across, kind, own
    yield "span", *places.bars[number], *row


def _numbers(card, ranges, places):
    """Numbers of elements that there are; a fault for one that is named alone and is not there."""
    for numbers in ranges:
        own = [number for number in numbers if number in places.nodes]
        if not own:
            card.fault(f"there is no shell or solid {numbers.start}")
        yield from own


def _whole_face(card, places, number):
    nodes, rows, partial = places.nodes[number]
    if rows or partial:
        card.fault(f"element {number} is a solid, or lacks nodes on its edges: name its face by G1 and G34")
    return nodes


def _named_face(card, deck, places, number):
    """The face of a solid with G1 and the opposite corner G3, or without the corner G4 of a tetrahedron."""
    nodes, rows, partial = places.nodes[number]
    first = deck.node(card, 7, "G1")
    other = deck.node(card, 8, "G34") if card.text(8) not in ("", "0") else None
    if not rows or partial:
        card.fault(f"element {number} is a shell, or lacks nodes on its edges")
        return nodes[:4]
    corners = [tuple(nodes[k] for k in row) for row in rows]
    for face in corners:
        own = face[: _corners(face)]
        if first not in own:
            continue
        if len(own) == 3 and (other is None or (len(rows) == 4 and other not in own)):
            return face
        if len(own) == 4 and other in own and (own.index(first) - own.index(other)) % 2 == 0:
            return face
    card.fault(f"element {number} has no face with these nodes")
    return corners[0]


def _corners(face):
    return 3 if len(face) in (3, 6) else 4


def _prescribed(card, deck, places):
    for record in _enforced(card, deck):
        _, node, d, _, _ = record
        if (node, d) not in places.on_hold:
            card.fault(f"GRID {deck.ids[node]}, direction {d + 1}: no SPC holds it")
        yield record


def _enforced(card, deck):
    """Of SPC and SPCD: ("enforced", node, direction, value, unit vector over x y z rx ry rz)."""
    for k in (2, 5):
        if not card.text(k):
            continue
        node, value = deck.node(card, k, "G"), card.real(k + 2, "D", 0.0)
        axes = np.eye(3) if node in deck.scalars else deck.axes(node)
        for d in deck.directions(card, k + 1, "C", node):
            row = np.zeros(6)
            row[3 * (d // 3) : 3 * (d // 3) + 3] = axes[d % 3]
            yield "enforced", node, d, value, row


def _gather(own) -> Iterable:
    """Records of like parts together."""
    nodal = [part[1:] for part in own if isinstance(part, tuple) and part[0] == "nodal"]
    if nodal:
        yield NodalForces(tuple(node for node, _ in nodal), np.array([row for _, row in nodal]))
    faces: dict[int, list] = {}
    for part in own:
        if isinstance(part, tuple) and part[0] == "face":
            faces.setdefault(len(part[1]), []).append(part[1:])
    for rows in faces.values():
        nodes, pressures, directions = zip(*rows, strict=True)
        yield FacePressures(nodes, np.array(pressures, float), np.array(directions, float))
    spans: dict[str, list] = {}
    for part in own:
        if isinstance(part, tuple) and part[0] == "span":
            spans.setdefault(part[1], []).append(part[2:])
    for group, rows in spans.items():
        bars, at, values, *flags = zip(*rows, strict=True)
        yield SpanLoads(group, bars, np.array(at), np.array(values), *flags)
    enforced = [part for part in own if isinstance(part, tuple) and part[0] == "enforced"]
    if enforced:
        yield _gather_enforced(enforced)
    yield from (part for part in own if not isinstance(part, tuple))


def _gather_enforced(records):
    """Each direction once, by the last card that names it."""
    last = {(node, d): (value, row) for _, node, d, value, row in records}
    values, rows = zip(*last.values(), strict=True)
    return EnforcedPlaces(tuple(node for node, _ in last), np.array(values), np.array(rows))


_READERS = {
    **dict(FORCE=_force, MOMENT=_force, GRAV=_gravity, SLOAD=_force_on_points),
    **dict.fromkeys(("FORCE1", "MOMENT1", "FORCE2", "MOMENT2"), _force_between),
    **dict(
        RFORCE=_rotation,
        PLOAD=_pressure,
        PLOAD1=_along_bar,
        PLOAD2=_pressure_on,
        PLOAD4=_pressure_of_element,
        SPCD=_prescribed,
    ),
}
