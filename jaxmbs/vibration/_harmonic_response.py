"""Harmonic response: complex amplitudes over frequencies under given forces."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Complex, Float

from ..blocksparse import BlockMatrix, analyse, factor, solve
from ..checks import require_numbers
from ..linear._block_rows import from_blocks, to_blocks
from ..linear._block_statics import factor_kind
from ..linear._storage import dtype_of
from ..linear._system import LinearSystem
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, Reported, failures
from ..runtime import jit
from ..typing import ArrayLike
from . import _refined_solve as refined_solve
from ._direct_response import dynamic_stiffness
from ._gains import harmonic_rate


class HarmonicResponse(Reported, eqx.Module):
    """Complex amplitudes of a motion `Re(x e^(i w t))`; `system.expand(response.displacement)` gives all coordinates
    of a reduced or joined system.

    Attributes:
        omega: (frequencies,) [rad/s].
        displacement: (frequencies, n) [m, rad].
        loss: () loss factor of the whole stiffness.
        forces: the forces that were given, for `reactions`.
    """

    omega: Float[Array, " frequencies"]
    displacement: Complex[Array, "frequencies n"]
    loss: Float[Array, ""]
    forces: tuple

    def report(self) -> Report:
        frequency = Axis("frequency", np.asarray(self.omega) / (2 * np.pi), "Hz")
        axes = (frequency, numbered("coordinate", self.displacement.shape[-1]))
        found = [Quantity("displacement", self.displacement, "m or rad", axes), Quantity("loss factor", self.loss)]
        return Report(found, f"{len(self.omega)} frequencies", failures(self.ok, "frequencies not finite"))

    @property
    def velocity(self) -> Complex[Array, "frequencies n"]:
        return harmonic_rate(self.omega, self.displacement) * self.displacement

    @property
    def acceleration(self) -> Complex[Array, "frequencies n"]:
        return harmonic_rate(self.omega, self.displacement) ** 2 * self.displacement

    @property
    def ok(self) -> Bool[Array, " frequencies"]:
        """True where the amplitudes are finite, which they are not at an undamped resonance."""
        return jnp.all(jnp.isfinite(self.displacement), axis=-1)

    def terms(self, system: LinearSystem) -> tuple:
        """Displacement, velocity and acceleration (frequencies, n) on which K, C and M act."""
        x = self.displacement
        return (1.0 + 1j * self.loss.astype(x.dtype)) * x, self.velocity, self.acceleration


def harmonic_response(
    system: LinearSystem, omega: ArrayLike, forces: Mapping | ArrayLike, loss: ArrayLike = 0.0, chunk: int = 32
) -> HarmonicResponse:
    """Amplitudes of motion under harmonic forces.

    `reactions(net, response)["bolts"].force` then gives the forces of the bonds of a network.

    Args:
        omega: (frequencies,) angular frequencies [rad/s].
        forces: amplitudes as `LinearSystem.load` takes them, real or complex, the same at all frequencies or
            (frequencies, ...).
        loss: loss factor of the whole stiffness.
        chunk: frequencies solved together: memory grows with this and not with their number.

    Raises: UnknownNameError; ValueError for forces that do not fit.  Source: S1 (3), (40)-(41).
    """
    require_numbers(omega=omega, loss=loss)
    system = system if isinstance(system.stiffness, BlockMatrix) else system.to_dense()
    complex_type = np.result_type(system.dtype, np.complex64)
    omega, loss = (jnp.asarray(value, np.finfo(complex_type).dtype) for value in (omega, loss))
    load = system.load(forces).astype(complex_type)
    shape = *omega.shape, system.num_rows
    if omega.ndim != 1 or load.shape not in (shape, shape[1:]):
        raise ValueError(
            f"the load has shape {load.shape} for omega of shape {omega.shape}: the frequencies must be "
            "its first axis"
        )
    load = jnp.broadcast_to(load, shape)
    found = _respond(system.stiffness, system.damping, system.mass, system.block_rows, omega, load, loss, chunk)
    return HarmonicResponse(omega, found, loss, (forces,))


@jit
def _respond(K, C, M, rows, omega, load, loss, chunk):
    """Displacements (frequencies, n) under loads (frequencies, n)."""
    K = K.astype(np.result_type(dtype_of(K), np.complex64)) * lax.complex(jnp.ones_like(loss), loss)
    is_dense = not isinstance(K, BlockMatrix)
    plan, kind = (None, None) if is_dense else (analyse(K.pattern), factor_kind(K, C, M))

    @jax.checkpoint
    def at(w, load):
        Z = dynamic_stiffness(K, C, M, w)
        if is_dense:
            return refined_solve.refined_solve(Z, load[:, None])[:, 0]
        return from_blocks(solve(factor(Z, kind, plan), to_blocks(load, K.pattern, rows)), rows)

    return lax.map(lambda row: at(*row), (omega, load), batch_size=chunk)
