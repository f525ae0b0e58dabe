"""Modes of a linearised mechanism."""

import jax
import jax.numpy as jnp

from ..kinematics.state import State
from ..linear.eigenmodes import Modes
from ..math.eigen import eig
from ..model.system import System
from .linearisation import Linearisation, linearise


def modes(mechanism: Linearisation | System, state: State | None = None) -> Modes:
    """Complex modes of the small motions of `linearise(system, state)`, or of a mechanism about a state; on the CPU,
    where LAPACK's general eigenproblem lives.

    Returns: `Modes` by size of the roots; shapes (n + N, m) are coordinates, then velocities of each mode, largest
    entry 1, without derivative.  Roots have derivatives where they are simple or their vectors complete; at a
    defective one (a free motion's pair of zeros) none exists, and zero is returned.
    """
    if not isinstance(mechanism, Linearisation):
        if state is None:
            raise TypeError("modes of a mechanism are those about a state: modes(system, state)")
        mechanism = linearise(mechanism, state)
    roots, shapes, _ = eig(mechanism.state_space.A)
    shapes = jax.lax.stop_gradient(shapes)
    largest = jnp.take_along_axis(shapes, jnp.argmax(jnp.abs(shapes), axis=0)[None], axis=0)
    values = roots.real**2 + roots.imag**2
    return Modes(values, shapes / largest, values == 0, roots)
