"""The state of a mechanism, as rooms below its assembly read it."""

import equinox as eqx
from jaxtyping import Array, Float

from ._changes import Changes
from ._internal_states import InternalStates


class AbstractState(eqx.Module):
    """A state of a mechanism: `State`, which `assembly` finds.

    Attributes:
        t: (...) [s]; coordinates, velocities: (..., nq), (..., nv) of the tree's joints.
        structure: the layout of the system that it was made for; None by hand.
        internal: internal states of force elements; changes: numbers that events have changed.
    """

    t: eqx.AbstractVar[Float[Array, "..."]]
    coordinates: eqx.AbstractVar[Float[Array, "... nq"]]
    velocities: eqx.AbstractVar[Float[Array, "... nv"]]
    structure: eqx.AbstractVar[tuple | None]
    internal: eqx.AbstractVar[InternalStates | None]
    changes: eqx.AbstractVar[Changes | None]
