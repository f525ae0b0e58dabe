"""Materials of a deck: MAT1, MAT2, MAT8, MAT9."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import orthotropic
from ...elements._base import as_optional_real, as_real
from ...elements._shared_matrices import plane_stress
from ...typing import Convertible
from ._cards import Card, require_positive
from ._context import DeckContext

Scalar = Convertible[Float[Array, ""]]
OptionalScalar = Convertible[Float[Array, ""] | None]
_STIFF = 1000.0  # transverse shear moduli that a MAT8 leaves blank, over G12: infinite ones in Nastran


class Material(eqx.Module):
    """MAT1, two of E, G, nu or all three.

    Attributes:
        young [Pa]; shear_modulus [Pa] and poisson, each as the card has it or None; density, in units that
            PARAM WTMASS makes masses of; expansion [1/K]; reference: temperature without thermal strain.
    """

    young: Scalar = eqx.field(converter=as_real)
    shear_modulus: OptionalScalar = eqx.field(converter=as_optional_real)
    poisson: OptionalScalar = eqx.field(converter=as_optional_real)
    density: Scalar = eqx.field(converter=as_real)
    expansion: Scalar = eqx.field(converter=as_real, default=0.0)
    reference: Scalar = eqx.field(converter=as_real, default=0.0)

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

    @property
    def plane(self) -> Float[Array, "3 3"]:
        """Plane stress elasticity [Pa]."""
        return plane_stress(self.young, self.contraction)

    @property
    def transverse(self) -> Float[Array, "2 2"]:
        """Moduli of transverse shear [Pa]."""
        return self.shear * jnp.eye(2, dtype=self.young.dtype)

    @property
    def plane_expansion(self) -> Float[Array, "3"]:
        """Strains xx yy xy per kelvin."""
        return self.expansion * jnp.asarray([1.0, 1.0, 0.0])


class PlaneMaterial(eqx.Module):
    """MAT2: `moduli` (3, 3) of plane stress [Pa]; as material of transverse shear its first two rows; density;
    `plane_expansion` (3,) xx yy xy [1/K]; reference temperature.
    """

    moduli: Convertible[Float[Array, "3 3"]] = eqx.field(converter=as_real)
    density: Scalar = eqx.field(converter=as_real)
    plane_expansion: Convertible[Float[Array, "3"]] = eqx.field(converter=as_real)
    reference: Scalar = eqx.field(converter=as_real, default=0.0)

    @property
    def plane(self) -> Float[Array, "3 3"]:
        """Plane stress elasticity [Pa]."""
        return self.moduli

    @property
    def transverse(self) -> Float[Array, "2 2"]:
        """Moduli of transverse shear [Pa], where this is the material MID3."""
        return self.moduli[:2, :2]


class PlyMaterial(eqx.Module):
    """MAT8, orthotropic in plane stress.

    Attributes:
        young: (2,) along and across the fibres [Pa]; poisson: nu12; shear_12 [Pa].
        shear_z: (2,) transverse moduli G1z, G2z [Pa]; where the card has none, a thousand times shear_12.
        density; expansion: (2,) [1/K]; reference: temperature without thermal strain.
        strengths: (5,) Xt, Xc, Yt, Yc, S of the card, zero where it has none; interaction: F12.
    """

    young: Convertible[Float[Array, "2"]] = eqx.field(converter=as_real)
    poisson: Scalar = eqx.field(converter=as_real)
    shear_12: Scalar = eqx.field(converter=as_real)
    shear_z: Convertible[Float[Array, "2"]] = eqx.field(converter=as_real)
    density: Scalar = eqx.field(converter=as_real)
    expansion: Convertible[Float[Array, "2"]] = eqx.field(converter=as_real)
    reference: Scalar = eqx.field(converter=as_real)
    strengths: Convertible[Float[Array, "5"]] = eqx.field(converter=as_real)
    interaction: Scalar = eqx.field(converter=as_real)

    @property
    def plane(self) -> Float[Array, "3 3"]:
        """Plane stress elasticity [Pa], in the axes of the fibres."""
        return orthotropic(self.young[0], self.young[1], self.poisson, self.shear_12)

    @property
    def transverse(self) -> Float[Array, "2 2"]:
        """Moduli of transverse shear [Pa]."""
        return jnp.diag(self.shear_z)

    @property
    def plane_expansion(self) -> Float[Array, "3"]:
        """Strains 11 22 12 per kelvin."""
        return jnp.concatenate([self.expansion, jnp.zeros(1, self.expansion.dtype)])


class SolidMaterial(eqx.Module):
    """MAT9: `moduli` (6, 6) [Pa] of stresses xx yy zz xy yz zx per strains; density; expansion (6,) [1/K];
    reference temperature.
    """

    moduli: Convertible[Float[Array, "6 6"]] = eqx.field(converter=as_real)
    density: Scalar = eqx.field(converter=as_real)
    expansion: Convertible[Float[Array, "6"]] = eqx.field(converter=as_real)
    reference: Scalar = eqx.field(converter=as_real, default=0.0)


def isotropic(card: Card, deck: DeckContext) -> Material:
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
        if not G:
            card.fault(f"Poisson's ratio {ratio:g} does not lie between -1 and 1/2")
        else:  # E and G of bars need not belong to one isotropic material
            deck.bars_only.add(f"MAT1 {card.integer(1, 'MID')}")
    if card.real(8, "GE", 0.0):
        deck.note("structural damping GE of MAT1")
    return Material(E, G, nu, density, card.real(6, "A", 0.0), card.real(7, "TREF", 0.0))


def plane(card: Card, deck: DeckContext) -> PlaneMaterial:
    """MAT2."""
    G11, G12, G13, G22, G23, G33 = card.reals(2, 6, "G")
    if card.real(13, "GE", 0.0):
        deck.note("structural damping GE of MAT2")
    moduli = [[G11, G12, G13], [G12, G22, G23], [G13, G23, G33]]
    return PlaneMaterial(moduli, card.real(8, "RHO", 0.0), card.reals(9, 3, "A"), card.real(12, "TREF", 0.0))


def ply(card: Card, deck: DeckContext) -> PlyMaterial:
    """MAT8."""
    E1, E2, nu, G12 = (card.real(k, name) for k, name in ((2, "E1"), (3, "E2"), (4, "NU12"), (5, "G12")))
    across = [card.real(k, name, 0.0) or _STIFF * G12 for k, name in ((6, "G1Z"), (7, "G2Z"))]
    density = card.real(8, "RHO", 0.0)
    require_positive(card, E1=E1, E2=E2, G12=G12, nonnegative={"RHO": density})
    if not nu**2 * E2 < E1:
        card.fault("NU12 must be smaller than the square root of E1 / E2")
    strengths = card.reals(12, 5, "X")
    strengths = [a if a or not k % 2 or k > 3 else strengths[k - 1] for k, a in enumerate(strengths)]
    if card.real(17, "GE", 0.0):
        deck.note("structural damping GE of MAT8")
    rest = card.reals(9, 2, "A"), card.real(11, "TREF", 0.0), strengths, card.real(18, "F12", 0.0)
    return PlyMaterial([E1, E2], nu, G12, across, density, *rest)


def solid(card: Card, deck: DeckContext) -> SolidMaterial:
    """MAT9."""
    upper, moduli = card.reals(2, 21, "G"), np.zeros((6, 6))
    moduli[np.triu_indices(6)] = upper
    moduli = moduli + np.triu(moduli, 1).T
    if not np.linalg.eigvalsh(moduli)[0] > 0:
        card.fault("its elasticity is not positive definite")
    if card.real(31, "GE", 0.0):
        deck.note("structural damping GE of MAT9")
    return SolidMaterial(moduli, card.real(23, "RHO", 0.0), card.reals(24, 6, "A"), card.real(30, "TREF", 0.0))


MATERIALS: dict[str, Callable[[Card, DeckContext], Any]] = dict(MAT1=isotropic, MAT2=plane, MAT8=ply, MAT9=solid)
