"""Bonds between components: rigid bonds, hinges that leave directions free, bushings."""

import operator
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import distinct_names
from ..elements._base import as_optional_real
from ..linear._system import LinearSystem
from ..reductions._base import Reduced
from ..typing import ArrayLike, Convertible
from ._primal_assembly import elastic_bond

#: An end of a bond: "stage", "stage.top", "stage.top z", or `(name, which)`, which a node, nodes, or numbers.
End = str | tuple[str, str | int | Sequence | range | np.ndarray]

#: The end of a bond that is fixed to the ground.
GROUND = "ground"


class Bond(eqx.Module):
    """Bond between two ends, as made by `rigid_bond`, `hinge` and `bushing`; `connect` joins components by bonds.

    Attributes:
        ends: `(component, which)` twice; which: nodes or numbers of its interface coordinates, or None for all.
        free: directions, or indices among the coordinates of an end, that the bond leaves free.
        axes: (3, 3), rows are the axes of the bond in world axes, or None.
        element: the component of a bushing, or None.
    """

    ends: tuple = eqx.field(static=True)
    free: tuple = eqx.field(static=True, default=())
    axes: Convertible[Float[Array, "3 3"] | None] = eqx.field(converter=as_optional_real, default=None)
    element: LinearSystem | None = None


def rigid_bond(first: End, second: End = GROUND) -> Bond:
    """Rigid bond: both ends, at one position, have the same motion.

    For ends at different positions see `reductions.rigid_transformation`.

    Args: first, second: a component's name (its whole interface), one of its nodes, "stage.top", or a coordinate,
        "stage.top z"; or `(name, node)`, `(name, nodes)`, `(name, numbers)` of interface coordinates, or
        `(name, [(node, direction)])` as systems label them; second also "ground".  Source: S1 (1)-(2).
    """
    return Bond((_parse_end(first), _parse_end(second)))


def hinge(
    first: End, second: End = GROUND, *, free: str | Sequence[str | int], axes: ArrayLike | None = None
) -> Bond:
    """Rigid bond that leaves some directions free: a pin, a slider, a ball joint.

    Args:
        first, second: as in `rigid_bond`.
        free: directions "ry" or "x rz", or a sequence of them or of indices among the coordinates of an end.
        axes: (3, 3), rows are the axes of the joint in world axes, in which its forces are resolved; the ends then
            must be complete nodes.

    Source: S1 (1)-(2), (14).
    """
    free = distinct_names("free", free.split() if isinstance(free, str) else free)
    return Bond((_parse_end(first), _parse_end(second)), free, axes)


def bushing(
    first: End,
    second: End = GROUND,
    *,
    stiffness: ArrayLike,
    damping: ArrayLike | None = None,
    mass: ArrayLike | None = None,
    axes: ArrayLike | None = None,
) -> Bond:
    """Bushing: a bond with stiffness, damping and mass between two ends at one position.

    Args:
        first, second: as in `rigid_bond`.
        stiffness, damping, mass: (k, k) over the k coordinates of an end, or the k numbers of a diagonal.  The
            mass is distributed as that of a uniform rod.
        axes: (3, 3), rows are the axes in which they and the forces of the bond are resolved; default world axes.

    Source: S1 (1)-(3).
    """
    return Bond((_parse_end(first), _parse_end(second)), (), axes, elastic_bond(stiffness, damping, mass))


def _parse_end(end):
    if isinstance(end, str):
        name, _, node = end.partition(".")
        return name, (node,) if node else None
    words = f"an end of a bond is a component's name, 'stage.top', 'stage.top z' or (name, which), not {end!r}"
    if not (isinstance(end, tuple | list) and len(end) == 2 and isinstance(end[0], str)):
        raise TypeError(words)
    name, which = end
    if isinstance(which, str | int | np.integer):
        return name, (_parse_label(which, words),)
    if not np.iterable(which):
        raise TypeError(words)
    return name, tuple(_parse_label(one, words) for one in which)


def _parse_label(one, words):
    """Parse a node, a number, or a coordinate given as text or as the pair (node, direction)."""
    if isinstance(one, str):
        return one
    if isinstance(one, tuple | list) and len(one) == 2 and all(isinstance(part, str) for part in one):
        return " ".join(one).strip()
    try:
        return operator.index(one)
    except TypeError:
        raise TypeError(words) from None


def resolve_interface(reduced: Reduced, axes, coordinates) -> Reduced:
    """Resolve the interface coordinates x y z (rx ry rz) of a node in `axes` (3, 3), given by rows in world axes."""
    rows = np.array(coordinates).reshape(-1, 3)
    turn = jnp.swapaxes(axes, 0, 1).astype(reduced.dtype)
    E = jnp.eye(reduced.num_rows, dtype=reduced.dtype)
    for part in rows:
        E = E.at[np.ix_(part, part)].set(turn)
    M, K, C = (None if A is None else E.T @ A @ E for A in (reduced.mass, reduced.stiffness, reduced.damping))
    return reduced.replace(mass=M, stiffness=K, damping=C, basis=reduced.basis @ E)
