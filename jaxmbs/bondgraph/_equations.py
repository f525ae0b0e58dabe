"""The state equations read back from a graph: sums at the junction of phi_dot, inertias seen through transformers."""

import jax.numpy as jnp
from jaxtyping import Array

from ..assembly._state import State
from ..constraints._mobility import independent_state_function
from ..kinematics._poses import node_parameters
from ..math._spd import spd_solve
from ..model._system import System
from ._elastic import elastic_names
from ._inner_graph import InnerValues, inner_values
from ._naming import name_values, split_by_root
from ._power import leaf_efforts, propagate
from ._values import graph_values
from ._views import build_view


@independent_state_function
def graph_state_equations(system: System, state: State, view: str = "hamiltonian") -> tuple[Array, Array, Array]:
    """State equations read off the graph of a view: (p_dot (N,), phi_dot (N,), q_dot (M,)).

    Every inertia p_k = I_k f_k behind the modulus G_k adds `G_k^T I_k G_k` to I*, `G_k^T p_k` to p and
    `G_k_dot^T p_k` to p_dot; the other bonds of the junction of phi_dot add their efforts, GR's among them.  Drives
    included.
    Source: S2 (28)-(34), (42)-(44).
    """
    P, graph = node_parameters(system), build_view(system, view)
    values = graph_values(system, P, state)
    names = name_values(system, values)
    driven = split_by_root(system, values.rates)["drives"]
    Gi, B_q = names.modulus["Gi"], names.modulus["B_q"]
    if "phi_dot" not in graph.roots:
        return jnp.zeros_like(driven[:0]), jnp.zeros_like(driven[:0]), B_q @ driven
    p_dot = -_junction_sum(system, graph, names, values.at)
    inertia, p, carried = 0.0, 0.0, 0.0
    for I_k, G_k, B_k, G_k_dot in _inertias(system, graph, values):
        p_k = I_k @ (G_k @ split_by_root(system, values.rates)["phi_dot"] + B_k @ driven)
        inertia, p = inertia + G_k.T @ I_k @ G_k, p + G_k.T @ p_k
        carried, p_dot = carried + G_k.T @ I_k @ B_k @ driven, p_dot + G_k_dot.T @ p_k
    phi_dot = spd_solve(inertia, p - carried)
    return p_dot, phi_dot, Gi @ phi_dot + B_q @ driven


def _junction_sum(system, graph, names, at):
    """Sum of the efforts that leave the junction of phi_dot, those of inertias and drives left out."""
    silent = [e.name for e in graph.elements if e.is_inertia or e.kind == "Sf" and not e.within]
    free = {name: jnp.zeros_like(names.effort["Q"] if name == "I*" else names.flow[name]) for name in silent}
    inner = inner_values(system, at) if any(e.within for e in graph.elements) else InnerValues({}, {}, {})
    flow, modulus = names.flow | inner.flow, names.modulus | inner.modulus
    efforts, _ = propagate(graph, flow, modulus, leaf_efforts(system, graph, names.effort | free), inner.bonds)
    return sum(sign * efforts[bond.name] for bond, _, sign in graph.bonds_of("phi_dot"))


def _inertias(system, graph, values):
    """Inertia, modulus, modulus of the drives and rate of the modulus of every inertia, relative to phi_dot."""
    if "I*" in graph.order:
        rows = split_by_root(system, jnp.eye(values.inertia.shape[0], dtype=values.inertia.dtype))
        yield values.inertia, rows["phi_dot"], rows["drives"], jnp.zeros_like(rows["phi_dot"])
        return
    elastic = {name: (g, i) for name, _, g, i in elastic_names(system)}
    for element in (e for e in graph.elements if e.is_inertia):
        if element.name in elastic:
            g, i = elastic[element.name]
            n = values.elastic[g]
            G, G_dot = (split_by_root(system, x[i]) for x in (n.fields.modulus, n.modulus_rate))
            yield n.fields.inertia[i], G["phi_dot"], G["drives"], G_dot["phi_dot"]
            continue
        what, body = element.name.split(":", 1)
        k = system.topology.body_names.index(body)
        part = slice(0, 3) if what == "I" else slice(3, 6)
        I_k = values.inertias[k] if what == "I" else system.mass[k] * jnp.eye(3, dtype=values.rates.dtype)
        G, G_dot = (split_by_root(system, x[k, part]) for x in (values.modulus, values.modulus_rate))
        yield I_k, G["phi_dot"], G["drives"], G_dot["phi_dot"]
