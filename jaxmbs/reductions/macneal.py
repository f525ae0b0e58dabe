"""Free-interface modes with residual flexibility, its mass neglected (MacNeal 1971)."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from ..linear.modes import stable_modes
from ..math import square
from .base import Reduced, admitted, check_num_modes, numbered, project
from .mixed import attachment_modes, count_rigid, explicit_interface


def macneal(
    stiffness, mass, interface: Sequence[int], num_modes: int, damping=None, num_rigid: int | None = None
) -> Reduced:
    """Interface displacements and the lowest free modes; only the modes have mass and damping.

    The interface coordinates are `massless`: `couple` condenses those that no neighbour gives mass to.
    Frequencies may lie on either side.

    Raises: ValueError, if concrete, for unsymmetric matrices and negative stiffness; under tracing these give NaN.
    Source: S1 (4)-(8).
    """
    inner, outer, stiffness, mass = admitted(interface, stiffness, mass, damping)
    rigid = count_rigid(stiffness, mass) if num_rigid is None else num_rigid
    check_num_modes(num_modes, len(inner))
    b, modes = len(outer), stable_modes(stiffness, mass, num_modes, rigid)
    loads = jnp.eye(stiffness.shape[0], dtype=stiffness.dtype)[:, outer]
    elastic = modes.shapes[:, rigid:]
    residual = attachment_modes(stiffness, mass, loads, modes.shapes[:, :rigid])
    own = elastic.T @ stiffness @ elastic  # diagonal; its derivatives see how a group of equal values splits
    residual = residual - elastic @ square.solve(own, elastic.T @ loads)
    order = np.concatenate([outer, inner])
    moved, (shapes,) = explicit_interface(residual[order], (modes.shapes[order],), b)
    basis = jnp.zeros((len(order), b + num_modes), moved.dtype)
    basis = basis.at[order].set(jnp.concatenate([moved, shapes], axis=1))
    labels = numbered("interface", b) + numbered("rigid", rigid) + numbered("normal", num_modes - rigid)
    whole = project(basis, stiffness, mass, damping, basis[outer], labels)

    def of_modes(A):
        return jnp.zeros_like(whole.mass).at[b:, b:].set(modes.shapes.T @ A @ modes.shapes)

    C = None if damping is None else of_modes(damping)
    return Reduced(basis, of_modes(mass), whole.stiffness, C, whole.connection, whole.labels, tuple(range(b)))
