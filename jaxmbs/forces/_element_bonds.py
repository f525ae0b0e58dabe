"""The bond graph inside a force element: its sources, stores and resistors, and the power of every bond.

A law declares `bonds(x, v, s, t)`, an `ElementBond` by name "tail -> head", the half arrow at the head, such as
"Se:voltage -> 1:current".  The kind of an element of the graph stands before its colon: Se and Sf supply, C and I
store, R makes heat, 1, 0, TF, MTF and GY conserve.  "1:port" is the 1-junction of the law's own flow, at which the
effort on the mechanism has the opposite sign; "port:..." is a port to another element, with which it exchanges power.
Source: S2 (27)-(28), (56)-(67).
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..runtime import as_array
from ..tables import fields_repr
from ..typing import Convertible, Scalar

#: The 1-junction of the flow of the element at its mechanical port.
PORT = "1:port"
#: Kinds of elements of a graph by what they do with the power that they take.
STORES, SOURCES, RESISTORS, EXCHANGE = ("C", "I"), ("Se", "Sf"), ("R",), ("port",)
CONSERVING = ("1", "0", "TF", "MTF", "GY")
DOMAINS = ("mechanical", "electric", "fluid")


class ElementBond(eqx.Module):
    """Effort and flow of a bond inside an element, () or (n,) each; their product is power [W].

    Attributes:
        effort: force, moment, voltage or pressure [N, N m, V or Pa].
        flow: velocity, current or volume flow [m/s, rad/s, A or m^3/s].
        domain: "mechanical", "electric" or "fluid" (static).
    """

    effort: Convertible[Float[Array, "..."]] = eqx.field(converter=as_array)
    flow: Convertible[Float[Array, "..."]] = eqx.field(converter=as_array)
    domain: str = eqx.field(static=True, default="mechanical")

    __repr__ = fields_repr

    @property
    def power(self) -> Scalar:
        """Power [W] along the half arrow."""
        return jnp.sum(self.effort * self.flow)


#: Bonds of one element by name "tail -> head".
ElementBonds = dict[str, ElementBond]


class BondSums(NamedTuple):
    """Powers [W] of an element by its bonds: heat of resistors, power supplied by sources and exchanged with other
    elements (into this one), and what its stores take."""

    dissipated: Any
    supplied: Any
    exchanged: Any
    stored: Any


def ends(name: str) -> tuple[str, str]:
    """Tail and head of a bond.  Raises: ValueError for a name that is not "tail -> head"."""
    parts = name.split(" -> ")
    if len(parts) != 2 or not all(":" in part and part.split(":")[0] in _KINDS for part in parts):
        known = ", ".join(_KINDS)
        raise ValueError(f'bond {name!r}: write "kind:name -> kind:name" with kinds among {known}')
    return parts[0], parts[1]


_KINDS = (*CONSERVING, *STORES, *SOURCES, *RESISTORS, *EXCHANGE)


def kind_of(element: str) -> str:
    """Kind of an element of the graph: "Se" of "Se:voltage"."""
    return element.partition(":")[0]


def power_into(bonds: ElementBonds, kinds: tuple[str, ...]) -> Scalar:
    """Power [W] that the elements of some kinds take."""
    total = jnp.zeros((), jnp.result_type(*(bond.flow for bond in bonds.values()), float) if bonds else float)
    for name, bond in bonds.items():
        tail, head = ends(name)
        sign = (kind_of(head) in kinds) - (kind_of(tail) in kinds)
        total = total + sign * bond.power if sign else total
    return total


def bond_sums(bonds: ElementBonds) -> BondSums:
    """Powers of an element by its bonds."""
    return BondSums(
        power_into(bonds, RESISTORS),
        -power_into(bonds, SOURCES),
        -power_into(bonds, EXCHANGE),
        power_into(bonds, STORES),
    )


def electric(effort: Any, flow: Any) -> ElementBond:
    """Bond of a voltage [V] and a current [A]."""
    return ElementBond(effort, flow, "electric")


def fluid(effort: Any, flow: Any) -> ElementBond:
    """Bond of a pressure [Pa] and a volume flow [m^3/s]."""
    return ElementBond(effort, flow, "fluid")
