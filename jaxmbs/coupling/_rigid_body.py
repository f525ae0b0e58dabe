"""`RigidBody`: a rigid body with named attachment points as a component of a network."""

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..builder._validation import mass_faults
from ..checks import is_concrete, may_be_nonzero
from ..elements import DIRECTIONS
from ..elements._base import as_real
from ..errors import ModelError, UnknownNameError
from ..linear._labels import find_rows, format_label
from ..linear._rigid_motions import rigid_motions
from ..linear._system import LinearSystem
from ..model.inertia import as_matrix
from ..reductions._base import Reduced
from ..tables import format_number, table_repr
from ..typing import ArrayLike, CoordinateLike
from ._ties import Channels

#: The node of the body's own coordinates.
CENTRE = "com"


class _MassProperties(NamedTuple):
    mass: ArrayLike
    com: ArrayLike
    inertia: ArrayLike
    any_inertia: bool = False


def _table_rows(body):
    """Summary line and table of a rigid body: positions of the centre of mass and of all points."""
    mass = f"mass {format_number(body.mass[0, 0])} kg, " if is_concrete(body.mass) else ""
    places = np.asarray(body.positions) if is_concrete(body.positions) else [("traced",) * 3] * len(body.nodes)
    cells = [[x if isinstance(x, str) else format_number(x) for x in place] for place in places]
    rows = [(node, *row) for node, row in zip(body.nodes, cells, strict=True)]
    return f"rigid body, {mass}{len(body.nodes) - 1} points", [("node", "x", "y", "z"), *rows]


class RigidBody(LinearSystem):
    """A rigid body with named points that bonds join: an engine block, an instrument box, a rigid frame.

    Its own coordinates are the motion of its centre of mass, "com x" to "com rz".  The motion of a point, "foot x" to
    "foot rz", follows from it: forces act on either, responses are asked of either.  Bonds join points, not the
    centre of mass; a point may lie there.

    Args:
        mass: [kg]; of a rigid link 0.
        points: (3,) [m] by name, in world axes, as the nodes of a structure.
        com: (3,) centre of mass, likewise [m].
        inertia: about the centre of mass in world axes [kg m^2]: 0, three principal values or (3, 3).

    Raises: ModelError with every fault: mass properties that no body has, no points, points without three numbers.
    Source: S1 (3), (14).
    """

    positions: Float[Array, "nodes 3"]

    __repr__, _repr_html_ = table_repr(_table_rows)

    def __init__(
        self,
        *,
        mass: ArrayLike,
        points: Mapping[str, ArrayLike],
        com: ArrayLike = (0.0, 0.0, 0.0),
        inertia: ArrayLike = 0.0,
    ) -> None:
        mass, com, inertia = map(_as_array_if_traced, (mass, com, inertia))
        points = (
            {name: _as_array_if_traced(place) for name, place in points.items()}
            if isinstance(points, Mapping)
            else points
        )
        faults = mass_faults("rigid body", _MassProperties(mass, com, inertia)) + _point_faults(points)
        if faults:
            raise ModelError(faults)
        m, spin = as_real(mass), as_matrix(inertia)
        places = {name: as_real(place) for name, place in {CENTRE: com, **points}.items()}
        dtype = np.result_type(m.dtype, spin.dtype, *(place.dtype for place in places.values()))
        translation = m.astype(dtype) * jnp.eye(3, dtype=dtype)
        blocks = jnp.zeros((6, 6), dtype).at[:3, :3].set(translation).at[3:, 3:].set(spin.astype(dtype))
        super().__init__(
            mass=blocks,
            stiffness=jnp.zeros_like(blocks),
            interface=range(6),
            coordinates=[(CENTRE, direction) for direction in DIRECTIONS],
            positions={name: place.astype(dtype) for name, place in places.items()},
            massless=_massless_rows(mass, inertia),
        )

    @property
    def channels(self) -> Channels:
        """Coordinates that bonds may tie: those of all points."""
        points = self.nodes[1:]
        labels = tuple((point, direction) for point in points for direction in DIRECTIONS)
        return Channels(labels, self.positions[1:], points)

    @property
    def motions(self) -> Float[Array, "points_6 6"]:
        """Displacements of all points for unit motions of the centre of mass.  Source: S1 (14)."""
        return rigid_motions(self.positions[1:], self.positions[0]).reshape(-1, 6)

    def outputs(self, *names: CoordinateLike) -> tuple[Array, tuple[str, ...]]:
        """Output matrix (k, 6) and labels as in `LinearSystem.outputs`, of the centre of mass and of all points."""
        labels, faults = (*self.coordinates, *self.channels.coordinates), []
        rows = find_rows(names, labels, faults)
        if faults:
            raise UnknownNameError("; ".join(faults))
        return self._all()[np.array(rows, int)], tuple(format_label(labels[row]) for row in rows)

    def to_reduced(self) -> Reduced:
        """Convert to a component whose expansion leads to the centre of mass and to all points."""
        points = LinearSystem.replace(self, coordinates=(*self.coordinates, *self.channels.coordinates))
        return Reduced(
            points,
            self._all(),
            6,
            mass=self.mass,
            stiffness=self.stiffness,
            damping=self.damping,
            coordinates=self.coordinates,
            positions=(self.nodes, self.positions),
            massless=self.massless,
        )

    def _all(self):
        return jnp.concatenate([jnp.eye(6, dtype=self.dtype), self.motions])


def _massless_rows(mass, inertia):
    """Rows without mass for any traced values: the rotations of a point mass, all rows of a rigid link."""
    if may_be_nonzero(inertia):
        return ()
    return range(3, 6) if may_be_nonzero(mass) else range(6)


def _as_array_if_traced(value):
    """Concrete values unchanged, traced ones (also in tuples) as an array."""
    return value if is_concrete(value) else jnp.asarray(value)


def _point_faults(points):
    if not isinstance(points, Mapping) or not points:
        return ["rigid body: points must be places by name, one or more: points={'foot': (0.1, 0.0, 0.0)}"]
    found = []
    for name, place in points.items():
        if name == CENTRE:
            found.append(f"rigid body: a point cannot be called {CENTRE!r}, which is the centre of mass")
        elif not isinstance(name, str) or not name:
            found.append(f"rigid body: the name of a point must be a string, not {name!r}")
        elif np.shape(place) != (3,):
            found.append(f"rigid body: point {name!r} must be three numbers, not of shape {np.shape(place)}")
        elif is_concrete(place) and not _is_finite(place):
            found.append(f"rigid body: point {name!r} must be three finite numbers, not {place!r}")
    return found


def _is_finite(place):
    try:
        return bool(np.all(np.isfinite(np.asarray(place, float))))
    except (TypeError, ValueError):
        return np.iscomplexobj(place)  # refused elsewhere, as complex
