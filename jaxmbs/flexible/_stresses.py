"""Stresses and forces in the finite elements of an elastic body over the motion of a mechanism."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..assembly._state import HasStates, State
from ..checks import no_such
from ..errors import ModelError
from ..fem import Structure, gather_rows, scatter_rows
from ..fem._prestress import element_geometric_stiffness
from ..fem._recovery import recover_under_loads
from ..math import _stress as measures
from ..math._extremes import largest
from ..model._entry_points import states_of
from ..model._system import System
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, Reported, reported
from ._floating_frame import FloatingFrame
from ._recovery import along_states, body_motion, find_body, recover_displacements
from ._second_order import structure_rows

_MEASURES = {
    "von_mises": measures.von_mises,
    "signed_von_mises": measures.signed_von_mises,
    "first_principal": lambda tensors: measures.principal(tensors)[..., 0],
    "last_principal": lambda tensors: measures.principal(tensors)[..., 2],
}


@reported
class StressEnvelope(NamedTuple):
    """Extremes of a measure of stress over the states.

    Attributes:
        highest, lowest: by group, (elements, points) [Pa].
        at_highest, at_lowest: their times [s].
    """

    highest: dict[str, Array]
    lowest: dict[str, Array]
    at_highest: dict[str, Array]
    at_lowest: dict[str, Array]

    def report(self) -> Report:
        found = []
        for name in self.highest:
            shape = np.shape(self.highest[name])
            axes = tuple(Axis(kind, np.arange(n)) for kind, n in zip(("element", "point"), shape, strict=True))
            found.append(Quantity(f"{name} highest", self.highest[name], "Pa", axes))
            found.append(Quantity(f"{name} lowest", self.lowest[name], "Pa", axes))
            found.append(Quantity(f"{name} time of highest", self.at_highest[name], "s", axes))
            found.append(Quantity(f"{name} time of lowest", self.at_lowest[name], "s", axes))
        return Report(found)

    @property
    def peak(self) -> Float[Array, ""]:
        """The highest value of all [Pa]."""
        return largest(jnp.stack([largest(one) for one in self.highest.values() if one.size]))


class Stresses(Reported, eqx.Module):
    """Stresses of an elastic body at states of a mechanism; times come first.

    Attributes:
        structure: its finite elements.
        times: (...) of the states [s].
        components: by group, (..., elements, labels) [Pa], columns as `element.stress_labels`.
        forces: by group, (..., elements, labels) [N, N m], columns as `element.force_labels`.
    """

    structure: Structure
    times: Float[Array, "..."]
    components: dict[str, Array]
    forces: dict[str, Array]

    def report(self) -> Report:
        found = []
        for name, group in self.structure.groups.items():
            for what, values, labels, unit in (
                ("stress", self.components[name], group.element.stress_labels, "Pa"),
                ("load", self.forces[name], group.element.force_labels, "N or N m"),
            ):
                own = Axis("component", labels)  # of a beam the labels of stresses are a sentence
                own = own if len(labels) == values.shape[-1] else numbered("component", values.shape[-1])
                element = Axis("element", np.arange(values.shape[-2]))
                found.append(Quantity(f"{name} {what}", values, unit, (element, own)))
        return Report(found, t=self.times)

    @property
    def tensors(self) -> dict[str, Array]:
        """Tensors xx yy zz xy yz zx (..., elements, points, 6) [Pa] by group, in the elements' own axes.

        Points are the fibres of a beam at its first, then at its second end; top and bottom of a shell; the middle
        of a solid.  Elements without stresses, such as springs, have none.
        """
        groups = self.structure.groups
        return {name: groups[name].element.stress_tensors(found) for name, found in self.components.items()}

    def measure(self, name: str = "von_mises") -> dict[str, Array]:
        """Values (..., elements, points) [Pa] by group.

        Args: name: "von_mises"; "signed_von_mises", with the sign of the sum of normal stresses, for cycles of
            fatigue; "first_principal" or "last_principal", the most and the least tensile.

        Raises: ValueError for another name.
        """
        if name not in _MEASURES:
            raise ValueError(f"name: {no_such('measure of stress', name, _MEASURES)}")
        return {group: _MEASURES[name](tensors) for group, tensors in self.tensors.items()}

    def envelope(self, name: str = "von_mises") -> StressEnvelope:
        """Extremes of a measure over the states, and their times.

        They are those of the states given, and have the derivatives of the values there.

        Raises: ValueError for another name, as `measure`.
        """
        times, values = jnp.ravel(self.times), self.measure(name)
        rows = {group: v.reshape(len(times), *v.shape[self.times.ndim :]) for group, v in values.items()}
        top = {group: jnp.argmax(v, axis=0) for group, v in rows.items()}
        low = {group: jnp.argmin(v, axis=0) for group, v in rows.items()}

        def taken(at):
            return {group: jnp.take_along_axis(v, at[group][None], axis=0)[0] for group, v in rows.items()}

        return StressEnvelope(taken(top), taken(low), *({g: times[at[g]] for g in rows} for at in (top, low)))

    def at_nodes(self, name: str = "von_mises") -> Float[Array, "... nodes"]:
        """Values [Pa] at the nodes, the mean over elements that meet there of the largest of their points; zero
        at nodes of none.  They are `values` of `viz.plot_structure`.

        Raises: ValueError for another name, as `measure`.
        """
        axes, dtype = self.times.shape, self.times.dtype
        total, count = jnp.zeros((*axes, self.structure.num_nodes), dtype), np.zeros(self.structure.num_nodes)
        for group, values in self.measure(name).items():
            element, where = self.structure.groups[group].element, self.structure.groups[group].connections
            if values.shape[-1] == 0:
                continue
            parts = jnp.split(values, 2, axis=-1) if element.has_ends else [values] * element.num_nodes
            largest = jnp.stack([part[..., 0] if part.shape[-1] == 1 else _largest(part) for part in parts], axis=-1)
            total = total.at[..., where].add(largest.astype(total.dtype))
            np.add.at(count, where, 1.0)
        return total / jnp.broadcast_to(jnp.asarray(np.maximum(count, 1.0), dtype), total.shape)


def _largest(values):
    """Value of the largest size along the last axis, with its sign."""
    place = jnp.argmax(jnp.abs(values), axis=-1)
    return jnp.take_along_axis(values, place[..., None], axis=-1)[..., 0]


def stresses(
    system: System, motion: State | HasStates, name: str, frame: FloatingFrame, structure: Structure
) -> Stresses:
    """Stresses and element forces of an elastic body at a state or along a motion.

    Args:
        name: of the elastic body, made from `frame.body`.
        structure: the finite elements that its substructure was assembled from.

    Displacements are those of `displacements`, by the balance of forces with the inertia of the whole motion.  End
    forces of beams have the inertia and weight spread over them taken off, so that they are right for any mesh.  Of
    a body with stiffening the loads of its geometric stiffness count: tension lowers the moments of a bent blade.

    Raises: UnknownNameError; ModelError for a structure of another substructure.
    Source: S1 (30)-(31); Wallrapp and Schwertassek (1991).
    """
    find_body(system, name)
    rows, faults = structure_rows(frame.system, structure)
    if faults:
        raise ModelError(faults, "the structure")

    states = states_of(system, motion)

    def values(here, state):
        motion = body_motion(here, name, frame, state)
        return _at_state(structure, frame, motion, np.array(rows, int))

    components, forces = along_states(system, values, states)
    times = jnp.broadcast_to(states.t, states.coordinates.shape[:-1])
    return Stresses(structure, times, components, forces)


def _at_state(structure, frame, motion, rows):
    """Stresses and forces by group of one state."""

    def at_nodes(x):
        return scatter_rows(structure, frame.expand(x)[rows])

    loads = _spread_loads(structure, motion, at_nodes)
    x = recover_displacements(frame, motion)
    if frame.body.stiffening is not None:
        bending = _geometric_loads(structure, at_nodes(x), at_nodes(motion.x))
        loads = {name: load + bending[name] for name, load in loads.items()}
        whole = jnp.zeros(len(frame.whole), x.dtype)
        whole = whole.at[rows].set(gather_rows(structure, _sum_at_nodes(structure, bending)))
        more = jax.linear_transpose(frame.expand, x)(whole)[0]
        x = recover_displacements(frame, motion._replace(load=motion.load + more))
    u = at_nodes(x)
    return tuple(recover_under_loads(structure, u, what, loads) for what in ("stresses", "forces"))


def _spread_loads(structure, motion, at_nodes):
    """Weight less the rate of momenta of each element (elements, n) by group, in the axes of the body."""
    y, y_dot = at_nodes(motion.y), at_nodes(motion.y_dot)
    fall = y_dot.at[:, :3].add(-motion.gravity)

    def load(element, nodes, fall, y):
        mass, shape = element.mass(nodes), (element.num_nodes, element.coordinates)
        momenta = (mass @ y.reshape(-1)).reshape(shape)
        turning = jnp.zeros_like(momenta).at[:, :3].set(jnp.cross(motion.spin[None], momenta[:, :3]))
        return -(mass @ fall.reshape(-1)) - turning.reshape(-1)

    found = {}
    for name, group in structure.groups.items():
        own = [v[group.connections, : group.element.coordinates] for v in (fall, y)]
        found[name] = group.map(load, structure.positions, *own)
    return found


def _geometric_loads(structure, u, moved):
    """Loads (elements, n) by group of the stress of displacements u on displacements (nodes, 6), `-K_g(u) x`."""
    found = {}
    for name, group in structure.groups.items():
        x = moved[group.connections, : group.element.coordinates].reshape(len(group.nodes), -1)
        found[name] = jnp.zeros_like(x)
        if group.element.has_geometric_stiffness:
            found[name] = -jnp.einsum("eij,ej->ei", element_geometric_stiffness(structure, name, u), x)
    return found


def _sum_at_nodes(structure, loads):
    """Loads (nodes, 6) of all elements."""
    total = jnp.zeros((structure.num_nodes, 6), structure.positions.dtype)
    for name, load in loads.items():
        group = structure.groups[name]
        shape = *group.connections.shape, group.element.coordinates
        total = total.at[group.connections, : shape[-1]].add(load.reshape(shape))
    return total
