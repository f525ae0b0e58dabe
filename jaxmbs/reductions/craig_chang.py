"""Free modes with inertia-relief attachment modes, from a statically determinate support (Craig and Chang 1977)."""

from collections.abc import Sequence

import jax.numpy as jnp

from ..linear.condensation import partition
from ..linear.modes import stable_modes
from ..math import square
from .base import Reduced, admitted, check_num_modes, numbered, project
from .hurty import determinate_coordinates, support_motions
from .mixed import explicit_interface


def craig_chang(
    stiffness,
    mass,
    interface: Sequence[int],
    num_modes: int,
    damping=None,
    determinate: Sequence[int] | None = None,
) -> Reduced:
    """Interface displacements, rigid motions and the lowest elastic free modes (`num_modes` counts only these).

    Args:
        determinate: coordinates that just hold the component; default `hurty.determinate_coordinates`.

    The space is Rubin's; no rigid mode has to be told from the elastic ones by its frequency.  Source: S1 (4)-(8).
    """
    inner, outer, stiffness, mass = admitted(interface, stiffness, mass, damping)
    held = determinate_coordinates(stiffness, interface) if determinate is None else tuple(determinate)
    n, b, d = stiffness.shape[0], len(outer), len(held)
    check_num_modes(num_modes + d, len(inner))
    rigid = support_motions(stiffness, held)
    loads = jnp.eye(n, dtype=stiffness.dtype)[:, outer]
    attachment = inertia_relief(stiffness, mass, loads, held, rigid)
    elastic = stable_modes(stiffness, mass, num_modes + d, d).shapes[:, d:]
    order = jnp.concatenate([outer, inner])
    columns = [A[order] for A in (attachment, jnp.concatenate([rigid, elastic], axis=1))]
    moved, (shapes,) = explicit_interface(columns[0], columns[1:], b)
    basis = jnp.zeros((n, b + d + num_modes), moved.dtype).at[order].set(jnp.concatenate([moved, shapes], axis=1))
    labels = numbered("interface", b) + numbered("rigid", d) + numbered("normal", num_modes)
    return project(basis, stiffness, mass, damping, basis[outer], labels)


def inertia_relief(stiffness, mass, loads, determinate: Sequence[int], rigid):
    """Elastic displacements (n, c) of a free component under loads (n, c), which its own inertia balances.

    Held at `determinate`, which then carries nothing; `rigid^T M x = 0`.
    """
    inertia = rigid.T @ mass @ rigid

    def without_rigid(x):
        return x - rigid @ square.solve(inertia, rigid.T @ (mass @ x)) if len(determinate) else x

    def balanced(f):
        return f - mass @ (rigid @ square.solve(inertia, rigid.T @ f)) if len(determinate) else f

    inner, _ = partition(stiffness.shape[0], determinate)
    x = square.solve(stiffness[inner][:, inner], balanced(loads)[inner])
    return without_rigid(jnp.zeros_like(loads).at[inner].set(x))
