"""Properties of bushings and of scalar springs, masses and dampers."""

import equinox as eqx
from jaxtyping import Array, Float

from ...elements._base import as_optional_real, as_real
from ...typing import Convertible
from ._cards import Card, require_positive
from ._context import DeckContext
from ._groups import LineDamperProperty

Scalar = Convertible[Float[Array, ""]]


class BushingProperty(eqx.Module):
    """PBUSH.

    Attributes:
        stiffness: (6,) [N/m, N m/rad]; damping: (6,) [N s/m, N m s/rad], or None.
    """

    stiffness: Convertible[Float[Array, "6"]] = eqx.field(converter=as_real)
    damping: Convertible[Float[Array, "6"] | None] = eqx.field(converter=as_optional_real)


class SpringProperty(eqx.Module):
    """PELAS.

    Attributes:
        stiffness: [N/m or N m/rad].
    """

    stiffness: Scalar = eqx.field(converter=as_real)


class MassProperty(eqx.Module):
    """PMASS.

    Attributes:
        mass: [kg or kg m^2].
    """

    mass: Scalar = eqx.field(converter=as_real)


class DamperProperty(eqx.Module):
    """PDAMP.

    Attributes:
        damping: [N s/m or N m s/rad].
    """

    damping: Scalar = eqx.field(converter=as_real)


def bush(card: Card, deck: DeckContext) -> BushingProperty:
    """PBUSH with K and B; GE and stress recovery are noted."""
    values = {"K": [0.0] * 6, "B": [0.0] * 6}
    for row in range(2, max(len(card), 2) + 1, 8):
        what = card.text(row).upper()
        if what in values:
            values[what] = card.reals(row + 1, 6, what)
        elif what in ("GE", "RCV"):
            deck.note(f"{what} of PBUSH")
        elif what:
            card.fault(f"{what[:16]!r} is not supported: only K, B, GE, RCV are")
    require_positive(card, nonnegative={f"{n}{k + 1}": v for n, row in values.items() for k, v in enumerate(row)})
    return BushingProperty(values["K"], values["B"] if any(values["B"]) else None)


def line_damper(card: Card, deck: DeckContext) -> LineDamperProperty:
    """One damper of a PVISC."""
    values = {"CE": card.real(2, "CE", 0.0), "CR": card.real(3, "CR", 0.0)}
    require_positive(card, nonnegative=values)
    return LineDamperProperty(list(values.values()))


def scalar(card: Card, deck: DeckContext) -> SpringProperty:
    """PELAS."""
    if card.real(3, "GE", 0.0):
        deck.note("structural damping GE of PELAS")
    return SpringProperty(card.real(2, "K"))


def scalar_mass(card: Card, deck: DeckContext) -> MassProperty:
    """One mass of a PMASS."""
    require_positive(card, nonnegative={"M": card.real(2, "M")})
    return MassProperty(card.real(2, "M"))


def scalar_damper(card: Card, deck: DeckContext) -> DamperProperty:
    """One damper of a PDAMP."""
    require_positive(card, nonnegative={"B": card.real(2, "B")})
    return DamperProperty(card.real(2, "B"))
