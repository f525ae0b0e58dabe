"""Recovery of element forces and stresses from displacements of nodes."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ..linear._storage import as_inexact
from ..runtime import jit
from ..typing import AnyArray, ArrayLike
from ._loads import element_line_loads, element_weights
from ._structure import Structure, scatter_rows


@jit
def element_forces(
    structure: Structure,
    x: AnyArray,
    line_loads: Mapping[str, ArrayLike] | None = None,
    acceleration: ArrayLike | None = None,
) -> dict[str, Array]:
    """Element loads `F_e = k_e T_e x - f_e` by group, (..., elements, labels), in the elements' own axes.

    Args:
        x: (..., rows) of the dense matrices, or (..., nodes, size) or (..., nodes, 6) at the nodes, times or cases
            first; may be complex amplitudes.  What fits both ways, as two nodes with six rows do, is taken at the
            nodes: `histories` takes rows always.
        line_loads: by group, what x was computed under, as given to `line_load`.
        acceleration: (3,), likewise, as given to `body_load`.

    `element.force_labels` names the columns.  Loads spread over a beam part its end forces from `k_e T_e x`; give
    them here and the end forces are right for any mesh.  Other elements state forces in their middle, which need no
    such part.

    Raises: ValueError for x of another shape, or a line load on elements that take none; UnknownNameError for an
    unknown group.  Source: S1 (30).
    """
    return _recover(structure, x, "forces", line_loads, acceleration)


@jit
def element_stresses(
    structure: Structure,
    x: AnyArray,
    line_loads: Mapping[str, ArrayLike] | None = None,
    acceleration: ArrayLike | None = None,
) -> dict[str, Array]:
    """Stresses [Pa] by group, (..., elements, labels); arguments as in `element_forces`.  Source: S1 (30)."""
    return _recover(structure, x, "stresses", line_loads, acceleration)


def _instant_shape(structure, x):
    """Shape of the displacements of one instant: that of x without its leading axes.

    Raises: ValueError for displacements that are not those of the structure.
    """
    n, nodes = structure.index.num_rows, structure.num_nodes
    for shape in ((nodes, structure.size), (nodes, 6), (n,)):
        if x.shape[-len(shape) :] == shape:
            return shape
    raise ValueError(
        f"the structure has {n} coordinates and {nodes} nodes, but x has the shape {x.shape}; displacements of a "
        "reduced component, or one with rigid nodes, must be expanded by its `expand` first"
    )


def _recover(structure, x, what, line_loads, acceleration):
    x = as_inexact(x)
    shape = _instant_shape(structure, x)
    axes = x.shape[: x.ndim - len(shape)]
    if axes:
        one = lambda x: _recover_instant(structure, x, what, line_loads, acceleration)
        found = jax.vmap(one)(x.reshape(-1, *shape))
        return jax.tree.map(lambda f: f.reshape(*axes, *f.shape[1:]), found)
    return _recover_instant(structure, x, what, line_loads, acceleration)


def _recover_instant(structure, x, what, line_loads, acceleration):
    if not jnp.iscomplexobj(x):
        return _recover_real(structure, x, what, line_loads, acceleration)
    given, parts = jax.tree.map(jnp.asarray, (x, line_loads, acceleration)), []
    for part in (jnp.real, jnp.imag):
        x, line_loads, acceleration = jax.tree.map(part, given)
        parts.append(_recover_real(structure, x, what, line_loads, acceleration))
    return jax.tree.map(lax.complex, *parts)


def _recover_real(structure, x, what, line_loads, acceleration):
    u = scatter_rows(structure, x) if x.ndim == 1 else x
    loads = {name: element_line_loads(structure, name, force) for name, force in (line_loads or {}).items()}
    if acceleration is not None:
        for name in [name for name, group in structure.groups.items() if group.element.has_ends]:
            group = structure.groups[name]
            loads[name] = loads.get(name, 0.0) + element_weights(structure, group, acceleration)
    return recover_under_loads(structure, u, what, loads)


def recover_under_loads(structure: Structure, u: Array, what: str, loads: Mapping[str, Array]) -> dict[str, Array]:
    """Forces or stresses, as `what` says, (elements, labels) by group, at nodal displacements u (nodes, c).

    Args: loads: by group, consistent loads (elements, n) that are spread over elements with ends.
    """
    found, function = {}, lambda element, *rest: getattr(element, what)(*rest)
    for name, group in structure.groups.items():
        at = u[group.connections, : group.element.coordinates]
        none = jnp.zeros((len(group.nodes), group.element.size), at.dtype)
        spread = [(none + loads.get(name, 0.0)).astype(at.dtype)] if group.element.has_ends else []
        found[name] = group.map(function, structure.positions, at, *spread)
    return found
