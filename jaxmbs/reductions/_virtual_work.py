"""Virtual work of bonds and loads on a component, in its coordinates and in its rigid, constraint, normal motions."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..linear._storage import as_inexact
from ..linear._system import LinearSystem
from ..typing import AnyArray, ArrayLike


class VirtualMotions(eqx.Module):
    """Motions `u = shapes rho` of a component, as `Hurty.motions` gives them: rigid (R), constraint (C), normal (N).

    Attributes:
        shapes: (n, r), columns R, C, N in turn.
        counts: how many of each; a bond that is statically determinate has a rigid motion, a redundant one a
            constraint motion.
        interface: rows of the bonds.
    """

    shapes: Inexact[Array, "n r"]
    counts: tuple[int, int, int] = eqx.field(static=True)
    interface: tuple[int, ...] = eqx.field(static=True)

    def bond_displacements(self, rho: AnyArray) -> Array:
        """Displacements (..., b) of the bonds, `u~ = phi~ rho` of (..., r), in the order of the interface.

        Source: S1 (14), (20).
        """
        rho = as_inexact(rho)
        return jnp.matmul(rho, self._at_bonds().T.astype(rho.dtype))

    def generalised_forces(self, reactions: ArrayLike = 0.0, forces: ArrayLike = 0.0) -> Array:
        """What does the work of bonds (..., b) and loads (..., n) along rho: `P = phi~^T R + F` (..., r).

        Args: reactions: what the bonds put on the component, in the order of its interface; forces: loads on all
            coordinates, those of distributed ones (`fem.body_load`, `line_load`, `pressure_load`) among them.

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
    """`dW = sum R . du~ + sum F . du` (...) [J] of bonds and loads along a virtual displacement (..., n).

    Args:
        reactions: (..., b) what the bonds put on the component, in the order of its interface.
        forces: loads as `LinearSystem.load` takes them, or (..., n).

    A component that moves as `M x'' + C x' + K x = F + R` takes from these forces what its inertia, damping and
    stiffness do along the same displacement; over all components joined the work of the bonds adds up to zero.

    Raises: ValueError for reactions that are not one for each interface coordinate.  Source: S1 (13), (16), (25).
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
