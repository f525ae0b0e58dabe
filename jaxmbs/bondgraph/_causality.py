"""Causality: integral wherever a momentum is a state of its own, derivative where others determine it.

The bonds are vectors, so inertias claim the independent velocities component by component, in the order of the
bodies, turning before sliding, as the sequential assignment procedure does bond by bond.  Whether a component is
still free depends on the moduli of the transformers, hence on the pose: it is counted at a state.
"""

import dataclasses

import jax.numpy as jnp
import numpy as np

from ..assembly._assembly import assemble_in_trace
from ..assembly._state import State
from ..checks import is_concrete
from ..constraints._kic import velocity_map
from ..constraints._mobility import with_mobility_at
from ..kinematics._configuration import at_state
from ..kinematics._poses import neutral_coordinates, node_parameters, normalise, step_coordinates
from ..model._changes import with_changes
from ..model._entry_points import check_state, check_system
from ..model._system import System
from ..runtime import jit
from ._elastic import NUM_RIGID, elastic_names
from ._elements import Storage
from ._graph import BondGraph
from ._values import body_moduli
from ._views import build_view, root_sizes

_RANK_TOLERANCE = {8: 1e-8, 4: 1e-3}  # parts of a row that count as new, by precision


def bond_graph(system: System, view: str = "hamiltonian", state: State | None = None) -> BondGraph:
    """The bond graph of a mechanism with half arrows and causal strokes.

    Args:
        view: "detailed": inertias of every body behind transformers G_r, G_t (Fig. 2), with compliances C,
            resistors R, sources Se and drives Sf; "inertia": their equivalent field I* with the gyristor GR (Fig. 3);
            "hamiltonian": the same with all ports summed to Q (Fig. 4).
        state: the pose at which dependent inertias are found (default: a pose in general position).

    An elastic body is an inertia on its flow, behind G_y in the detailed view, with a gyristor for what turns its
    momenta (neither conserves alone), its weight, and its strains as C and R.  Strokes are left out while the system
    is traced.

    Raises: ValueError for an unknown view, ModelError when nothing moves, AssemblyError when no pose can be found.
    Source: S2 (28)-(44), (56)-(76), Figs 2-4.
    """
    check_system(system)
    if state is not None:
        check_state(system, state)
        system = with_mobility_at(with_changes(system, state), state)
    graph = build_view(system, view)
    if not is_concrete(system, state):
        return graph
    if view != "detailed":
        return assign_causality(graph, _field_storages(system, graph))
    state = general_pose(system) if state is None else state
    return assign_causality(graph, _body_storages(system, graph, _moduli_at(system, state)))


def general_pose(system: System) -> State:
    """Assembled state in general position, with all velocities zero."""
    # any seed, since ranks are those of almost every pose; a fixed one, so that a graph is the same in every call
    top, random = system.topology, np.random.default_rng(11)
    if system.has_constraints:
        state = State.at(system)
    else:
        psi = jnp.asarray(neutral_coordinates(top))
        state = State(jnp.zeros((), psi.dtype), psi, jnp.zeros(top.num_velocities, psi.dtype))
    move = jnp.asarray(0.3 * random.normal(size=top.num_velocities), state.coordinates.dtype)
    return State(
        state.t, _step_along_freedoms(system, state, move), jnp.zeros_like(state.velocities), structure=top.structure
    )


@jit(compile="tape")
def _step_along_freedoms(system, state, move):
    """Coordinates after a step along the freedoms, with the loops closed."""
    top = system.topology
    away = velocity_map(system, at_state(system, state, inertias=False))[0]
    psi = normalise(top, step_coordinates(top, state.coordinates, away @ (away.T @ move)))
    if not system.has_constraints:
        return psi
    free = jnp.ones(top.num_velocities, psi.dtype)
    return assemble_in_trace(system, psi, state.velocities, state.t, free, free)[0]


@jit(compile="tape")
def _moduli_at(system, state):
    return body_moduli(system, node_parameters(system), state.coordinates, state.t)


def _field_storages(system, graph) -> tuple[Storage, ...]:
    """I* holds the momenta of phi_dot as states; its port at the drives follows their flow."""
    return tuple(
        Storage("I*", root, size * (root == "phi_dot"), size * (root == "drives"), 0)
        for root, size in root_sizes(system).items()
    )


def _inertia_rows(system, moduli) -> dict:
    """Rows (k, N + D) of the moduli by inertia, turning multiplied by the length of the system."""
    rigid, elastic = moduli[0], moduli[1]
    turning, rows = float(system.length), {}
    for k, body in enumerate(system.topology.body_names):
        rows |= {f"I:{body}": turning * np.asarray(rigid[k, :3]), f"m:{body}": np.asarray(rigid[k, 3:])}
    for inertia, _, g, i in elastic_names(system):
        unit = np.ones(len(elastic[g][i]))
        others = len(system.elastic[g].frames[i]) - 1
        unit[:3] = turning
        unit[NUM_RIGID : NUM_RIGID + 6 * others].reshape(others, 2, 3)[:, 1] = turning
        rows[inertia] = unit[:, None] * np.asarray(elastic[g][i])
    return rows


def _body_storages(system, graph, moduli) -> tuple[Storage, ...]:
    """Storages of the bodies' inertias, from `body_moduli`."""
    N, inertias = root_sizes(system).get("phi_dot", 0), _inertia_rows(system, moduli)
    small, basis, found = _RANK_TOLERANCE[moduli[0].dtype.itemsize], np.zeros((0, N)), []
    largest = max(np.max(np.abs(rows)) for rows in inertias.values())
    for element in (e for e in graph.elements if e.is_inertia):
        rows = inertias[element.name]
        moving = int(np.sum(np.max(np.abs(rows), axis=1) > small * largest))
        before, basis = len(basis), _extend_basis(basis, rows[:, :N], small)
        new = len(basis) - before
        junction = graph.inward(element.name)[0][1]
        found.append(Storage(element.name, junction, new, moving - new, len(rows) - moving))
    return tuple(found)


def _extend_basis(basis, rows, small):
    """Orthonormal basis (r, N) extended by the span of the rows (Gram-Schmidt, twice against rounding)."""
    for row in rows:
        rest = row - (row @ basis.T) @ basis
        rest = rest - (rest @ basis.T) @ basis
        if np.linalg.norm(rest) > small * max(np.linalg.norm(row), np.finfo(float).tiny):
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
    return basis


def assign_causality(graph: BondGraph, storages: tuple[Storage, ...]) -> BondGraph:
    """The graph with its strokes: efforts run inwards to the roots, but outwards to inertias that hold states of
    their own (integral causality) and to the drives, which set flows.  Bonds inside of elements have theirs."""
    outward = {("drive", "drives")}
    for storage in storages:
        if storage.independent:
            outward |= _path_to_root(graph, storage.name)
    bonds = []
    for bond in graph.bonds:
        inner, outer = sorted((bond.tail, bond.head), key=graph.order.__getitem__)
        end = outer if (outer, inner) in outward else inner
        stroke = bond.stroke or ("head" if end == bond.head else "tail")
        bonds.append(dataclasses.replace(bond, stroke=stroke))
    return dataclasses.replace(graph, bonds=tuple(bonds), storages=storages)


def _path_to_root(graph, name):
    """Pairs (outer, inner) of the elements from an inertia to the root phi_dot."""
    for _, inner, _ in graph.inward(name):
        if inner == "phi_dot":
            return {(name, inner)}
        way = _path_to_root(graph, inner)
        if way:
            return way | {(name, inner)}
    return set()
