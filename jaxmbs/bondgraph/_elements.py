"""Elements and bonds of a vector bond graph; all static and hashable."""

from dataclasses import dataclass

#: 1: common flow, 0: common effort, MTF/TF: `f_out = G f_in`, `e_in = G^T e_out`; GY inside of an element: the effort
#: on one side follows the flow on the other; one-ports: I, C, R, Se, Sf, the paper's gyristor GR, `e = GR f` towards
#: its junction, and a port to another element.
KINDS = ("1", "0", "TF", "MTF", "GY", "I", "C", "R", "Se", "Sf", "GR", "port")
JUNCTIONS, TRANSFORMERS = ("1", "0"), ("TF", "MTF", "GY")


@dataclass(frozen=True)
class Element:
    """A node of the graph.

    Attributes:
        name: unique, such as "G_t:crank" or "C:spring"; `kind`: one of `KINDS`.
        label: what the picture shows beside the kind: a modulus, a parameter or the flow of a junction.
        size: components of its flow (of a transformer: of the flow away from the roots).
        domain: "mechanical", or "electric" or "fluid" inside of a force element.
        within: name of the force element that it is a part of; empty for the others.
    """

    name: str
    kind: str
    label: str
    size: int
    domain: str = "mechanical"
    within: str = ""

    @property
    def is_port(self) -> bool:
        """True if the element is a one-port: it stores, dissipates or supplies power."""
        return self.kind not in JUNCTIONS + TRANSFORMERS

    @property
    def is_inertia(self) -> bool:
        """True if it holds a momentum of the mechanism."""
        return self.kind == "I" and not self.within


@dataclass(frozen=True)
class PowerBond:
    """Power flows from `tail` to `head` when positive; the half arrow is at the head.

    The effort acts on the element at the causal `stroke` ("tail", "head"; "" where none is assigned), which
    answers with the flow.  The domain is that of `Element`.  A bond whose ends give different sizes carries the flow
    of `size` components.
    """

    tail: str
    head: str
    size: int
    stroke: str = ""
    domain: str = "mechanical"

    @property
    def name(self) -> str:
        return f"{self.tail} -> {self.head}"


@dataclass(frozen=True)
class Storage:
    """Causality of one port of an inertia: how many components of its momentum are states of their own.

    `dependent` components follow from the states of other inertias or from drives (derivative causality); `idle`
    ones do not move at all, as out of the plane of a planar mechanism.
    """

    name: str
    junction: str
    independent: int
    dependent: int
    idle: int
