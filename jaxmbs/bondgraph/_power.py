"""Effort, flow and power of every bond at a state or along a motion."""

import equinox as eqx
import jax
import jax.numpy as jnp

from ..assembly._state import State
from ..constraints import _constraints as constraints
from ..constraints._mobility import with_mobility_at
from ..dynamics._newton_euler import accelerations
from ..kinematics._poses import coordinate_rate, node_parameters
from ..model._changes import with_changes
from ..model._entry_points import states_of
from ..model._system import System
from ..motion._motion import Motion
from ..quantities import Quantity, along_freedoms
from ..reports import Report, Reported
from ..runtime import jit
from ._circuits import circuit_values, joined_ports
from ._elastic import elastic_names, momentum_rates
from ._graph import BondGraph
from ._inner_graph import inner_values
from ._naming import name_values, split_by_root
from ._values import apply_inertia, graph_values, root_rates
from ._views import build_view


class BondPowers(Reported, eqx.Module):
    """Effort, flow and power of every bond by name, "tail -> head"; leading axes for a motion.

    Attributes:
        effort, flow: (..., size) of the bond; `power` their product [W], positive along the half arrow.
        graph: the view they belong to (static, without causal strokes).
    """

    effort: dict
    flow: dict
    graph: BondGraph = eqx.field(static=True)

    def report(self) -> Report:
        powers = [Quantity(name, power, "W") for name, power in self.power.items()]
        parts = [
            along_freedoms(f"{what} of {name}", x, "SI")._replace(in_table=False)
            for what in ("effort", "flow")
            for name, x in getattr(self, what).items()
        ]
        return Report([*powers, *parts], f"{len(powers)} bonds, powers along them")

    @property
    def power(self) -> dict:
        """Power (...) [W] by bond."""
        return {name: jnp.sum(self.effort[name] * self.flow[name], axis=-1) for name in self.effort}

    def net_power(self, name: str):
        """Net power (...) [W] into an element: positive where it stores or dissipates, negative where it supplies."""
        return _net_power(self.graph, self.power, name)

    def ports(self) -> dict:
        """Net power (...) [W] into the mechanism's stores (I, C, GR), resistors and sources, by one-port."""
        power = self.power
        return {e.name: _net_power(self.graph, power, e.name) for e in self.graph.elements if e.is_port}


def _net_power(graph, power, name):
    return sum(-sign * power[bond.name] for bond, _, sign in graph.bonds_of(name))


def junction_residual(powers: BondPowers) -> dict:
    """Power imbalance (...) [W] of every junction and transformer: zero to rounding.

    Flows are those of the bodies and elements themselves, efforts of the inertias and drives come from the
    accelerations: transformers and 0-junctions test the moduli, the roots the balance of all efforts.  1-junctions
    further out close by construction.  Source: S2 (6), (13), (16), (28).
    """
    power = powers.power
    return {e.name: _net_power(powers.graph, power, e.name) for e in powers.graph.elements if not e.is_port}


def propagate(graph: BondGraph, flow: dict, modulus: dict, leaf: dict, inner: dict):
    """Efforts and flows by bond from those of the one-ports: efforts run inwards through junctions and transformers.

    Args: flow by 1-junction and one-port, modulus by transformer, leaf efforts by (one-port, junction beside it),
        inner (effort, flow) by bond inside of elements.
    """
    efforts, flows = ({name: pair[k] for name, pair in inner.items()} for k in (0, 1))
    flows |= {b.name: _bond_flow(graph, b, flow, modulus) for b in graph.bonds if b.name not in inner}
    for element in reversed(graph.elements):
        inward, outward = graph.inward(element.name), graph.outward(element.name)
        if all(bond.name in inner for bond, *_ in inward):
            continue
        if element.is_port:
            effort = None
        elif element.kind == "1":
            parts = [sign * _sum_to(efforts[bond.name], element.size) for bond, _, sign in outward]
            effort = sum(parts[1:], parts[0]) if parts else jnp.zeros_like(flow[element.name])
        else:
            effort = efforts[outward[0][0].name]
            effort = modulus[element.name].T @ effort if element.kind in ("TF", "MTF") else effort
        for bond, beside, _ in inward:
            efforts[bond.name] = leaf[element.name, beside] if effort is None else effort
    return efforts, flows


def _sum_to(effort, size):
    """Effort (size,) of a bond of several times as many components."""
    return effort if effort.size == size else jnp.sum(effort.reshape(-1, size), axis=0)


