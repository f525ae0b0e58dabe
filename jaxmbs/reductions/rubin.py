"""Free-interface modes with residual attachment modes, their mass kept (Rubin 1975)."""

from collections.abc import Sequence

from .base import Reduced
from .mixed import mixed


def rubin(
    stiffness, mass, interface: Sequence[int], num_modes: int, damping=None, load=None, num_rigid: int | None = None
) -> Reduced:
    """Interface displacements and the lowest free modes, rigid ones included.

    What the discarded modes add statically (residual attachment modes) is in the space, with its mass; frequencies
    come from above.  See `mixed`.
    Source: S1 (4)-(8).
    """
    return mixed(stiffness, mass, interface, num_modes, damping, (), load, num_rigid)
