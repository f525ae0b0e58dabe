"""Causal strokes inside a force element, by the sequential assignment procedure.

The mechanism gives the flow of the port, sources their effort or flow, stores answer by their states where the
junctions let them, resistors take what is left.
"""

from collections.abc import Sequence

from ..forces._element_bonds import PORT, kind_of
from ._elements import PowerBond

#: Kinds of elements that choose the causality of their bond, in their order; True where an effort acts on the element
#: itself.
_CHOICES = (("Se", False), ("Sf", True), ("C", False), ("I", True), ("port", False), ("R", False))


def inner_strokes(bonds: list[PowerBond], ports: Sequence[str] = (PORT,)) -> dict[PowerBond, str]:
    """End, "tail" or "head", of every bond on which its effort acts.  Args: ports: junctions that give their flow."""
    acts: dict = {}
    for bond in bonds:
        port = next((end for end in (bond.tail, bond.head) if end in ports), None)
        if port is not None:
            acts[bond] = port
    _propagate(bonds, acts, ports)
    for kind, on_itself in _CHOICES:
        for bond in bonds:
            mine = next((end for end in (bond.tail, bond.head) if kind_of(end) == kind), None)
            if mine is not None and bond not in acts:
                acts[bond] = mine if on_itself else _other(bond, mine)
                _propagate(bonds, acts, ports)
    return {bond: "head" if acts.get(bond, bond.head) == bond.head else "tail" for bond in bonds}


def _other(bond, end):
    return bond.head if end == bond.tail else bond.tail


def _propagate(bonds, acts, ports):
    """Strokes that junctions, transformers and gyrators demand, until there are no more."""
    elements = dict.fromkeys(end for bond in bonds for end in (bond.tail, bond.head) if end not in ports)
    changed = True
    while changed:
        changed = False
        for name in elements:
            for bond, end in _demands(name, [b for b in bonds if name in (b.tail, b.head)], acts):
                acts[bond], changed = end, True


def _demands(name, own, acts):
    """Pairs (bond, end) that follow at one element from the strokes of its other bonds."""
    kind, free = kind_of(name), [bond for bond in own if bond not in acts]
    if not free or kind not in ("1", "0", "TF", "MTF", "GY"):
        return []
    here = [bond for bond in own if acts.get(bond) == name]
    away = [bond for bond in own if bond in acts and acts[bond] != name]
    if kind == "1":  # one neighbour gives the flow, on which the effort acts
        return _after_one(name, free, away, giver_is_here=False)
    if kind == "0":  # one neighbour gives the effort
        return _after_one(name, free, here, giver_is_here=True)
    same = kind == "GY"
    return [(free[0], name if bool(here) == same else _other(free[0], name))] if here or away else []


def _after_one(name, free, givers, giver_is_here):
    """The bonds of a junction where one gives what is common to all: the others once it is known, or the last one."""
    end = lambda bond, is_here: name if is_here else _other(bond, name)
    if givers:
        return [(bond, end(bond, not giver_is_here)) for bond in free]
    return [(free[0], end(free[0], giver_is_here))] if len(free) == 1 else []
