"""Materials and properties: the numbers of a deck that many elements share."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ...elements._base import as_optional_real, as_real
from ...typing import Convertible
from ._cards import REQUIRED, Card, require_positive
from ._point_properties import bush, scalar, scalar_damper, scalar_mass
from ._sections import SECTIONS

#: Shear factor of plates without transverse shear: what is left of it is below a thousandth of what 5/6 gives.
_NO_SHEAR = 1000.0
Scalar = Convertible[Float[Array, ""]]
OptionalScalar = Convertible[Float[Array, ""] | None]


class Material(eqx.Module):
    """MAT1, two of E, G, nu or all three.

    Attributes:
        young [Pa]; shear_modulus [Pa] and poisson, each as the card has it or None; density, in units that
            PARAM WTMASS makes masses of.
    """

    young: Scalar = eqx.field(converter=as_real)
    shear_modulus: OptionalScalar = eqx.field(converter=as_optional_real)
    poisson: OptionalScalar = eqx.field(converter=as_optional_real)
    density: Scalar = eqx.field(converter=as_real)

    @property
    def shear(self) -> Array:
        """G [Pa]: the card's, or E / 2(1 + nu)."""
        if self.shear_modulus is not None:
            return self.shear_modulus
        return 0.0 * self.young if self.poisson is None else self.young / (2.0 * (1.0 + self.poisson))

    @property
    def contraction(self) -> Array:
        """Poisson's ratio: the card's, or E / 2G - 1."""
        if self.poisson is not None:
            return self.poisson
        return 0.0 * self.young if self.shear_modulus is None else self.young / (2.0 * self.shear_modulus) - 1.0


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


class ShellProperty(eqx.Module):
    """PSHELL, homogeneous.

    Attributes:
        thickness [m]; area_mass: NSM [kg/m^2].
        shear_factor: TS/T, of the transverse shear; a thousand where MID3 is blank: there is no shear to speak of.
        material: name, "MAT1 3".
    """

    thickness: Scalar = eqx.field(converter=as_real)
    area_mass: Scalar = eqx.field(converter=as_real)
    shear_factor: Scalar = eqx.field(converter=as_real)
    is_thin: bool = eqx.field(static=True)
    material: str = eqx.field(static=True)


class SolidProperty(eqx.Module):
    """PSOLID: no number of its own.

    Attributes:
        material: name, "MAT1 3".
    """

    material: str = eqx.field(static=True)


def material(card: Card, note: Callable[[str], None]) -> Material:
    """MAT1."""
    E, G, nu = (card.real(k, name, None) for k, name in ((2, "E"), (3, "G"), (4, "NU")))
    density = card.real(5, "RHO", 0.0)
    if E is None and G is not None:
        E = 2.0 * G * (1.0 + (nu or 0.0))
    if E is None:
        card.fault("E is missing")
        E = 1.0
    require_positive(card, E=E, nonnegative={"G": G or 0.0, "RHO": density})
    ratio = nu if nu is not None else E / (2.0 * G) - 1.0 if G else 0.0
    if not -1.0 < ratio < 0.5:
        card.fault(f"Poisson's ratio {ratio:g} does not lie between -1 and 1/2")
    if card.real(8, "GE", 0.0):
        note("structural damping GE of MAT1")
    return Material(E, G, nu, density)


def section(card: Card, note: Callable[[str], None]) -> BeamProperty:
    """PBAR, PBEAM of one section along its length, or PROD without torsion."""
    mid = f"MAT1 {card.integer(2, 'MID')}"
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


def plate(card: Card, note: Callable[[str], None]) -> ShellProperty:
    """PSHELL of one material."""
    mid, bending, across = card.integer(2, "MID1"), card.integer(4, "MID2", 0), card.integer(6, "MID3", 0)
    t, nsm = card.real(3, "T"), card.real(8, "NSM", 0.0)
    if bending != mid:
        card.fault("MID2 must be MID1: only plates of one material with bending are supported")
    if across not in (0, mid):
        card.fault("MID3 must be MID1 or blank")
    card.refuse_fields("12I/T^3", 5, harmless=(1.0,))
    card.refuse_fields("the material MID4 that couples", 11)
    require_positive(card, T=t, nonnegative={"NSM": nsm})
    factor = card.real(7, "TS/T", 5 / 6)
    if not factor > 0:
        card.fault("TS/T must be positive")
    return ShellProperty(t, nsm, factor if across else _NO_SHEAR, not across, f"MAT1 {mid}")


def solid(card: Card, note: Callable[[str], None]) -> SolidProperty:
    """PSOLID; how it integrates (IN, ISOP) is noted."""
    if any(card.text(k) for k in (4, 6)):
        note("integration IN, ISOP of PSOLID")
    if card.text(7).upper() not in ("", "SMECH"):
        card.fault(f"FCTN {card.text(7)[:16]!r} is not supported")
    return SolidProperty(f"MAT1 {card.integer(2, 'MID')}")


def section_by_dimensions(card: Card, note: Callable[[str], None]) -> BeamProperty:
    """PBARL, or PBEAML of one section along its length whose shear centre is its centroid."""
    name, mid = card.text(4).upper(), f"MAT1 {card.integer(2, 'MID')}"
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
    note(f"{card.name} {name}: torsion and shear factors by beam theory, Nastran's may differ")
    return BeamProperty(found.area, found.inertia_1, found.inertia_2, found.torsion, nsm, found.shear, mid)


READ: dict[str, Callable[..., Any]] = {
    **dict(
        MAT1=material,
        PBAR=section,
        PBEAM=section,
        PROD=section,
        PBARL=section_by_dimensions,
        PBEAML=section_by_dimensions,
    ),
    **dict(PSHELL=plate, PSOLID=solid, PBUSH=bush, PELAS=scalar),
    **dict(PMASS=scalar_mass, PDAMP=scalar_damper),
}
