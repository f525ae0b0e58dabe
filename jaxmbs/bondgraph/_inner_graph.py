"""The graph inside force elements whose laws declare their bonds, as a part of the graph of the mechanism.

Its elements are named by the force element: "I:motor.inductance".  Behind the junction of the element's flow,
"rate:motor", a law between two points has the direction of its line as a transformer, "n:boom", and the junction of
the rate of its distance, "1:boom.port".
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..forces._element_bonds import PORT, ElementBonds, ends
from ..forces._law_at import LawAt
from ..kinematics._element_flows import element_flows
from ..math._linalg import direction
from ..model._system import System
from ..named_arrays import element_of
from ..signal_flow._acting_laws import acting_laws
from ._elements import PowerBond


def group_bonds(group, law, displacement, flow, t) -> ElementBonds:
    """Bonds by name of all elements of a group, each with leading axis (n,); law: at the instant."""

    def of_one(law, displacement, flow):
        law, arguments = group.port.law_and_arguments(law, displacement, flow)
        return law.bonds(*arguments, t)

    return jax.vmap(of_one)(law, displacement, flow)


def inner_bonds(system: System, group, i: int, joined=frozenset()) -> list[PowerBond]:
    """Bonds inside element i of a group, in an order from its port outwards; none where the law declares none.

    Args: joined: names in the graph of the ports in whose place a circuit has its bonds.
    """
    if not group.law.has_bonds:
        return []
    law = element_of(group.law, i)
    if group.internal:
        law = LawAt(law, {name: jnp.zeros(shape) for name, shape, _ in group.internal})
    top = system.topology
    still = group.port.still(top.num_coordinates, top.num_velocities)
    shapes = jax.eval_shape(lambda: law.bonds(*still, jnp.zeros(())))
    found = [
        PowerBond(*ends(name), max(bond.effort.size, bond.flow.size), domain=bond.domain)
        for name, bond in shapes.items()
        if not {inner_name(group, i, end) for end in ends(name)} & joined
    ]
    order = {name: k for k, name in enumerate(from_port(found))}
    return sorted(found, key=lambda bond: sorted((order[bond.tail], order[bond.head]), reverse=True))


def from_port(bonds, ports=(PORT,)) -> list[str]:
    """Elements of the graph inside an element from its ports outwards; those without a way to it come last."""
    found, rest = list(ports), [end for bond in bonds for end in (bond.tail, bond.head)]
    for name in found:
        for bond in bonds:
            found += [end for end in (bond.tail, bond.head) if name in (bond.tail, bond.head) and end not in found]
    return found + [name for name in dict.fromkeys(rest) if name not in found]


def inner_name(group, i: int, element: str) -> str:
    """Name in the graph of the mechanism of an element inside element i of a group."""
    name = group.names[i]
    if element == PORT:
        return f"1:{name}.port" if group.port.is_on_line else f"rate:{name}"
    kind, _, label = element.partition(":")
    return f"{kind}:{name}.{label}"


class InnerValues(NamedTuple):
    """Values inside all elements of a system: (effort, flow), each (size,), by bond; flows by junction; moduli by
    transformer."""

    bonds: dict
    flow: dict
    modulus: dict


def inner_values(system: System, at, joined=frozenset()) -> InnerValues:
    """Values inside the elements of a system at a `VelocityKinematics`.

    Args: joined: as of `inner_bonds`.
    """
    found = InnerValues({}, {}, {})
    for group, law in acting_laws(system, at):
        if not group.law.has_bonds:
            continue
        _, displacement, flow = element_flows(system, group, at, at.V, at.u)
        bonds = group_bonds(group, law, displacement, flow, at.t)
        for i, name in enumerate(group.names):
            for bond in bonds:
                tail, head = (inner_name(group, i, end) for end in ends(bond))
                if not {tail, head} & joined:
                    found.bonds[f"{tail} -> {head}"] = vectors(bonds[bond].effort[i], bonds[bond].flow[i])
            if group.port.is_on_line:
                n = direction(displacement[0][i])
                found.modulus[f"n:{name}"], found.flow[f"1:{name}.port"] = n[None], (n @ flow[i])[None]
    return found


def vectors(effort: Any, flow: Any):
    """Effort and flow of equal sizes (n,)."""
    effort, flow = jnp.broadcast_arrays(effort, flow)
    return effort.reshape(-1), flow.reshape(-1)
