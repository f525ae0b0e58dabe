"""Stresses at points of the sections of geometrically exact beams over the motion of a mechanism."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jax import lax

from ..assembly._state import HasStates, State
from ..elements import Beam
from ..errors import ModelError
from ..fem import Structure
from ..forces import BeamElement
from ..math._screw import pose_of_screw
from ..model._entry_points import states_of
from ..model._system import System
from ._section_forces import beam_places, section_forces
from ._stresses import Stresses


def section_stresses(
    system: System, motion: State | HasStates, name: str, section: Beam | Sequence[Beam]
) -> Stresses:
    """Stresses of the fibres of an exact beam, at both ends of each element, at a state or along a motion.

    Args:
        name: of the beam, as `SystemBuilder.beam` has it.
        section: its area, second moments and `fibres`, and what else of an `elements.Beam` stresses ask; one, or one
            for each element.  Its stiffness and mass are not used: `BeamSection` has them.

    Group "beam" of the structure has the elements, node k is "name.k", at its place without load in the axes of the
    first section.  Envelopes, measures and histories are those of `stresses`.

    Raises: UnknownNameError; ModelError for sections that are no `elements.Beam`, or not one for each element.
    """
    places = beam_places(system, name)
    given = list(section) if isinstance(section, list | tuple) else [section] * len(places)
    if not all(isinstance(one, Beam) for one in given) or len(given) != len(places):
        raise ModelError(
            [f"section: give an elements.Beam, or one for each of the {len(places)} elements of {name!r}"]
        )
    structure = _structure(system, name, places, section if isinstance(section, Beam) else given)
    forces = section_forces(system, motion, name)
    states, group = states_of(system, motion), structure.groups["beam"]
    ends = jnp.concatenate([-forces[..., 0, :], forces[..., 1, :]], axis=-1)  # on the element, as of `Beam.forces`
    of_element = jax.vmap(lambda element, ends: element.stresses_of_ends(ends), (None if group.shared else 0, 0))
    flat = ends.reshape(-1, *ends.shape[-2:])
    found = jax.vmap(lambda ends: of_element(group.element, ends))(flat)
    components = found.reshape(*ends.shape[:-1], found.shape[-1])
    times = jnp.broadcast_to(states.t, states.coordinates.shape[:-1])
    return Stresses(structure, times, {"beam": components}, {"beam": ends})


def _structure(system, name, places, sections):
    """The beam without load as a structure, its first section at the origin."""
    laws = [group.law.screw for group in system.forces if isinstance(group.law, BeamElement)]
    turns, steps = jax.vmap(pose_of_screw)(jnp.concatenate(laws)[places])

    def advance(pose, step):
        rotation, place = pose[0] @ step[0], pose[1] + pose[0] @ step[1]
        return (rotation, place), place

    start = jnp.eye(3, dtype=steps.dtype), jnp.zeros(3, steps.dtype)
    nodes = jnp.concatenate([start[1][None], lax.scan(advance, start, (turns, steps))[1]])
    names = [f"{name}.{k}" for k in range(len(nodes))]
    pairs = list(zip(names[:-1], names[1:], strict=True))
    return Structure({one: nodes[k] for k, one in enumerate(names)}, {"beam": (sections, pairs)})
