"""Properties of shells: PSHELL, PCOMP, PCOMPG."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import Laminate, ShellSection
from ...elements._base import as_optional_real, as_real
from ...elements._shell_section import strain_rotation
from ...typing import Convertible
from ._cards import REQUIRED, Card, require_positive
from ._context import DeckContext

#: Shear factor of plates without transverse shear: what is left of it is below a thousandth of what 5/6 gives.
_NO_SHEAR = 1000.0
_PLANE = ("MAT1", "MAT2", "MAT8")
Scalar = Convertible[Float[Array, ""]]


class ShellProperty(eqx.Module):
    """PSHELL.

    Attributes:
        thickness [m]; area_mass: NSM [kg/m^2].
        shear_factor: TS/T, of the transverse shear; a thousand where MID3 is blank: there is no shear to speak of.
        bending_factor: 12 I / T^3.
        material: of the membrane, "MAT1 3"; bending, across, coupling: those of MID2, MID3, MID4; "" where blank.
    """

    thickness: Scalar = eqx.field(converter=as_real)
    area_mass: Scalar = eqx.field(converter=as_real)
    shear_factor: Scalar = eqx.field(converter=as_real)
    bending_factor: Scalar = eqx.field(converter=as_real)
    material: str = eqx.field(static=True)
    bending: str = eqx.field(static=True)
    across: str = eqx.field(static=True)
    coupling: str = eqx.field(static=True)
    is_plain: bool = eqx.field(static=True)

    @property
    def is_thin(self) -> bool:
        """True if there is no transverse shear."""
        return not self.across

    @property
    def bends(self) -> bool:
        """False for a membrane alone."""
        return bool(self.bending)

    def section(self, materials: dict, mass: Array) -> ShellSection:
        """Stiffness and mass per area, times `mass` (PARAM WTMASS)."""
        t, zero = self.thickness, jnp.zeros((3, 3), self.thickness.dtype)
        own = lambda name: materials[name].plane if name else zero
        stuff = materials[self.material or self.bending]
        shear = materials[self.across or self.bending].transverse if self.bending else zero[:2, :2]
        area_mass = (stuff.density * t + self.area_mass) * mass
        return ShellSection(
            t * own(self.material),
            t**3 / 12 * self.bending_factor * own(self.bending),
            self.shear_factor * t * shear,
            -(t**2) * own(self.coupling) if self.coupling else None,  # curvatures are of the opposite sign there
            area_mass,
            area_mass * t**2 / 12,
        )

    def outline(self, materials: dict) -> ShellSection:
        """A section of ones where there is membrane, bending and mass."""
        is_stiff = lambda name: bool(name) and bool(np.any(materials[name].plane))
        density = float(materials[self.material or self.bending].density)
        mass = density > 0 or float(self.area_mass) > 0
        return _section_of_ones(is_stiff(self.material), is_stiff(self.bending), mass)

    def thermal_forces(self, materials: dict, temperature: Array, thickness: Array) -> Float[Array, "6"]:
        """Forces Nxx ... Mxy per length that a temperature makes where nothing moves, in the axes of the material."""
        if not self.material:
            return jnp.zeros(6, self.thickness.dtype)
        stuff = materials[self.material]
        warm = lambda one: one.plane @ one.plane_expansion * (temperature - stuff.reference)
        N = thickness * warm(stuff)
        M = -(thickness**2) * warm(materials[self.coupling]) if self.coupling else 0.0 * N
        return jnp.concatenate([N, M])


class LaminateProperty(eqx.Module):
    """PCOMP or PCOMPG.

    Attributes:
        thickness: (plies,) from the face -z [m]; angle: (plies,) [degrees]; bottom: Z0 [m], None for half of the
            thickness below the nodes; area_mass: NSM [kg/m^2].
        ply_materials: of each ply, "MAT8 3"; option: LAM, "" for all effects, "MEM", "BEND", "SMEAR".
        plies: numbers of the plies; reference: TREF, temperature of all plies without thermal strain.
    """

    thickness: Convertible[Float[Array, " plies"]] = eqx.field(converter=as_real)
    angle: Convertible[Float[Array, " plies"]] = eqx.field(converter=as_real)
    bottom: Convertible[Float[Array, ""] | None] = eqx.field(converter=as_optional_real)
    area_mass: Scalar = eqx.field(converter=as_real)
    ply_materials: tuple[str, ...] = eqx.field(static=True)
    plies: tuple[int, ...] = eqx.field(static=True)
    option: str = eqx.field(static=True)
    reference: Scalar = eqx.field(converter=as_real, default=0.0)

    is_thin = False
    is_plain = False

    @property
    def bends(self) -> bool:
        """False for a membrane alone."""
        return self.option != "MEM"

    def laminate(self, materials: dict) -> Laminate:
        """The layers with the numbers of their materials."""
        stuff = [materials[name] for name in self.ply_materials]
        return Laminate(
            self.thickness,
            jnp.deg2rad(self.angle),
            jnp.stack([one.plane for one in stuff]),
            jnp.stack([one.transverse for one in stuff]),
            jnp.stack([one.density for one in stuff]),
            self.bottom,
            self.area_mass,
        )

    def section(self, materials: dict, mass: Array) -> ShellSection:
        """Stiffness and mass per area, times `mass` (PARAM WTMASS)."""
        made = self.laminate(materials).section()
        A, B, D, S = made.membrane, made.coupling, made.bending, made.shear
        if self.option == "SMEAR":
            B, D = None, A * jnp.sum(self.thickness) ** 2 / 12
        if self.option == "MEM":
            B, D, S = None, 0.0 * D, 0.0 * S
        if self.option == "BEND":
            A, B = 0.0 * A, None
        return ShellSection(A, D, S, B, made.area_mass * mass, made.turning_mass * mass)

    def outline(self, materials: dict) -> ShellSection:
        """A section of ones where there is membrane, bending and mass."""
        heavy = any(float(materials[name].density) > 0 for name in set(self.ply_materials))
        return _section_of_ones(self.option != "BEND", self.bends, heavy or float(self.area_mass) > 0)

    def ply_strains(self, materials: dict, temperature: Array) -> Float[Array, "plies 3"]:
        """Strains 11 22 12 of plies that are free at a temperature."""
        strains = jnp.stack([materials[name].plane_expansion for name in self.ply_materials])
        return strains * (temperature - self.reference)

    def thermal_forces(self, materials: dict, temperature: Array, thickness: Any = None) -> Float[Array, "6"]:
        """Forces Nxx ... Mxy per length that a temperature makes where nothing moves, in the axes of the laminate."""
        made = self.laminate(materials)
        R = jnp.stack([strain_rotation(angle) for angle in made.angle])
        stress = jnp.einsum("pba,pbc,pc->pa", R, made.moduli, self.ply_strains(materials, temperature))
        z = made.heights
        N, M = self.thickness @ stress, (z[1:] ** 2 - z[:-1] ** 2) / 2 @ stress
        return jnp.concatenate([N * float(self.option != "BEND"), M * float(self.option in ("", "BEND"))])


def _section_of_ones(membrane: bool, bending: bool, mass: bool) -> ShellSection:
    return ShellSection(membrane * np.eye(3), bending * np.eye(3), bending * np.eye(2), None, float(mass), 0.0)


def plate(card: Card, deck: DeckContext) -> ShellProperty:
    """PSHELL."""
    of = lambda k, name: deck.material(card, k, name, _PLANE, "")
    membrane, bending, across, coupling = of(2, "MID1"), of(4, "MID2"), of(6, "MID3"), of(11, "MID4")
    if card.text(4) == "-1":
        card.fault("plane strain, MID2 = -1, is not supported")
    if not membrane and not bending:
        card.fault("MID1 or MID2 must be given")
    t, nsm = card.real(3, "T"), card.real(8, "NSM", 0.0)
    require_positive(card, T=t, nonnegative={"NSM": nsm})
    ratio, factor = card.real(5, "12I/T^3", 1.0), card.real(7, "TS/T", 5 / 6)
    require_positive(card, nonnegative={}, **{"12I/T^3": ratio, "TS/T": factor})
    plain = membrane == bending and across in ("", membrane) and not coupling and ratio == 1
    plain = plain and membrane.startswith("MAT1")
    shear_factor = factor if across else _NO_SHEAR
    return ShellProperty(t, nsm, shear_factor, ratio, membrane, bending, across, coupling, plain)


def laminate(card: Card, deck: DeckContext) -> LaminateProperty:
    """PCOMP, whose plies have four fields each, or PCOMPG, where a number of the ply stands before them, in rows."""
    numbered = card.name == "PCOMPG"
    option = card.text(8).upper()
    if option not in ("", "SYM", "MEM", "BEND", "SMEAR"):
        card.fault(f"LAM {option[:16]!r} is not supported: SYM, MEM, BEND, SMEAR are")
    step, first = (8, 1) if numbered else (4, 0)
    rows = [k for k in range(9, len(card) + 1, step) if any(card.text(k + j) for j in range(4 + first))]
    plies, material, thickness = [], "", REQUIRED
    for number, k in enumerate(rows, start=1):
        if numbered:
            number = card.integer(k, "GPLYID")
        material = deck.material(card, k + first, "MID", _PLANE, material or REQUIRED)
        thickness = card.real(k + first + 1, "T", thickness)
        plies.append((number, material, thickness, card.real(k + first + 2, "THETA", 0.0)))
    if not plies:
        card.fault("it has no ply")
        plies = [(1, "", 1.0, 0.0)]
    if not all(ply[2] > 0 for ply in plies):
        card.fault("T of a ply must be positive")
    if option == "SYM":
        plies += plies[::-1]
    bottom, nsm = card.real(2, "Z0", None), card.real(3, "NSM", 0.0)
    require_positive(card, nonnegative={"NSM": nsm})
    if card.real(7, "GE", 0.0):
        deck.note(f"structural damping GE of {card.name}")
    numbers, names, sizes, angles = zip(*plies, strict=True)
    option = "" if option == "SYM" else option
    return LaminateProperty(
        np.array(sizes), np.array(angles), bottom, nsm, names, numbers, option, card.real(6, "TREF", 0.0)
    )
