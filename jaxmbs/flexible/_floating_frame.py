"""Elastic bodies from substructures: deformation shapes relative to the first interface, and one inertia matrix."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete, negative
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..math import _square as square
from ..math._linalg import skew
from ..model._elastic import ElasticBody
from ..reductions._base import AbstractReduction, Reduced, Unreduced, check_num_modes
from ..reductions._craig_bampton import CraigBampton
from ..typing import AnyArray, ArrayLike
from ..vibration._damping import modal_damping

_STRAIN_TOLERANCE = {
    8: 1e-6,
    4: 1e-2,
}  # strain of rigid motions, over that of unit displacements, that counts as none


class FloatingFrame(eqx.Module):
    """Elastic body with the substructure that it was made from.

    Attributes:
        body: argument of `SystemBuilder.elastic`.
        shapes: (n, m) displacements Phi of all coordinates per deformation, the first interface at rest.
        rigid: (n, 6) rigid motions: rotations about, then translations of, the first interface.
        system: the substructure, with the damping of the body.
    """

    body: ElasticBody
    shapes: Float[Array, "n m"]
    rigid: Float[Array, "n 6"]
    system: LinearSystem

    def expand(self, x: AnyArray) -> Array:
        """Expand displacements (..., n) of the substructure to (..., whole) of the structure, as
        `fem.element_stresses` takes them, through rigid nodes and earlier reductions."""
        return self.system.expand(x) if isinstance(self.system, Reduced) else jnp.asarray(x)

    @property
    def whole(self) -> tuple[tuple[str, str], ...]:
        """Labels of the coordinates that `expand` returns."""
        return self.system.whole if isinstance(self.system, Reduced) else self.system.coordinates


def floating_frame(
    system: LinearSystem,
    interfaces: Sequence[str],
    num_modes: int = 0,
    damping_ratio: ArrayLike | None = None,
    method: AbstractReduction | None = None,
) -> FloatingFrame:
    """An elastic body from a free substructure.

    Args:
        system: with the positions of its nodes; free, without supports.
        interfaces: names of nodes with six coordinates each; the first carries the floating frame: it is the one
            nearest to the ground along the tree.
        num_modes: number of normal modes kept in addition to the constraint modes of the interfaces.
        damping_ratio: of the modes with the first interface fixed, in place of the substructure's own damping.
        method: a reduction of `jaxmbs.reductions`; default `CraigBampton(num_modes)`.

    Interfaces with many nodes get six coordinates by `reductions.rigid_node` first.  The rotary inertia of nodes is
    that of nodes with axes fixed in the floating frame.  Stiffening by rotation is neglected (`stiffening` estimates
    the error); a blade or a fast arm should be divided into several bodies, whose frames follow the deformation.

    Raises: ModelError with every fault; ValueError for more modes than there are.  Source: S1 (4)-(9); S2 (35).
    """
    s = system.to_dense()
    outer = interface_rows(s, interfaces)
    assert s.positions is not None  # `interface_rows` refuses a system without
    rigid = rigid_basis(s, s.positions[s.nodes.index(interfaces[0])])
    _check_free(s.stiffness, rigid)
    if method is None:
        check_num_modes(num_modes, s.num_rows - len(outer))
    if len(outer) == s.num_rows:
        method = Unreduced()
    reduced = (CraigBampton(num_modes) if method is None else method).of(s.with_interface(*outer))
    motions, modes = reduced.basis[:, 6 : len(outer)], reduced.basis[:, len(outer) :]
    shapes = jnp.concatenate([motions, _normalise_signs(modes)], axis=1)
    K = shapes.T @ s.stiffness @ shapes
    if damping_ratio is not None and negative(damping_ratio):
        raise ValueError(f"damping_ratio = {damping_ratio} must not be negative")
    if damping_ratio is not None:
        s = _with_modal_damping(s, shapes, K, damping_ratio)
    C = jnp.zeros_like(K) if s.damping is None else shapes.T @ s.damping @ shapes
    Y = jnp.concatenate([rigid, *rotated_shapes(s, shapes), shapes], axis=1)
    at = jnp.asarray(s.positions)[np.array([s.nodes.index(name) for name in interfaces])]
    body = ElasticBody(
        inertia=Y.T @ s.mass @ Y,
        stiffness=_symmetric_part(K),
        damping=_symmetric_part(C),
        places=at[1:] - at[:1],
        interfaces=tuple(interfaces),
    )
    return FloatingFrame(body, shapes, rigid, s)


def _with_modal_damping(s, shapes, K, ratio):
    """The substructure with damping that is modal on the shapes, `M Phi m^-1 C m^-1 Phi^T M`, m = Phi^T M Phi."""
    carried = s.mass @ shapes
    m = shapes.T @ carried
    spread = square.solve(m, carried.T)
    C = spread.T @ modal_damping(K=K, M=m, ratios=ratio) @ spread
    return eqx.tree_at(lambda s: s.damping, s, C, is_leaf=lambda x: x is None)


def _normalise_signs(modes):
    """Normalise the signs of modes so that the largest entry is positive: those of eigenvectors are arbitrary."""
    largest = jnp.argmax(jnp.abs(modes), axis=0)
    sign = jnp.sign(jnp.take_along_axis(modes, largest[None], axis=0))
    return modes * jax.lax.stop_gradient(jnp.where(sign == 0, jnp.ones_like(sign), sign))


def _symmetric_part(A):
    return 0.5 * (A + A.T)


def interface_rows(s: LinearSystem, interfaces) -> tuple[int, ...]:
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


def _check_free(stiffness, rigid):
    """Refuse a concrete stiffness that resists rigid motions.  Raises: ModelError."""
    if not is_concrete(stiffness, rigid):
        return
    K, B = np.asarray(stiffness), np.asarray(rigid)
    size = np.abs(K) @ np.abs(B)
    if np.max(np.abs(K @ B)) > _STRAIN_TOLERANCE[K.dtype.itemsize] * np.max(size):
        raise ModelError(
            [
                "the substructure resists rigid motions: an elastic body must be free, without supports or "
                "springs to ground"
            ]
        )
