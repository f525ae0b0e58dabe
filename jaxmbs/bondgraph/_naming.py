"""Values of a bond graph by name: flow by junction and one-port, modulus by transformer, effort by one-port."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ..constraints._kic import dependent_columns, independent_columns
from ..model._system import System
from ._elastic import NUM_RIGID, elastic_names
from ._values import GraphValues
from ._views import joint_junction, root_sizes


class NamedValues(NamedTuple):
    """Numbers by element name, in every view at once.

    Attributes:
        flow: of every 1-junction and one-port, and `modulus` of every transformer.
        effort: of every one-port but inertias and drives, along its half arrow; fields hold all roots' parts.
    """

    flow: dict
    modulus: dict
    effort: dict


def name_values(system: System, numbers: GraphValues) -> NamedValues:
    """Values by name, except the efforts of inertias and drives, which need accelerations."""
    result = NamedValues({}, {}, {})
    _name_roots(system, numbers, result)
    _name_bodies(system, numbers, result)
    _name_elastic_bodies(system, numbers, result)
    for group, values in zip(system.forces, numbers.ports, strict=True):
        _name_forces(system, group, values, result)
    if system.friction is not None:
        for name, modulus, flow, effort in zip(system.friction.names, *numbers.friction, strict=True):
            result.flow[f"R:{name}"], result.effort[f"R:{name}"] = flow, effort
            _store_modulus(system, result, name, modulus, "G", "B")
    return result


def split_by_root(system: System, values) -> dict:
    """Parts of the last axis by root, (..., N) and (..., D)."""
    N = root_sizes(system).get("phi_dot", 0)
    return {"phi_dot": values[..., :N], "drives": values[..., N:]}


def _store_modulus(system, result, target, matrix, symbol, driven):
    parts = split_by_root(system, matrix)
    result.modulus[f"{symbol}:{target}" if target else symbol] = parts["phi_dot"]
    result.modulus[f"{driven}:{target}" if target else driven] = parts["drives"]


def _name_roots(system, numbers, result):
    dependent = dependent_columns(system)
    result.flow.update(split_by_root(system, numbers.rates))
    result.flow["drive"] = result.flow["drives"]
    result.flow["q_dot"] = numbers.at.u[dependent]
    _store_modulus(system, result, "", numbers.map[dependent], "Gi", "B_q")
    result.effort.update({"GR": numbers.gyristor @ numbers.rates, "Q": numbers.total, "gravity": numbers.gravity})


def _name_bodies(system, numbers, result):
    for k, body in enumerate(system.topology.body_names):
        turning, sliding = numbers.flow[k, :3], numbers.flow[k, 3:]
        result.flow.update({f"I:{body}": turning, f"m:{body}": sliding, f"v:{body}": sliding})
        _store_modulus(system, result, body, numbers.modulus[k, :3], "G_r", "B_r")
        _store_modulus(system, result, body, numbers.modulus[k, 3:], "G_t", "B_t")
        result.effort[f"mg:{body}"] = system.mass[k] * system.gravity


def _name_elastic_bodies(system, numbers, result):
    for inertia, name, g, i in elastic_names(system):
        n = numbers.elastic[g]
        y, G = n.state.flow[i], n.fields.modulus[i]
        result.flow.update(dict.fromkeys((inertia, f"y:{name}", f"GR:{name}.flow", f"mg:{name}.flow"), y))
        result.flow.update({f"{place}:{name}.strain": y[NUM_RIGID:] for place in ("rate", "C", "R")})
        _store_modulus(system, result, name, G, "G_y", "B_y")
        _store_modulus(system, result, name, G[NUM_RIGID:], "G_q", "B_q")
        result.effort.update({f"GR:{name}.flow": -n.turning[i], f"mg:{name}.flow": n.weight[i]})
        result.effort.update({f"C:{name}.strain": n.stored[i], f"R:{name}.strain": n.resisted[i]})


def _name_forces(system, group, values, result):
    modulus, flow, stored, total = values
    for i, name in enumerate(group.names):
        for place in ("rate", "C", "R", "Se"):
            result.flow[f"{place}:{name}"] = flow[i]
        if group.internal:  # one port takes all its effort
            conservative = rest = total[i]
        else:
            conservative, rest = stored[i], total[i] - stored[i]
        result.effort.update({f"C:{name}": -conservative, f"R:{name}": -rest, f"Se:{name}": rest})
        _store_modulus(system, result, name, modulus[i], group.port.modulus, "B")
        if group.port.is_on_joint:
            column = group.first[i]
            at = independent_columns if joint_junction(system, column) == "phi_dot" else dependent_columns
            row = (at(system) == column).astype(float)[None]
            result.modulus[f"e:{name}"] = jnp.asarray(np.asarray(row), flow.dtype)
