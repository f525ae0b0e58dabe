"""Virtual work of bonds and loads on a component, in its coordinates and in rigid, constraint and normal motions."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..linear._storage import as_inexact
from ..linear._system import LinearSystem
from ..tables import sentence_repr
from ..typing import AnyArray, ArrayLike


class VirtualMotions(eqx.Module):
    """Virtual motions `u = shapes rho` of a component by `Hurty.motions`: rigid (R), constraint (C), normal (N).

    Attributes:
        shapes: (n, r), columns R, C, N in turn.
        counts: numbers of R, C and N; a statically determinate bond has a rigid motion, a redundant one a constraint
            motion.
        interface: row numbers of the bonds.
    """

    shapes: Inexact[Array, "n r"]
    counts: tuple[int, int, int] = eqx.field(static=True)
    interface: tuple[int, ...] = eqx.field(static=True)

    __repr__, _repr_html_ = sentence_repr(
        lambda motions: (
            "{} rigid, {} constraint and {} normal motions".format(*motions.counts)
            + f" of {len(motions.shapes)} coordinates, {len(motions.interface)} of them at bonds"
        )
    )

    def bond_displacements(self, rho: AnyArray) -> Array:
        """Displacements `u~ = phi~ rho` (..., b) of the bonds for rho (..., r), in the order of the interface.

        Source: S1 (14), (20).
        """
        rho = as_inexact(rho)
        return jnp.matmul(rho, self._at_bonds().T.astype(rho.dtype))

    def generalised_forces(self, reactions: ArrayLike = 0.0, forces: ArrayLike = 0.0) -> Array:
        """Generalised forces `P = phi~^T R + F` (..., r) of bonds and loads along rho.

        Args: reactions: (..., b) of the bonds on the component, in the order of its interface; forces: (..., n) loads
            on all coordinates, distributed ones (`fem.body_load`, `line_load`, `pressure_load`) included.

        Source: S1 (15)-(19).
        """
        parts = [(as_inexact(a), A) for a, A in ((reactions, self._at_bonds()), (forces, self.shapes)) if np.ndim(a)]
        dtype = np.result_type(*(a.dtype for a, _ in parts)) if parts else self.shapes.dtype
        found = [jnp.matmul(a.astype(dtype), A.astype(dtype)) for a, A in parts]
        shape = np.broadcast_shapes(self.shapes.shape[1:], *(P.shape for P in found))
        return sum((jnp.broadcast_to(P, shape) for P in found), jnp.zeros(shape, dtype))

    def _at_bonds(self):
        return self.shapes[np.array(self.interface, int)]


def virtual_work(
    system: LinearSystem,
    displacement: AnyArray,
    reactions: ArrayLike | None = None,
    forces: Mapping | ArrayLike | None = None,
) -> Inexact[Array, "..."]:
    """Virtual work `dW = sum R . du~ + sum F . du` (...) [J] of bonds and loads.

    Args:
        displacement: du, virtual displacements (..., n).
        reactions: R (..., b) of the bonds on the component, in the order of its interface.
        forces: F as in `LinearSystem.load`, or (..., n).

    For a motion `M x'' + C x' + K x = F + R` it equals the virtual work of inertia, damping and stiffness; over all
    joined components the work of the bonds adds up to zero.

    Raises: ValueError for reactions that are not one per interface coordinate.  Source: S1 (13), (16), (25).
    """
    displacement = as_inexact(displacement)
    work = jnp.zeros(displacement.shape[:-1], displacement.dtype)
    if forces is not None:
        work = _work_along(displacement, as_inexact(system.load(forces)))
    if reactions is not None:
        reactions = as_inexact(reactions)
        if reactions.shape[-1:] != (system.num_interface,):
            raise ValueError(f"reactions have shape {reactions.shape}, not (..., {system.num_interface})")
        work = work + _work_along(displacement[..., np.array(system.interface, int)], reactions)
    return work


def _work_along(displacement, force):
    dtype = np.result_type(displacement.dtype, force.dtype)
    shape = np.broadcast_shapes(displacement.shape, force.shape)
    u, f = (jnp.broadcast_to(a, shape).astype(dtype) for a in (displacement, force))
    return jnp.sum(u * f, axis=-1)
