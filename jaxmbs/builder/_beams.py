"""Geometrically exact beams as declared: a body at each node, a free joint and an element between neighbours."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, is_concrete
from ..forces import BeamElement, BeamSection
from ..joints import Free
from ..math._linalg import direction, safe_norm
from ..math._screw import screw_of_pose
from ..model._pose import Pose
from ..runtime import as_array, jit
from ._declarations import Body, ForceElement, Joint

#: Largest rotation [rad] between neighbouring nodes without load; the screw is known up to half a turn, which load
#: must not reach.
MOST_TURN = 1.6


def beam_parts(name, section, points, elements, reference) -> tuple[list[Body], list[Joint], list[ForceElement]]:
    """Bodies "name.0" to "name.n" at the nodes, joints and force elements "name.1" to "name.n" before each.

    Raises: TypeError, ValueError with a fault of the declaration.
    """
    points = _nodes(points, elements)
    reference = _references(reference, points)
    sections = _sections(section, len(points) - 1)
    rotations, places, turns, screws, stiffness, masses, inertias = _numbers(points, reference, sections)
    if any_concrete(lambda s: np.linalg.norm(s[:, 3:], axis=1) > MOST_TURN, screws):
        raise ValueError("it bends by more than 1.6 rad from node to node without load: give more points")
    names = [f"{name}.{k}" for k in range(len(points))]
    bodies = [
        Body(names[k], masses[k], (0.0, 0.0, 0.0), inertias[k], Pose(points[k], rotations[k]), any_inertia=True)
        for k in range(len(points))
    ]
    joints, forces = [], []
    for k, (before, after) in enumerate(zip(names[:-1], names[1:], strict=True)):
        place = Pose(places[k], turns[k])
        joints.append(Joint(after, Free(), before, after, place, None, None, is_elastic=True))
        law = BeamElement(stiffness[k], screws[k], sections[k].damping)
        forces.append(ForceElement(after, law, (before, after), None, None))
    return bodies, joints, forces


def _nodes(points, elements):
    """World positions (n + 1, 3) of the nodes."""
    points = _rows("points", points)
    if elements is not None and (isinstance(elements, bool) or not isinstance(elements, int | np.integer)):
        raise TypeError(f"elements is a whole number, got {elements!r}")
    if len(points) < 2 or (elements is not None and elements < 1):
        raise ValueError("it needs two points, and one element")
    if len(points) > 2:
        if elements is not None and elements != len(points) - 1:
            raise ValueError(
                f"elements={elements}, but {len(points)} points are the nodes of {len(points) - 1} elements: leave "
                "elements out, or give the two ends of a straight beam"
            )
        nodes = points
    else:
        share = np.linspace(0.0, 1.0, (8 if elements is None else elements) + 1)[:, None]
        nodes = points[:1] + share * (points[1:] - points[:1])
    if any_concrete(lambda x: np.any(np.linalg.norm(np.diff(x, axis=0), axis=1) == 0.0), nodes):
        raise ValueError("two of its points one after the other are at one place")
    return nodes


def _references(reference, points):
    """Vectors (n + 1, 3) in the local x-y planes of the nodes."""
    reference = _rows("reference", reference, 1)
    if len(reference) not in (1, len(points)):
        raise ValueError(f"reference must be one vector or one at each of {len(points)} nodes, got {len(reference)}")
    reference = jnp.ones_like(points) * reference
    if any_concrete(_is_along, reference, points):
        raise ValueError("its reference, which points to the y axis of the section, lies along the line at a node")
    return reference


def _is_along(reference, points):
    line = np.asarray(_tangents(jnp.asarray(points)))
    across = np.linalg.norm(np.cross(line, reference), axis=1)
    return np.any(across <= 1e-6 * np.linalg.norm(reference, axis=1))


def _rows(what, value, least_dims=2):
    value = as_array(value)
    if value.ndim not in (least_dims, 2) or value.shape[-1] != 3:
        raise ValueError(f"{what} must be vectors of three numbers, (k, 3), got shape {value.shape}")
    if any_concrete(lambda x: ~np.isfinite(x), value):
        raise ValueError(f"{what} must be finite")
    return jnp.atleast_2d(value)


def _sections(section, num_elements):
    """A section for each element."""
    sections = list(section) if isinstance(section, list | tuple) else [section] * num_elements
    for one in sections:
        if not isinstance(one, BeamSection):
            raise TypeError(f"section must be a BeamSection or a list of them, got {type(one).__name__}")
    if len(sections) != num_elements:
        raise ValueError(f"{len(sections)} sections, but {num_elements} elements")
    faults = [fault for one in {id(one): one for one in sections}.values() for fault in one.faults()]
    if faults:
        raise ValueError("section: " + "; ".join(dict.fromkeys(faults)))
    if len({jax.tree.structure(one) for one in sections}) > 1:
        raise ValueError("sections: give all of them a damping, or none")
    if len({one.stiffness.shape for one in sections}) > 1:
        raise ValueError("sections: give the stiffness of all of them as (6,), or as (6, 6)")
    return sections


def _numbers(points, reference, sections):
    """The arrays of a beam, an entry for each node or element: on the host where they are known."""
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *sections)
    arrays = _arrays(points, reference, stacked)
    return jax.tree.map(np.asarray, arrays) if is_concrete(arrays) else arrays


@jit(compile="tape")
def _arrays(points, reference, sections):
    """World rotations of the nodes; place, rotation, screw and stiffness (n, ...) of each from the one before;
    masses and inertias of the nodes."""
    x = _tangents(points)
    z = jax.vmap(direction)(jnp.cross(x, reference))
    rotations = jnp.stack([x, jnp.cross(z, x), z], axis=2)
    turns = rotations[:-1].transpose(0, 2, 1) @ rotations[1:]
    places = jnp.einsum("nji,nj->ni", rotations[:-1], points[1:] - points[:-1])
    screws = jax.vmap(screw_of_pose)(turns, places)
    lengths = jax.vmap(safe_norm)(screws[:, :3])
    stiffness = jax.vmap(BeamSection.element_stiffness)(sections, lengths)
    at_nodes = partial(_shares, lengths)
    inertias = jax.vmap(jnp.diag)(at_nodes(sections.inertia))
    return rotations, places, turns, screws, stiffness, at_nodes(sections.mass), inertias


def _tangents(points):
    """Directions (n + 1, 3) of the line: exact on circles and straight lines, by the circle through three nodes."""
    spans = points[1:] - points[:-1]
    if len(spans) == 1:
        return jnp.stack([direction(spans[0])] * 2)
    along = jax.vmap(direction)(spans)
    weight = 1.0 / jnp.sum(spans**2, axis=1)[:, None]
    inner = spans[:-1] * weight[:-1] + spans[1:] * weight[1:]
    inner = jax.vmap(direction)(inner)
    first = 2.0 * jnp.dot(inner[0], along[0]) * along[0] - inner[0]
    last = 2.0 * jnp.dot(inner[-1], along[-1]) * along[-1] - inner[-1]
    return jnp.concatenate([first[None], inner, last[None]])


def _shares(lengths, per_length):
    """Shares (n + 1, ...) of the nodes in what is per length in the elements (n, ...): half of the elements beside,
    with the end correction of Euler and Maclaurin.

    Without it the moment of inertia of a beam of n elements about its root would be too large by 1 / (2 n^2), with it
    the error falls by the fourth power.  Half each where a share would not be positive, as beside a heavy element.
    """
    whole = per_length * lengths.reshape(-1, *[1] * (per_length.ndim - 1))
    none = jnp.zeros_like(whole[:1])
    halves = (jnp.concatenate([whole, none]) + jnp.concatenate([none, whole])) / 2
    slopes = _slopes_at_nodes(len(lengths))
    correction = jnp.asarray((slopes[:-1] - slopes[1:]) / 12, whole.dtype)
    shares = halves + jnp.tensordot(correction, whole, ((0,), (0,)))
    return jnp.where(jnp.all(shares > 0.0), shares, halves)


def _slopes_at_nodes(num_elements):
    """Derivatives (n + 1, n + 1) at equally spaced nodes of a function given there, to second order."""
    D = np.zeros((num_elements + 1, num_elements + 1))
    if num_elements > 1:
        for k in range(1, num_elements):
            D[k, k - 1], D[k, k + 1] = -0.5, 0.5
        D[0, :3], D[-1, -3:] = (-1.5, 2.0, -0.5), (0.5, -2.0, 1.5)
    return D
