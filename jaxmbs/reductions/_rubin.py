"""Rubin reduction: free-interface modes with residual attachment modes, whose mass is kept (Rubin 1975)."""

import equinox as eqx
from jaxtyping import Array, Float

from ..elements._base import as_optional_real
from ..linear._system import LinearSystem
from ._base import AbstractReduction, Reduced
from ._mixed import Mixed


class Rubin(AbstractReduction):
    """Rubin reduction: interface displacements and the lowest free modes, rigid ones included.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, whose scale and signs are arbitrary.

    The static contribution of the discarded modes (residual attachment modes) is in the space, with its mass;
    frequencies are approximated from above.  It is `Mixed` with nothing fixed.

    Attributes: as of `Mixed`.  Source: S1 (4)-(8).
    """

    num_modes: int = eqx.field(static=True)
    load: Float[Array, "c c"] | None = eqx.field(converter=as_optional_real, default=None)
    num_rigid: int | None = eqx.field(static=True, default=None)

    def of(self, system: LinearSystem) -> Reduced:
        return Mixed(self.num_modes, (), self.load, self.num_rigid).of(system)