def _bond_flow(graph, bond, flow, modulus):
    """A bond's flow: that of a 1-junction or one-port at an end, else of the transformer beside a 0-junction."""
    for end in sorted((bond.tail, bond.head), key=graph.order.get):
        if graph[end].kind == "1":
            return flow[end]
    for end in (bond.tail, bond.head):
        if graph[end].is_port:
            return flow[end]
    transformer = next(end for end in (bond.tail, bond.head) if graph[end].kind != "0")
    return modulus[transformer] @ flow[graph.inward(transformer)[0][1]]


def leaf_efforts(system: System, graph: BondGraph, effort: dict) -> dict:
    """Efforts by (one-port, element beside it); the fields' split by root."""
    leaf = {}
    for element in graph.elements:
        if not element.is_port or element.name not in effort:
            continue
        beside = [other for _, other, _ in graph.bonds_of(element.name)]
        spread = element.name in ("I*", "GR", "Q", "gravity")
        parts = split_by_root(system, effort[element.name]) if spread else dict.fromkeys(beside, effort[element.name])
        leaf.update({(element.name, other): parts[other] for other in beside})
    return leaf


def inertial_efforts(system: System, values) -> dict:
    """Momentum rates of all inertias and the drives' efforts, by one-port, from the accelerations.

    Source: S2 (28), (34); a drive's effort is its constraint's multiplier.
    """
    at = values.at
    u_dot, multipliers, _ = accelerations(system, at)
    moving = coordinate_rate(system.topology, at.psi, at.u), u_dot, jnp.ones_like(at.t)
    w_dot = jax.jvp(lambda *x: root_rates(system, at.P, *x), (at.psi, at.u, at.t), moving)[1]
    flow_dot = values.modulus_rate @ values.rates + values.modulus @ w_dot
    h, h_dot = (apply_inertia(system, values.inertias, f) for f in (values.flow, flow_dot))
    h_dot = h_dot.at[:, :3].add(jnp.cross(values.flow[:, :3], h[:, :3]))
    effort = {"I*": values.inertia @ w_dot + values.inertia_rate @ values.rates}
    for k, body in enumerate(system.topology.body_names):
        effort.update({f"I:{body}": h_dot[k, :3], f"m:{body}": h_dot[k, 3:]})
    rates = momentum_rates(system, values.elastic, values.rates, w_dot)
    effort.update({inertia: rates[g][i] for inertia, _, g, i in elastic_names(system)})
    if system.has_constraints:
        pull = values.map.T @ (constraints.jacobian(system, at).T @ multipliers)
        effort["drive"] = split_by_root(system, pull)["drives"]
    return effort


def _values(system, P, state):
    """Flows, moduli and efforts by name of all views at a state; P where no event changes it, else None."""
    system = with_changes(system, state)
    P = node_parameters(system) if P is None else P
    values = graph_values(system, P, state)
    names = name_values(system, values)
    inner = inner_values(system, values.at, joined_ports(system))
    effort = names.effort | inertial_efforts(system, values)
    bonds = inner.bonds | circuit_values(system, values.at)
    return names.flow | inner.flow, names.modulus | inner.modulus, effort, bonds


@jit
def _all_values(system, states, batched):
    P = None if states.changes is not None else node_parameters(system)
    one = lambda s: _values(system, P, s)
    return jax.vmap(one)(states) if batched else one(states)


@jit
def _propagate_all(system, graph, values, batched):
    one = lambda f, m, e, inner: propagate(graph, f, m, leaf_efforts(system, graph, e), inner)
    return jax.vmap(one)(*values) if batched else one(*values)


def bond_powers(system: System, motion: State | Motion, view: str = "detailed") -> BondPowers:
    """Efforts, flows and power of every bond of a view at a state or along a motion.

    Args:
        motion: a State, a Motion, or a State with one leading axis.
        view: "detailed", "inertia" or "hamiltonian", as in `bond_graph`.

    The bond of I* alone does not conserve: `p_dot.phi_dot = dKE/dt + phi_dot^T GR phi_dot`, so the power of GR counts
    with it.  Of laws that declare them the bonds inside are there too, such as "Se:motor.voltage -> 1:motor.current".

    Raises: ValueError for an unknown view.  Source: S2 (28)-(41), (56)-(76).
    """
    states = states_of(system, motion)
    system = with_mobility_at(system, states)
    graph, batched = build_view(system, view), states.coordinates.ndim == 2
    values = _all_values(system, states, batched)
    if view == "hamiltonian":
        values = *values[:3], {}
    effort, flow = _propagate_all(system, graph, values, batched)
    return BondPowers(effort, flow, graph)
