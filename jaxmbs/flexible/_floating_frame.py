"""Elastic bodies from substructures: deformation shapes relative to the first interface, and one inertia matrix."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import distinct_names, is_concrete, negative
from ..errors import ModelError
from ..fem import Structure, assemble
from ..linear._system import LinearSystem
from ..math import _square as square
from ..model._elastic import ElasticBody, body_words
from ..reductions._base import AbstractReduction, Reduced, Unreduced, check_num_modes
from ..reductions._craig_bampton import CraigBampton
from ..runtime import jit
from ..tables import sentence_repr
from ..typing import AnyArray, ArrayLike
from ..vibration._damping import modal_damping
from ._rigid_motions import rigid_basis, rotated_shapes, rows_of_interfaces
from ._second_order import second_order
from ._tension_shapes import has_tension_shapes, with_tension_shapes

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

    __repr__, _repr_html_ = sentence_repr(
        lambda frame: f"{body_words(frame.body)}, of a substructure with {len(frame.shapes)} coordinates"
    )

    def expand(self, x: AnyArray) -> Array:
        """Expand displacements (..., n) of the substructure to (..., whole) of the structure, as
        `fem.element_stresses` takes them, through rigid nodes and earlier reductions."""
        return self.system.expand(x) if isinstance(self.system, Reduced) else jnp.asarray(x)

    @property
    def whole(self) -> tuple[tuple[str, str], ...]:
        """Labels of the coordinates that `expand` returns."""
        return self.system.whole if isinstance(self.system, Reduced) else self.system.coordinates


def floating_frame(
    system: LinearSystem | Structure,
    interfaces: Sequence[str],
    num_modes: int = 0,
    damping_ratio: ArrayLike | None = None,
    method: AbstractReduction | None = None,
    stiffening: bool | Structure = False,
) -> FloatingFrame:
    """An elastic body from a free substructure.

    Args:
        system: with the positions of its nodes; free, without supports.  A structure is assembled.
        interfaces: names of nodes with six coordinates each; the first carries the floating frame: it is the one
            nearest to the ground along the tree.
        num_modes: number of normal modes kept in addition to the constraint modes of the interfaces.
        damping_ratio: of the modes with the first interface fixed, in place of the substructure's own damping.
        method: a reduction of `jaxmbs.reductions`; default `CraigBampton(num_modes)`.  With `stiffening` the
            default has four more shapes for each interface but the first, those of motions across a pull at it, where
            the structure has coordinates enough.
        stiffening: the structure that the system was assembled from, or True where `system` is one: its geometric
            stiffness under the body's own inertia, weight and interface loads stiffens or softens it.  False: strains
            are linear.

    Interfaces with many nodes get six coordinates by `reductions.rigid_node` first.  The rotary inertia of nodes is
    that of nodes with axes fixed in the floating frame.  Without `stiffening`, that by rotation is neglected
    (`flexible.stiffening` estimates the error) and a blade or a fast arm must be divided into several bodies.  With
    it, stresses are those of unit loads on the whole structure, so that the reduced basis needs no axial shapes;
    frequencies come out from above, and that of the lag, whose square is that of the flap less `speed^2`, with the
    larger error: give more modes at high speeds, above all where the body has one interface only.  Deflections are
    moderate: rotations up to some 0.3 rad within the body.

    Raises: ModelError with every fault, of a stiffening without finite elements too; ValueError for more modes than
    there are.  Source: S1 (4)-(9); S2 (35); for the stiffening Wallrapp and Schwertassek (1991).
    """
    if isinstance(system, Structure):
        stiffening, system = system if stiffening is True else stiffening, assemble(system)
    if stiffening is True:
        raise ModelError(
            ["stiffening needs the finite elements: give the Structure as `stiffening`, or in place of the system"]
        )
    s, interfaces = system.to_dense(), distinct_names("interfaces", interfaces)
    outer = rows_of_interfaces(s, interfaces)
    assert s.positions is not None  # `rows_of_interfaces` refuses a system without
    rigid = rigid_basis(s, s.positions[s.nodes.index(interfaces[0])])
    _check_free(s.stiffness, rigid)
    if method is None:
        check_num_modes(num_modes, s.num_rows - len(outer))
    if len(outer) == s.num_rows:
        method = Unreduced()
    if isinstance(stiffening, Structure) and method is None and has_tension_shapes(s, outer, num_modes):
        basis = with_tension_shapes(s, stiffening, outer, num_modes)
    else:
        basis = (CraigBampton(num_modes) if method is None else method).of(s.with_interface(*outer)).basis
    if damping_ratio is not None and negative(damping_ratio):
        raise ValueError(f"damping_ratio = {damping_ratio} must not be negative")
    frame = _frame_of_basis(s, basis, rigid, damping_ratio, tuple(interfaces), outer)
    if not isinstance(stiffening, Structure):
        return frame
    bent = second_order(frame.system, stiffening, frame.shapes, rigid, outer)
    return dataclasses.replace(frame, body=dataclasses.replace(frame.body, stiffening=bent))


@jit(compile="tape")
def _frame_of_basis(s, basis, rigid, damping_ratio, interfaces, outer) -> FloatingFrame:
    """The elastic body on the shapes of a reduced basis (n, m), interface by interface, then modes."""
    motions, modes = basis[:, 6 : len(outer)], basis[:, len(outer) :]
    shapes = jnp.concatenate([motions, _normalise_signs(modes)], axis=1)
    K = shapes.T @ s.stiffness @ shapes
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
        interfaces=interfaces,
        stiffening=None,
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
