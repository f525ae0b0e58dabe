"""Rotation and mirroring of components about the origin."""

from collections.abc import Sequence
from typing import Any, TypeVar

import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._labels import format_label
from ..linear._system import LinearSystem
from ..runtime import as_dtype
from ..typing import ArrayLike
from ._base import Reduced

SystemT = TypeVar("SystemT", bound=LinearSystem)

#: Tolerance of orthogonal axes, and of positions that must coincide relative to the size of the component.
POSITION_TOLERANCE = 1e-6


def rotate(system: SystemT, axes: ArrayLike) -> SystemT:
    """Rotate or mirror a system about the origin: a node at r moves to `axes @ r`, a displacement u to `axes @ u`.

    A rotation is an axial vector: in a mirror image it becomes `-axes @ theta`.  The expansion of a reduced system
    leads to the axes in which it was reduced.

    Args: axes: (3, 3) orthogonal; `diag(-1, 1, 1)` mirrors in the plane x = 0.

    Raises: ModelError for axes that are not orthogonal, and for nodes without the directions into which they would
    move.
    Source: S1 (3), section 5.
    """
    system = system.to_dense()
    E, mixed = coordinate_rotation(system.coordinates, axes)
    E = as_dtype(E, system.dtype)
    light = set(system.massless)
    changes: dict[str, Any] = {
        name: None if A is None else E @ A @ E.T
        for name, A in (("mass", system.mass), ("stiffness", system.stiffness), ("damping", system.damping))
    }
    if system.positions is not None:
        changes["positions"] = system.positions @ as_dtype(axes, system.positions.dtype).T
    if isinstance(system, Reduced):
        changes["basis"] = system.basis @ E.T
    massless = tuple(i for i in system.massless if light.issuperset(np.flatnonzero(mixed[i]).tolist()))
    return system.replace(massless=massless, **changes)


def coordinate_rotation(labels: Sequence[tuple[str, str]], axes: Any) -> tuple[Any, np.ndarray]:
    """Matrix E (n, n) of `x = E x_own` for coordinates rotated with `axes`, and a mask (n, n) of its possible
    entries.

    NumPy arrays for concrete axes.  Raises: as `rotate`.
    """
    xp: Any = np if is_concrete(axes) else jnp
    axes = xp.asarray(axes)
    if axes.shape != (3, 3) or (
        is_concrete(axes) and not np.allclose(axes @ axes.T, np.eye(3), rtol=0, atol=POSITION_TOLERANCE)
    ):
        raise ModelError(["axes must be an orthogonal (3, 3) matrix"])
    number = {node: k for k, node in enumerate(dict.fromkeys(node for node, _ in labels))}
    node = np.array([number[name] for name, _ in labels], int)
    along = np.array([DIRECTIONS.index(d) if d else -1 for _, d in labels], int)
    alike = (node[:, None] == node[None]) & (along[:, None] // 3 == along[None] // 3) & (along >= 0)
    spin, zero = xp.linalg.det(axes) * axes, xp.zeros_like(axes)
    six = xp.block([[axes, zero], [zero, spin]])
    E = xp.where(alike, six[along[:, None], along[None]], np.eye(len(labels), dtype=axes.dtype))
    lost = (
        np.abs(np.sum(E * E, axis=0) - 1) > POSITION_TOLERANCE
        if is_concrete(axes)
        else (along >= 0) & (np.sum(alike, axis=1) < 3)
    )
    if np.any(lost):
        named = ", ".join(format_label(label) for label, gone in zip(labels, lost, strict=True) if gone)
        raise ModelError([f"rotated, {named} would move in directions that the node does not have"])
    return E, alike | np.eye(len(labels), dtype=bool)
