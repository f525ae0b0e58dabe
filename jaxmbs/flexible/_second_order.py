"""Displacements of second order of a reduced body, from the geometric stiffness of its finite elements."""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..errors import ModelError
from ..fem import Structure, scatter_rows
from ..fem._prestress import element_geometric_stiffness
from ..linear._system import LinearSystem
from ..math._spd import spd_solve
from ..model._elastic import GeometricStiffening
from ..reductions._base import Reduced
from ..runtime import jit
from ._rigid_motions import rotated_shapes


def check_structure(system: LinearSystem, structure: Structure) -> tuple[int, ...]:
    """Places of the rows of the structure among the coordinates of the system it was assembled to.

    Raises: ModelError where the coordinates differ, or where no element has geometric stiffness.
    """
    rows, faults = structure_rows(system, structure)
    if not any(group.element.has_geometric_stiffness for group in structure.groups.values()):
        faults = [*faults, "no element of the structure has a geometric stiffness"]
    if faults:
        raise ModelError([f"stiffening: {fault}" for fault in faults])
    return rows


def structure_rows(system: LinearSystem, structure: Structure) -> tuple[tuple[int, ...], list[str]]:
    """Places of the rows of a structure among the coordinates of the system it was assembled to, and faults."""
    whole = system.whole if isinstance(system, Reduced) else system.coordinates
    places = {label: i for i, label in enumerate(whole)}
    missing = [f"{node} {direction}" for node, direction in structure.labels if (node, direction) not in places]
    text = f"the structure is not that of the substructure, which has no {', '.join(missing[:6])}"
    return tuple(places.get(label, 0) for label in structure.labels), [text] if missing else []


def second_order(
    system: LinearSystem, structure: Structure, shapes: Array, rigid: Array, outer: tuple[int, ...]
) -> GeometricStiffening:
    """Displacements of second order on shapes (n, m), the first interface at rest.

    Every load whose work on them is needed is applied alone to the body, held at its first interface: those of unit
    momenta, `M B_k` and `-e_a x (M B_k)`, and unit loads at the other interfaces.  Its stress gives the geometric
    stiffness, whose projection is the negative of that work.

    Raises: ModelError as `check_structure`.
    """
    rows = check_structure(system, structure)
    expand = system.basis if isinstance(system, Reduced) else None
    return _second_order(system, structure, shapes, rigid, outer, expand, rows)


@jit
def _second_order(system, structure, shapes, rigid, outer, expand, rows):
    n, m = shapes.shape
    carried = system.mass @ rigid
    turned = -jnp.moveaxis(rotated_shapes(system, carried), 0, 2).reshape(n, 18)  # (n, 6, 3): k, then a
    unit = jnp.eye(n, dtype=shapes.dtype)[:, np.array(outer[6:], int)]
    loads = jnp.concatenate([carried, turned, unit], axis=1)
    free = np.setdiff1d(np.arange(n), outer[:6])
    held = spd_solve(system.stiffness[np.ix_(free, free)], loads[free])
    under_load = jnp.zeros_like(loads).at[free].set(held)

    def at_nodes(x):
        """Displacements (k, nodes, 6) of the structure from those (n, k) of the substructure."""
        whole = x if expand is None else expand @ x
        return scatter_rows(structure, whole[np.array(rows, int)].T)

    work = -_projected(structure, at_nodes(under_load), at_nodes(shapes))
    at_interfaces, of_rigid = work[24:], work[:24]
    # coordinates at interfaces are their whole displacements, that of second order included
    of_rigid = of_rigid - jnp.einsum("nl,nj,jab->lab", loads[:, :24], shapes[:, : len(outer) - 6], at_interfaces)
    softness = jnp.linalg.pinv(rigid.T @ carried, rtol=1e-10, hermitian=True)  # a line of points has no spin inertia
    moved, spun = jnp.einsum("kl,lij->kij", softness, of_rigid[:6]), of_rigid[6:].reshape(6, 3, m, m)
    return GeometricStiffening(moved, jnp.einsum("kl,laij->kaij", softness, spun), at_interfaces)


def _projected(structure, stresses, shapes):
    """Geometric stiffness (loads, m, m) on nodal shapes (m, nodes, 6) at nodal displacements (loads, nodes, 6)."""

    def at(u):
        total = 0.0
        for name, group in structure.groups.items():
            if group.element.has_geometric_stiffness:
                K = element_geometric_stiffness(structure, name, u)
                X = shapes[:, group.connections, : group.element.coordinates].reshape(len(shapes), len(K), -1)
                total = total + jnp.einsum("aei,eij,bej->ab", X, K, X)
        return total

    return lax.map(at, stresses)
