"""Forces and stresses of elements from displacements of nodes."""

import equinox as eqx

from .structure import Structure, spread


@eqx.filter_jit
def element_forces(structure: Structure, x) -> dict:
    """Element loads `F_e = k_e T_e x` by group, (elements, labels), in the elements' own axes.

    Args: x: (rows,) of the dense matrices, or (nodes, size) or (nodes, 6) at the nodes.

    `element.force_labels` names the columns.  Loads spread over an element are not subtracted.  Source: S1 (30).
    """
    return _recovered(structure, x, lambda element, nodes, u: element.forces(nodes, u))


@eqx.filter_jit
def element_stresses(structure: Structure, x) -> dict:
    """Stresses [Pa] by group, (elements, labels); arguments as in `element_forces`.  Source: S1 (30)."""
    return _recovered(structure, x, lambda element, nodes, u: element.stresses(nodes, u))


def _recovered(structure, x, function):
    u = spread(structure, x) if x.ndim == 1 else x
    found = {}
    for name, group in structure.groups.items():
        at = u[group.connections, : group.element.coordinates]
        found[name] = group.map(function, structure.positions, at)
    return found
