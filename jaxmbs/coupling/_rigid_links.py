"""Elimination of the points of rigid bodies from joined coordinates: they follow exactly from the bodies' motions."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax import lax
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..errors import ModelError
from ..math import _square as square
from ..runtime import jit, lapack
from ._ties import Ties


class Dependence(NamedTuple):
    """Joined coordinates by the independent ones: `xi_all = transformation xi`.

    Attributes:
        transformation: (all, N).
        labels, massless: of the independent coordinates.
    """

    transformation: Float[Array, "all n"]
    labels: list
    massless: list


class _Point(NamedTuple):
    """Coordinate of a point: its body, its number there, its joint."""

    body: str
    number: int
    joint: int


def dependence(
    points: Mapping[str, Array],
    joints: Mapping[str, Sequence[int]],
    places: Mapping[str, Sequence[int]],
    labels: Sequence,
    massless: Sequence[int],
    bonds: Mapping[str, Ties],
) -> Dependence:
    """Dependence of joined coordinates on the independent ones, where joints follow from the motions of rigid bodies.

    A joint moves with the first point in it; further points in it, or the ground, constrain the bodies.

    Args:
        points: by rigid body, matrix (k, 6) of the coordinates of its points per its own coordinates.
        joints, places: by component, joints of its interface, and indices of its own coordinates.
        labels, massless: of all joined coordinates.

    Raises: ModelError where rigid bonds constrain bodies in a direction in which others do already, or nothing is
    free.
    Source: S1 (1)-(2), (14).
    """
    size = len(labels)
    which = [_Point(body, k, joint) for body in points for k, joint in enumerate(joints[body])]
    rows = jnp.concatenate([_scatter_columns(own, places[body], size) for body, own in points.items()])
    first, holding = _joint_owners(which)
    joint, owner = np.array(list(first.items()), int).reshape(-1, 2).T
    T = jnp.eye(size, dtype=rows.dtype).at[joint].set(rows[owner])
    tied = sorted({k for pair in holding for i in pair if i is not None for k in places[which[i].body]})
    free = [k for k in range(size) if k not in first and k not in tied]
    left, names = T[:, np.array(free, int)], [labels[k] for k in free]
    light = [i for i, k in enumerate(free) if k in massless]
    if holding:
        about = [which[i] for i, _ in holding]
        C = _constraint_rows(rows, holding)[:, np.array(tied)]
        N, own, sound = _remaining_motions(C, [labels[k] for k in tied], about, bonds)
        light += range(len(names), len(names) + len(own)) if set(tied) <= set(massless) else ()
        left, names = jnp.concatenate([left, T[:, np.array(tied)] @ N], axis=1), names + own
        left = left if is_concrete(sound) else jnp.where(sound, left, jnp.nan)
    if not names:
        raise ModelError(
            [
                "the bonds constrain every component completely, no motion is left: make one of them a "
                "bushing, whose "
                "stiffness does not change loads that statics determines"
            ]
        )
    return Dependence(left, names, light)


def dependent_system(fields: dict, found: Dependence) -> dict:
    """Arguments of a linear system on the independent coordinates, from those on all.  Source: S1 (9)-(12)."""
    matrices = {kind: fields[kind] for kind in ("mass", "stiffness", "damping")}
    return {
        **_transform_matrices(matrices, found.transformation),
        "coordinates": found.labels,
        "massless": found.massless,
        "transformation": found.transformation,
    }


@jit
def _transform_matrices(matrices, T):
    return {kind: None if A is None else T.T.astype(A.dtype) @ A @ T.astype(A.dtype) for kind, A in matrices.items()}


def _scatter_columns(own, places, size):
    return jnp.zeros((len(own), size), own.dtype).at[:, np.array(places)].set(own)


def _joint_owners(which):
    """First point in each joint, and constraining pairs (point, first point of its joint or None for the ground)."""
    first, holding = {}, []
    for i, point in enumerate(which):
        owner = None if point.joint < 0 else first.setdefault(point.joint, i)
        if owner != i:
            holding.append((i, owner))
    return first, holding


def _constraint_rows(rows, holding):
    """Constraint rows that vanish: one point minus the other, or minus the ground."""
    padded = jnp.concatenate([rows, jnp.zeros_like(rows[:1])])
    one, other = zip(*holding, strict=True)
    return padded[np.array(one)] - padded[np.array([len(rows) if k is None else k for k in other])]


def _remaining_motions(C, labels, about, bonds):
    """Basis N (n, n - r) of `C N = 0`, its labels, and True if C has full row rank.

    With concrete positions some of the bodies' own coordinates are independent and give the others; with traced ones,
    where pivots cannot be chosen, the basis is that of the smallest eigenvectors of `C^T C`.
    """
    (r, n), sound = C.shape, True
    if is_concrete(C):
        dependent = _dependent_coordinates(np.asarray(C), about, bonds)
        own = [k for k in range(n) if k not in set(dependent)]
        E = jnp.eye(n, dtype=C.dtype)
        given, start, names = E[:, np.array(dependent)], E[:, np.array(own, int)], [labels[k] for k in own]
    elif r > n:
        raise ModelError(
            [f"{r} rigid bonds constrain rigid bodies that have {n} motions: make some of them bushings"]
        )
    else:
        here = lax.stop_gradient(C)
        values, vectors = lapack.eigh(here.T @ here)
        start, given = jnp.split(lax.stop_gradient(vectors), [n - r], axis=1)
        sound = values[n - r] > 10 * n * jnp.finfo(values.dtype).eps * values[-1]
        names = [(f"motion {k}", "") for k in range(n - r)]
    return start - given @ square.solve(C @ given, C @ start) if names else start, names, sound


def _dependent_coordinates(C, about, bonds):
    """Indices of the dependent coordinates.  Raises: ModelError where a row of C depends on those above it.

    Rows are orthogonalised twice; a remainder below `eps^0.6` of the row is rounding of the lever arms.
    """
    size = np.linalg.norm(C, axis=0)  # metres beside radians
    scaled = C / np.where(size > 0, size, 1.0)
    basis, idle, small = np.zeros((0, C.shape[1])), {}, float(np.finfo(C.dtype).eps) ** 0.6
    for row, point in zip(scaled.astype(float), about, strict=True):
        rest = row - basis.T @ (basis @ row)
        rest = rest - basis.T @ (basis @ rest)
        if np.linalg.norm(rest) <= small * np.linalg.norm(row):
            for name in [n for n, tie in bonds.items() if any(point[:2] in end for end in tie.ends)]:
                idle.setdefault(name, []).append(point.number)
        else:
            basis = np.concatenate([basis, rest[None] / np.linalg.norm(rest)])
    if idle:
        raise ModelError([_redundancy_fault(name, bonds[name], numbers) for name, numbers in idle.items()])
    return sorted(scipy.linalg.qr(scaled, mode="r", pivoting=True)[1][: len(C)].tolist())


def _redundancy_fault(name, tie, numbers):
    which = [k for k in tie.kept if any(end and end[k][1] in numbers for end in tie.ends)]
    return (
        f"bond {name!r}: other rigid bonds constrain its rigid body already in "
        f"{' '.join(tie.labels[k] for k in which)}, so statics does not determine its load: leave these directions "
        "free by hinge(..., free=...), or make it a bushing"
    )
