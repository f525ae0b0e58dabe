"""Rigid motions of a substructure, and its shapes turned with it."""

import jax
import jax.numpy as jnp
import numpy as np

from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..math._linalg import skew


def rows_of_interfaces(s: LinearSystem, interfaces) -> tuple[int, ...]:
    """Rows of the interfaces, six each, in the order x y z rx ry rz."""
    faults = [] if interfaces else ["an elastic body needs at least one interface"]
    if s.positions is None:
        faults.append("an elastic body needs the positions of its nodes: LinearSystem(..., positions=...)")
    places = {label: i for i, label in enumerate(s.coordinates)}
    for name in interfaces:
        missing = [d for d in DIRECTIONS if (name, d) not in places]
        if missing == list(DIRECTIONS):
            faults.append(f"interface {name!r}: there is no such node in the substructure")
        elif missing:
            faults.append(f"interface {name!r}: has no {' '.join(missing)}; give it six coordinates by rigid_node")
    if len(set(interfaces)) < len(interfaces):
        faults.append("an interface is given twice")
    if faults:
        raise ModelError(faults)
    return tuple(places[name, d] for name in interfaces for d in DIRECTIONS)


def row_directions(s: LinearSystem):
    """Node and direction numbers (n,) of every row; -1 for modal coordinates."""
    names = {name: i for i, name in enumerate(s.nodes)}
    node = np.array([names[name] if d else -1 for name, d in s.coordinates])
    return node, np.array([DIRECTIONS.index(d) if d else -1 for _, d in s.coordinates])


def rigid_basis(s: LinearSystem, about):
    """Rigid motions (n, 6): rotations about a point (3,), then translations; modal coordinates stay at rest."""
    node, direction = row_directions(s)
    arms = s.positions - about[None]
    turning = -jax.vmap(skew)(arms)  # columns e_d x arm
    eye = jnp.broadcast_to(jnp.eye(3, dtype=arms.dtype), turning.shape)
    motions = jnp.concatenate(
        [jnp.concatenate([turning, eye], axis=2), jnp.concatenate([eye, jnp.zeros_like(eye)], axis=2)], axis=1
    )
    return jnp.where((direction >= 0)[:, None], motions[node, direction], 0.0)


def rotated_shapes(s: LinearSystem, shapes):
    """Shapes rotated by unit angles, (3, n, m): `e_a x u` of the translations u in shapes (n, m), a = x, y, z."""
    node, direction = row_directions(s)
    moves = (direction >= 0) & (direction < 3)
    u = jnp.zeros((len(s.nodes), 3, shapes.shape[1]), shapes.dtype)
    u = u.at[node[moves], direction[moves]].set(shapes[moves])
    axes = jnp.eye(3, dtype=shapes.dtype)[:, None, :, None]
    crossed = jnp.cross(axes, u[None], axis=2)
    return jnp.zeros((3, *shapes.shape), shapes.dtype).at[:, moves].set(crossed[:, node[moves], direction[moves]])
