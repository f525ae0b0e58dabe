"""Forces and moments in the cross sections of geometrically exact beams over the motion of a mechanism."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..assembly._state import HasStates, State
from ..checks import no_such
from ..errors import UnknownNameError
from ..forces import BeamElement
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..model._system import System
from ._recovery import along_states


def section_forces(system: System, motion: State | HasStates, name: str) -> Float[Array, "... elements 2 6"]:
    """Section forces of an exact beam: tension and shears [N], torque and bending moments [N m].

    Args: name: of the beam, as `SystemBuilder.beam` has it.

    They act at both ends of each element, in the axes of the cross section there, on the part of the beam before it:
    positive tension pulls.  Between nodes nothing is loaded, so that they follow from each other by statics; the
    material's damping is in them.  Stress of a fibre at (y, z) is `N / A - M_z y / I_z + M_y z / I_y`.

    Returns: (..., elements, 2, 6) in the order N, Qy, Qz, T, My, Mz.

    Raises: UnknownNameError.  Source: Sonneville, Cardona and Bruls (2014).
    """
    places = beam_places(system, name)

    def at(system, state):
        here = with_velocities(system, at_state(system, state, inertias=False), state.velocities)
        found = [_of_group(system, group, here) for group in system.forces if isinstance(group.law, BeamElement)]
        return jnp.concatenate(found)[places]

    return along_states(system, at, motion)


def beam_places(system: System, name: str) -> np.ndarray:
    """Places of the elements of a beam among all of the system, in order.  Raises: UnknownNameError."""
    names = [one for group in system.forces if isinstance(group.law, BeamElement) for one in group.names]
    beams = dict.fromkeys(one.rpartition(".")[0] for one in names)
    if name not in beams or not name:
        raise UnknownNameError(no_such("exact beam", name, [beam for beam in beams if beam]))
    own = sorted((int(one.rpartition(".")[2]), k) for k, one in enumerate(names) if one.rpartition(".")[0] == name)
    return np.array([k for _, k in own])


def _of_group(system, group, here):
    """Section forces (elements, 2, 6) of a group of elements."""

    def of_element(law, displacement, flow):
        (R, d), rates = group.port.arguments(displacement, flow)
        force, moment = law.wrench(R, d, *rates, here.t)  # of the element on B, in A axes
        force, moment = -force, -moment
        first = jnp.concatenate([force, moment + jnp.cross(d, force)])
        return jnp.stack([first, jnp.concatenate([force @ R, moment @ R])])

    _, displacements, flows = element_flows(system, group, here, here.V, here.u)
    return jax.vmap(of_element)(group.law, displacements, flows)
