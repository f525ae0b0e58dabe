"""Modes with part of the interface held, part free and perhaps loaded by mass; attachment modes for the free part."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from ..checks import known
from ..linear.condensation import check_held
from ..linear.modes import stable_modes
from ..math import square
from .base import Reduced, admitted, check_num_modes, numbered, project


def mixed(
    stiffness,
    mass,
    interface: Sequence[int],
    num_modes: int,
    damping=None,
    fixed: Sequence[int] = (),
    load=None,
    num_rigid: int | None = None,
) -> Reduced:
    """Interface displacements, and modes with `fixed` held and the rest of the interface free.

    All of the interface fixed gives Craig and Bampton's space, none of it Rubin's.

    Args:
        fixed: the held coordinates of the interface; choose them where the neighbour is stiff or heavy.
        load: (c, c) mass that the free interface coordinates carry while the modes are found ("loaded interface").
        num_rigid: rigid motions left with `fixed` held; default: counted, which cannot be done under tracing.

    Modes asked include the rigid ones; their number cuts no group of equal frequencies.

    Raises: ValueError, if concrete, for unsymmetric matrices and negative stiffness; under tracing these give NaN.
    Source: S1 (4)-(8).
    """
    inner, outer, stiffness, mass = admitted(interface, stiffness, mass, damping)
    held = np.asarray(fixed, int)
    if not np.all(np.isin(held, outer)):
        raise ValueError(f"fixed coordinates {np.setdiff1d(held, outer).tolist()} are not in the interface")
    loose = outer[~np.isin(outer, held)]
    rest = np.concatenate([loose, inner])
    K, M = stiffness[rest][:, rest], mass[rest][:, rest]
    if load is not None:
        M = M.at[: len(loose), : len(loose)].add(load)
    rigid = count_rigid(K, M) if num_rigid is None else num_rigid
    check_num_modes(num_modes, len(inner))
    if num_modes < rigid:
        raise ValueError(f"num_modes = {num_modes}, of which {rigid} are rigid and must be kept")
    modes = stable_modes(K, M, num_modes, rigid)
    loads = jnp.eye(len(rest), dtype=K.dtype)[:, : len(loose)]
    static = attachment_modes(
        K, M, jnp.concatenate([loads, -stiffness[rest][:, held]], axis=1), modes.shapes[:, :rigid]
    )
    moved, shapes = explicit_interface(static[:, : len(loose)], (static[:, len(loose) :], modes.shapes), len(loose))
    n, b = stiffness.shape[0], len(outer)
    column = {int(c): k for k, c in enumerate(outer)}
    basis = jnp.zeros((n, b + num_modes), K.dtype)
    at_held, at_loose = ([column[int(c)] for c in part] for part in (held, loose))
    basis = basis.at[np.ix_(rest, at_loose)].set(moved).at[np.ix_(rest, at_held)].set(shapes[0])
    basis = basis.at[held, np.array(at_held, int)].set(1.0).at[np.ix_(rest, b + np.arange(num_modes))].set(shapes[1])
    labels = numbered("interface", b) + numbered("rigid", rigid) + numbered("normal", num_modes - rigid)
    return project(basis, stiffness, mass, damping, basis[outer], labels)


def attachment_modes(stiffness, mass, loads, rigid):
    """Static displacements (n, c) under loads (n, c), free rigid motions by inertia relief.

    With rigid motions (n, d) the loads are balanced by the inertia of the motion they cause and the displacements
    are free of rigid motion: `rigid^T M x = 0`.
    """
    n, d = rigid.shape
    carried = mass @ rigid
    saddle = jnp.block([[stiffness, carried], [carried.T, jnp.zeros((d, d), stiffness.dtype)]])
    solution = square.solve(saddle, jnp.concatenate([loads, jnp.zeros((d, loads.shape[1]), loads.dtype)]))[:n]
    check_held(solution, "the fixed interface")
    return solution


def explicit_interface(attachment, others, c):
    """Columns of attachment modes and of others, combined so that the first c rows are the identity and zero."""
    moved = square.solve(attachment[:c].T, attachment.T).T
    return moved, [shapes - moved @ shapes[:c] for shapes in others]


def count_rigid(stiffness, mass) -> int:
    """The number of rigid motions, on the host.  Raises: ValueError under tracing, and for negative stiffness."""
    if not known(stiffness, mass):
        raise ValueError("give num_rigid: rigid motions cannot be counted under tracing")
    with jax.ensure_compile_time_eval():
        return stable_modes(stiffness, mass).num_rigid
