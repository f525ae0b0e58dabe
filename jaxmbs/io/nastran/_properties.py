"""Properties: the numbers of a deck that many elements share."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ...elements._base import as_optional_real, as_real
from ...typing import Convertible
from ._cards import REQUIRED, Card, require_positive
from ._context import DeckContext
from ._panel_groups import panel
from ._point_properties import bush, line_damper, scalar, scalar_damper, scalar_mass
from ._sections import SECTIONS
from ._shell_properties import laminate, plate

Scalar = Convertible[Float[Array, ""]]


class BeamProperty(eqx.Module):
    """PBAR, PBEAM or PROD.

    Attributes:
        area [m^2]; inertia_1, inertia_2: I1 and I2, bending in planes 1 and 2 [m^4]; torsion: J [m^4].
        line_mass: NSM [kg/m]; shear: (2,) K1 and K2, or None for none.
        material: name, "MAT1 3".
    """

    area: Scalar = eqx.field(converter=as_real)
    inertia_1: Scalar = eqx.field(converter=as_real)
    inertia_2: Scalar = eqx.field(converter=as_real)
    torsion: Scalar = eqx.field(converter=as_real)
    line_mass: Scalar = eqx.field(converter=as_real)
    shear: Convertible[Float[Array, "2"] | None] = eqx.field(converter=as_optional_real)
    material: str = eqx.field(static=True)


class SolidProperty(eqx.Module):
    """PSOLID: no number of its own.

    Attributes:
        material: name, "MAT1 3"; frame: coordinate system of its axes, 0 the basic one.
    """

    material: str = eqx.field(static=True)
    frame: int = eqx.field(static=True, default=0)


#: Shear factor of a plane without transverse shear, beside another one with it.
_STIFF = 1e6
_STATIONS = ("YES", "YESA", "NO")


def section(card: Card, deck: DeckContext) -> BeamProperty:
    """PBAR, PBEAM or PROD; of a PBEAM whose section changes the mean along it."""
    mid = deck.material(card, 2, "MID")
    A, I1, I2 = (card.real(k, name, 0.0) for k, name in ((3, "A"), (4, "I1"), (5, "I2")))
    if card.name == "PROD":
        J, nsm = card.real(4, "J", 0.0), card.real(6, "NSM", 0.0)
        require_positive(card, A=A, nonnegative={"J": J, "NSM": nsm})
        return BeamProperty(A, 0.0, 0.0, J, nsm, None, mid)
    bar = card.name == "PBAR"
    J, nsm = card.real(6 if bar else 7, "J", 0.0), card.real(7 if bar else 8, "NSM", 0.0)
    card.refuse_fields("the product of inertia I12", 19 if bar else 6)
    if bar:
        K = [card.real(k, name, 0.0) for k, name in ((17, "K1"), (18, "K2"))]
    else:
        (A, I1, I2, J, nsm), K = _along_beam(card, [A, I1, I2, J, nsm], deck)
    require_positive(card, A=A, nonnegative=dict(I1=I1, I2=I2, J=J, NSM=nsm, K1=K[0], K2=K[1]))
    K = [k if k > 0 else _STIFF for k in K] if any(K) else None
    return BeamProperty(A, I1, I2, J, nsm, K, mid)


def _along_beam(card, first, deck):
    """A, I1, I2, J, NSM of a PBEAM, means along it of what its stations give, and K1, K2."""
    stations, row = {0.0: first}, 9 if card.text(9).upper() in _STATIONS else 17  # stress points may be left out
    while card.text(row).upper() in _STATIONS:
        step = 16 if card.text(row).upper() == "YES" else 8
        place = card.real(row + 1, "X/XB", 1.0)
        stations[place] = [card.real(row + k, "A, I, J or NSM", None) for k in (2, 3, 4, 6, 7)]
        card.refuse_fields("the product of inertia I12", row + 5)
        row += step
    card.refuse_fields("S1 and S2", row + 2, row + 3)
    card.refuse_fields("NSI", row + 4, row + 5)
    if any(card.real(k, "CW", 0.0) for k in (row + 6, row + 7)):
        deck.note("warping CW of PBEAM, without SA and SB of a CBEAM")
    card.refuse_fields("M1, M2, N1, N2 beside the centroid", *range(row + 8, row + 16))
    if not all(0 <= place <= 1 for place in stations):
        card.fault("X/XB must lie between 0 and 1")
        stations = {0.0: first}
    return mean_along(card, stations, deck), [card.real(row, "K1", 1.0), card.real(row + 1, "K2", 1.0)]


def mean_along(card: Card, stations: dict[float, list], deck: DeckContext) -> list[float]:
    """Means along a beam of values by station, linear between; a blank at the end is the value of end A, a blank
    between them lies on the line of its neighbours."""
    stations = {0.0: stations[0.0], **stations}
    last = stations.setdefault(1.0, stations[0.0])
    places = sorted(stations)
    ends = [[b if a is None else a for a, b in zip(last, stations[0.0], strict=True)], stations[0.0]]
    found = []
    for k in range(len(last)):
        known = {
            x: ends[0][k] if x == 1 else stations[x][k] for x in places if x in (0, 1) or stations[x][k] is not None
        }
        values = np.interp(places, list(known), list(known.values()))
        found.append(float(np.trapezoid(values, places)))
        if not np.ptp(values) <= 1e-12 * np.max(np.abs(values)):
            deck.remark_once(f"{card.name} {card.text(1)} of a section that changes has its mean along the beam")
    return found


def solid(card: Card, deck: DeckContext) -> SolidProperty:
    """PSOLID; where it asks for another integration (IN, ISOP) than the one that Nastran takes by itself, a note."""
    asked = card.text(4).upper(), card.text(6).upper()
    if asked[0] not in ("", "0", "BUBBLE") or asked[1] not in ("", "0", "REDUCED"):
        deck.remark("PSOLID with IN or ISOP is taken as without: stiffnesses by other integrations differ")
    if card.text(7).upper() not in ("", "SMECH"):
        card.fault(f"FCTN {card.text(7)[:16]!r} is not supported")
    name, frame = deck.material(card, 2, "MID", ("MAT1", "MAT9")), card.integer(3, "CORDM", 0, low=-1)
    if name.startswith("MAT9") and frame == -1:
        card.fault("axes of the element, CORDM = -1, are not supported with a MAT9")
    return SolidProperty(name, max(frame, 0) if name.startswith("MAT9") else 0)


def section_by_dimensions(card: Card, deck: DeckContext) -> BeamProperty:
    """PBARL, or PBEAML whose shear centre is its centroid; of a section that changes the mean along the beam."""
    name, mid = card.text(4).upper(), deck.material(card, 2, "MID")
    nothing = BeamProperty(1.0, 1.0, 1.0, 1.0, 0.0, None, mid)
    if name not in SECTIONS:
        card.fault(f"the section {name[:16]!r} is not supported; supported are {', '.join(SECTIONS)}")
        return nothing
    count, sound, of = SECTIONS[name]
    sizes, nsm = card.reals(9, count, "DIM", REQUIRED), card.real(9 + count, "NSM", 0.0)
    if not sound(*sizes):
        card.fault(f"dimensions {', '.join(f'{size:g}' for size in sizes)} do not make a valid {name}")
        return nothing
    found = of(*sizes)
    row, stations = 10 + count, {}
    while card.name == "PBEAML" and row <= len(card):
        place, given = card.real(row + 1, "X/XB", 1.0), [card.real(row + 2 + k, "DIM", None) for k in range(count)]
        there = [a if b is None else b for a, b in zip(sizes, given, strict=True)]
        if not sound(*there) or not 0 <= place <= 1:
            card.fault(f"the station at X/XB = {place:g} is not a valid {name} on the beam")
            return nothing
        stations[place] = [*_numbers(of(*there)), card.real(row + 2 + count, "NSM", nsm)]
        row += 3 + count
    if card.name == "PBARL":
        card.refuse_fields("what follows NSM", *range(row, len(card) + 1))
    elif not found.is_centred:
        card.fault(f"a CBEAM of the section {name} has its shear centre off its centroid, which is not supported")
    require_positive(card, nonnegative={"NSM": nsm})
    deck.remark(f"{card.name} {name}: torsion and shear factors by beam theory, Nastran's may differ")
    area, I1, I2, J, nsm = mean_along(card, {0.0: [*_numbers(found), nsm], **stations}, deck)
    return BeamProperty(area, I1, I2, J, nsm, found.shear, mid)


def _numbers(shape):
    return [shape.area, shape.inertia_1, shape.inertia_2, shape.torsion]


def tube(card: Card, deck: DeckContext) -> BeamProperty:
    """PTUBE; of one whose diameter changes the mean along it."""
    mid, outer, t, nsm = (
        deck.material(card, 2, "MID"),
        card.real(3, "OD"),
        card.real(4, "T", 0.0),
        card.real(5, "NSM", 0.0),
    )
    other = card.real(6, "OD2", outer)
    require_positive(card, OD=outer, OD2=other, nonnegative={"T": t, "NSM": nsm})
    if not 2 * t <= min(outer, other):
        card.fault("T must not be more than half of OD")
    areas, torsions = [], []
    for d in (outer, other):
        inner = d - 2 * t if t else 0.0
        areas.append(np.pi / 4 * (d**2 - inner**2))
        torsions.append(np.pi / 32 * (d**4 - inner**4))
    if other != outer:
        deck.remark_once(f"PTUBE {card.text(1)} of a diameter that changes has its mean along the tube")
    return BeamProperty(sum(areas) / 2, 0.0, 0.0, sum(torsions) / 2, nsm, None, mid)


PROPERTIES: dict[str, Callable[[Card, DeckContext], Any]] = {
    **dict.fromkeys(("PBAR", "PBEAM", "PROD"), section),
    **dict.fromkeys(("PBARL", "PBEAML"), section_by_dimensions),
    **dict(PSHELL=plate, PCOMP=laminate, PCOMPG=laminate, PSOLID=solid),
    **dict(
        PTUBE=tube, PSHEAR=panel, PVISC=line_damper, PBUSH=bush, PELAS=scalar, PMASS=scalar_mass, PDAMP=scalar_damper
    ),
}
