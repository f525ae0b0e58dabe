"""Properties: the numbers of a deck that many elements share."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ...elements._base import as_optional_real, as_real
from ...typing import Convertible
from ._cards import REQUIRED, Card, require_positive
from ._context import DeckContext
from ._point_properties import bush, scalar, scalar_damper, scalar_mass
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


def section(card: Card, deck: DeckContext) -> BeamProperty:
    """PBAR, PBEAM of one section along its length, or PROD without torsion."""
    mid = deck.material(card, 2, "MID")
    A, I1, I2 = (card.real(k, name, 0.0) for k, name in ((3, "A"), (4, "I1"), (5, "I2")))
    if card.name == "PROD":
        card.refuse_fields("torsion J", 4)
        require_positive(card, A=A, nonnegative={"NSM": card.real(6, "NSM", 0.0)})
        return BeamProperty(A, 0.0, 0.0, 0.0, card.real(6, "NSM", 0.0), None, mid)
    bar = card.name == "PBAR"
    J, nsm = card.real(6 if bar else 7, "J", 0.0), card.real(7 if bar else 8, "NSM", 0.0)
    card.refuse_fields("the product of inertia I12", 19 if bar else 6)
    K = _shear_of_bar(card) if bar else _shear_of_beam(card)
    require_positive(card, A=A, nonnegative=dict(I1=I1, I2=I2, J=J, NSM=nsm, K1=K[0], K2=K[1]))
    if (K[0] > 0) != (K[1] > 0):
        card.fault("K1 and K2 must both be given, or both be zero")
    return BeamProperty(A, I1, I2, J, nsm, K if K[0] > 0 and K[1] > 0 else None, mid)


def _shear_of_bar(card):
    return [card.real(k, name, 0.0) for k, name in ((17, "K1"), (18, "K2"))]


def _shear_of_beam(card):
    """K1 and K2 of a PBEAM, whose further stations must repeat the first one."""
    stations = ("YES", "YESA", "NO")
    first = [card.real(k, "A, I, J or NSM", None) for k in (3, 4, 5, 7, 8)]
    row = 9 if card.text(9).upper() in stations else 17  # the row of stress points may be left out
    while card.text(row).upper() in stations:
        step = 16 if card.text(row).upper() == "YES" else 8
        at = [card.real(row + k, "A, I, J or NSM", None) for k in (2, 3, 4, 6, 7)]
        if any(b is not None and b != (a or 0.0) for a, b in zip(first, at, strict=True)):
            card.fault("a section that changes along the beam is not supported")
        row += step
    card.refuse_fields("S1 and S2", row + 2, row + 3)
    card.refuse_fields("NSI and CW", *range(row + 4, row + 8))
    card.refuse_fields("M1, M2, N1, N2 beside the centroid", *range(row + 8, row + 16))
    return [card.real(row, "K1", 1.0), card.real(row + 1, "K2", 1.0)]


def solid(card: Card, deck: DeckContext) -> SolidProperty:
    """PSOLID; how it integrates (IN, ISOP) is noted."""
    if any(card.text(k) for k in (4, 6)):
        deck.note("integration IN, ISOP of PSOLID")
    if card.text(7).upper() not in ("", "SMECH"):
        card.fault(f"FCTN {card.text(7)[:16]!r} is not supported")
    name, frame = deck.material(card, 2, "MID", ("MAT1", "MAT9")), card.integer(3, "CORDM", 0, low=-1)
    if name.startswith("MAT9") and frame == -1:
        card.fault("axes of the element, CORDM = -1, are not supported with a MAT9")
    return SolidProperty(name, max(frame, 0) if name.startswith("MAT9") else 0)


def section_by_dimensions(card: Card, deck: DeckContext) -> BeamProperty:
    """PBARL, or PBEAML of one section along its length whose shear centre is its centroid."""
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
    row = 10 + count
    while card.name == "PBEAML" and row <= len(card):
        again = [card.real(k, "DIM or NSM", None) for k in range(row + 2, row + 3 + count)]
        if any(b is not None and b != a for a, b in zip([*sizes, nsm], again, strict=True)):
            card.fault("a section that changes along the beam is not supported")
        row += 3 + count
    if card.name == "PBARL":
        card.refuse_fields("what follows NSM", *range(row, len(card) + 1))
    elif not found.is_centred:
        card.fault(f"a CBEAM of the section {name} has its shear centre off its centroid, which is not supported")
    require_positive(card, nonnegative={"NSM": nsm})
    deck.note(f"{card.name} {name}: torsion and shear factors by beam theory, Nastran's may differ")
    return BeamProperty(found.area, found.inertia_1, found.inertia_2, found.torsion, nsm, found.shear, mid)


PROPERTIES: dict[str, Callable[[Card, DeckContext], Any]] = {
    **dict.fromkeys(("PBAR", "PBEAM", "PROD"), section),
    **dict.fromkeys(("PBARL", "PBEAML"), section_by_dimensions),
    **dict(PSHELL=plate, PCOMP=laminate, PCOMPG=laminate, PSOLID=solid),
    **dict(PBUSH=bush, PELAS=scalar, PMASS=scalar_mass, PDAMP=scalar_damper),
}
