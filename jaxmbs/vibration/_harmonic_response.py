"""Response to forces that vibrate: amplitudes over frequencies, as `frequency_response` has them for unit forces."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Complex, Float

from ..blocksparse import BlockMatrix, analyse, factor, solve
from ..linear._storage import dtype_of
from ..linear._system import LinearSystem
from ..typing import ArrayLike
from . import _refined_solve as checked
from ._direct_response import dynamic_stiffness
from ._gains import harmonic_rate


class HarmonicResponse(eqx.Module):
    """Complex amplitudes, of motions `Re(x e^(i w t))`; `system.expand(response.displacement)` is that of what was
    reduced or joined.

    Attributes:
        omega: (frequencies,) [rad/s].
        displacement: (frequencies, n).
        loss: () loss factor of the whole stiffness.
        forces: what was put on the system, by name as it was given.
    """

    omega: Float[Array, " frequencies"]
    displacement: Complex[Array, "frequencies n"]
    loss: Float[Array, ""]
    forces: tuple

    @property
    def velocity(self) -> Complex[Array, "frequencies n"]:
        return harmonic_rate(self.omega, self.displacement) * self.displacement

    @property
    def acceleration(self) -> Complex[Array, "frequencies n"]:
        return harmonic_rate(self.omega, self.displacement) ** 2 * self.displacement

    @property
    def ok(self) -> Bool[Array, " frequencies"]:
        """Whether there is such a motion: an undamped resonance gives numbers that are not finite."""
        return jnp.all(jnp.isfinite(self.displacement), axis=-1)

    def terms(self, system: LinearSystem) -> tuple:
        """What stiffness, damping and mass of the system's parts act on, each (frequencies, n)."""
        x = self.displacement
        return (1.0 + 1j * self.loss.astype(x.dtype)) * x, self.velocity, self.acceleration


def harmonic_response(
    system: LinearSystem, omega: ArrayLike, forces: Mapping | ArrayLike, loss: ArrayLike = 0.0, chunk: int = 32
) -> HarmonicResponse:
    """Amplitudes of motion under forces that vibrate; `reactions(net, response)["bolts"].force` of a network's bonds.

    Args:
        omega: (frequencies,) angular frequencies [rad/s].
        forces: amplitudes as `LinearSystem.load` takes them, real or complex, the same at all frequencies or
            (frequencies, ...).
        loss: loss factor of the whole stiffness.
        chunk: frequencies solved together: memory grows with this and not with their number.

    Raises: UnknownNameError; ValueError for forces that do not fit.  Source: S1 (3), (40)-(41).
    """
    system = system if isinstance(system.stiffness, BlockMatrix) else system.to_dense()
    complex_type = np.result_type(system.dtype, np.complex64)
    omega, loss = (jnp.asarray(value, np.finfo(complex_type).dtype) for value in (omega, loss))
    load = system.load(forces).astype(complex_type)
    shape = *omega.shape, system.num_rows
    if omega.ndim != 1 or load.shape not in (shape, shape[1:]):
        raise ValueError(
            f"forces make loads of shape {load.shape} for omega of shape {omega.shape}: frequencies first"
        )
    solved = jax.checkpoint(_solver(system, lax.complex(jnp.ones_like(loss), loss)))
    load = jnp.broadcast_to(load, shape)
    found = lax.map(lambda row: solved(*row), (omega, load), batch_size=chunk)
    return HarmonicResponse(omega, found, loss, (forces,))


def _solver(system, elastic):
    """Displacements (n,) at one frequency under a load (n,)."""
    K, C, M = system.stiffness, system.damping, system.mass
    K = K.astype(np.result_type(dtype_of(K), np.complex64)) * elastic
    if not isinstance(K, BlockMatrix):
        return lambda w, load: checked.solve(dynamic_stiffness(K, C, M, w), load[:, None])[:, 0]
    plan = analyse(K.pattern)

    def of_blocks(w, load):
        Z = dynamic_stiffness(K, C, M, w)
        return solve(factor(Z, "ldl", plan), load.reshape(K.pattern.shape)).reshape(-1)

    return of_blocks
