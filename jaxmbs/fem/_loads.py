"""Consistent loads on nodes: gravity, pressure, line loads, forces; all (nodes, 6), to be added up.

`collect(structure, load)` is the vector of the dense matrices, `load[:, :structure.size]` that of the block form.
"""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..elements import DIRECTIONS
from ..runtime import as_dtype, jit
from ..typing import ArrayLike
from ._structure import Structure


@jit
def body_load(structure: Structure, acceleration: ArrayLike) -> Float[Array, "nodes 6"]:
    """Consistent weight in a uniform field `acceleration` (3,) [m/s^2]: the mass matrix times the rigid translation.

    Source: S1 (18).
    """
    parts = ((group, element_weights(structure, group, acceleration)) for group in structure.groups.values())
    return sum(_scatter_to_nodes(structure, group, forces) for group, forces in parts)


@jit
def pressure_load(
    structure: Structure, group: str, pressure: ArrayLike, face: int | None = None
) -> Float[Array, "nodes 6"]:
    """Consistent load of a pressure [Pa], a number or (elements,): along a shell's normal, or into a solid's `face`.

    Source: S1 (18).
    """
    chosen = structure.group(group)
    if not hasattr(chosen.element, "pressure_load"):
        raise ValueError(f"{group}: elements of kind {type(chosen.element).__name__} take no pressure")
    values = _per_element(structure, chosen, pressure, ())
    extra = () if face is None else (face,)
    apply = lambda element, nodes, p: element.pressure_load(nodes, p, *extra)
    return _scatter_to_nodes(structure, chosen, chosen.map(apply, structure.positions, values))


@jit
def line_load(structure: Structure, group: str, force: ArrayLike) -> Float[Array, "nodes 6"]:
    """Consistent load of a uniform force (3,) or (elements, 3) per length [N/m] on beams, in world axes.

    Source: S1 (18).
    """
    return _scatter_to_nodes(structure, structure.group(group), element_line_loads(structure, group, force))


def nodal_load(structure: Structure, forces: Mapping) -> Float[Array, "nodes 6"]:
    """Load of forces [N] and moments [N m] by node: `{"tip": {"z": -1.0}}`, or (3,) or (6,) values."""
    total = jnp.zeros((structure.num_nodes, 6), structure.positions.dtype)
    for name, value in forces.items():
        node = structure.node(name)
        items = value.items() if isinstance(value, Mapping) else zip(DIRECTIONS, value, strict=False)
        for direction, component in items:
            if direction not in DIRECTIONS:
                raise ValueError(
                    f"load at {name}: unknown direction {direction!r}, the directions are {', '.join(DIRECTIONS)}"
                )
            total = total.at[node, DIRECTIONS.index(direction)].add(as_dtype(component, total.dtype))
    return total


def element_weights(structure, group, acceleration):
    """`body_load` of a group by element (elements, n)."""
    field = as_dtype(acceleration, structure.positions.dtype)

    def weight(element, nodes):
        motion = jnp.zeros((element.num_nodes, element.coordinates), nodes.dtype).at[:, :3].set(field)
        return element.mass(nodes) @ motion.reshape(-1)

    return group.map(weight, structure.positions)


def element_line_loads(structure, group, force):
    """`line_load` of a group by element (elements, n)."""
    chosen = structure.group(group)
    if not hasattr(chosen.element, "line_load"):
        raise ValueError(f"{group}: elements of kind {type(chosen.element).__name__} take no line load")
    values = _per_element(structure, chosen, force, (3,))
    return chosen.map(lambda element, nodes, q: element.line_load(nodes, q), structure.positions, values)


def _per_element(structure, group, value, shape):
    value = as_dtype(value, structure.positions.dtype)
    return jnp.broadcast_to(
        value.reshape((1,) * (1 + len(shape) - value.ndim) + value.shape), (len(group.nodes), *shape)
    )


def _scatter_to_nodes(structure, group, forces):
    c = group.element.coordinates
    total = jnp.zeros((structure.num_nodes, 6), structure.positions.dtype)
    return total.at[group.connections, :c].add(forces.reshape(*np.shape(group.nodes), c))
