"""Points of rigid bodies among joined coordinates: they follow from the motions of the bodies, exactly."""

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
    """Joined coordinates by those that are left: `xi_all = transformation xi`.

    Attributes:
        transformation: (all, N).
        labels, massless: of those that are left.
    """

    transformation: Float[Array, "all n"]
    labels: list
    massless: list


class _Point(NamedTuple):
    """A coordinate of a point: its body, its number there, its joint."""

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
    """What is left of joined coordinates where joints follow from the motions of rigid bodies.

    A joint moves with the first point in it; what more points are in it, or the ground, holds the bodies.

    Args:
        points: by rigid body, its points' coordinates by its own (k, 6).
        joints, places: by component, joints of its interface, places of its own coordinates among the joined ones.

    Raises: ModelError where rigid bonds hold bodies in a direction in which others do already, or nothing is left.
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
                "the bonds hold every component, nothing is left that could move: make one of them a bushing, whose "
                "stiffness changes no load that statics determines"
            ]
        )
    return Dependence(left, names, light)


def dependent_system(fields: dict, found: Dependence) -> dict:
    """What makes a linear system of joined coordinates, on those that are left.  Source: S1 (9)-(12)."""
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
    """The first point in each joint; pairs of points that hold bodies: one and that which has its joint, or None."""
    first, holding = {}, []
    for i, point in enumerate(which):
        owner = None if point.joint < 0 else first.setdefault(point.joint, i)
        if owner != i:
            holding.append((i, owner))
    return first, holding


def _constraint_rows(rows, holding):
    """Rows that vanish: one point less the other, or less the ground."""
    padded = jnp.concatenate([rows, jnp.zeros_like(rows[:1])])
    one, other = zip(*holding, strict=True)
    return padded[np.array(one)] - padded[np.array([len(rows) if k is None else k for k in other])]


def _remaining_motions(C, labels, about, bonds):
    """Motions N (n, n - r) with `C N = 0`, their names, and whether no row of C follows from others.

    With known places some of the bodies' own coordinates are left and give the others; with traced ones, whose
    places in the elimination cannot be chosen, the motions are those of least size.
    """
    (r, n), sound = C.shape, True
    if is_concrete(C):
        dependent = _dependent_coordinates(np.asarray(C), about, bonds)
        own = [k for k in range(n) if k not in set(dependent)]
        E = jnp.eye(n, dtype=C.dtype)
        given, start, names = E[:, np.array(dependent)], E[:, np.array(own, int)], [labels[k] for k in own]
    elif r > n:
        raise ModelError([f"{r} rigid bonds hold rigid bodies that have {n} motions: make some of them bushings"])
    else:
        here = lax.stop_gradient(C)
        values, vectors = lapack.eigh(here.T @ here)
        start, given = jnp.split(lax.stop_gradient(vectors), [n - r], axis=1)
        sound = values[n - r] > 10 * n * jnp.finfo(values.dtype).eps * values[-1]
        names = [(f"motion {k}", "") for k in range(n - r)]
    return start - given @ square.solve(C @ given, C @ start) if names else start, names, sound


def _dependent_coordinates(C, about, bonds):
    """Coordinates that the others give; ModelError where a row of C follows from those above it."""
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
        f"bond {name!r}: other rigid bonds hold its rigid body already in {' '.join(tie.labels[k] for k in which)}, "
        "and statics does not determine what it bears: leave these free, joint(..., free=...), or make it a bushing"
    )
