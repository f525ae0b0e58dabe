"""Elastic bodies in a bond graph, on their flows y = (turning, sliding, rates of deformation) in floating axes.

Behind the modulus G_y an inertia holds the momenta `pi = I_y y`, a gyristor exerts what turns them and what the
deformed inertia changes, `-g(q, y)`, and a source the weight: `pi_dot + g = ...`.  As I* and GR of the paper, neither
conserves alone, the two together do: `(pi_dot + g).y = dKE/dt`.  Strains hang on the rates of deformation, a
compliance and a resistor.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..checks import may_be_nonzero
from ..kinematics._configuration import Configuration, VelocityKinematics, at_rest
from ..kinematics._elastic import ElasticState, elastic_state, flow_map
from ..model._system import System

NUM_RIGID = 6  # turning and sliding, before the deformations


def num_flows(group) -> int:
    """Number of components of the flow y of each body of a group."""
    return NUM_RIGID + group.body.stiffness.shape[-1]


def strain_one_ports(group, i: int) -> list[str]:
    """Kinds of the one-ports of the strains of body `i`."""
    if num_flows(group) == NUM_RIGID:
        return []
    return ["C"] * may_be_nonzero(group.body.stiffness[i]) + ["R"] * may_be_nonzero(group.body.damping[i])


class ElasticFields(NamedTuple):
    """Fields of a group at a configuration: modulus G_y (bodies, k, r), inertia I_y (bodies, k, k)."""

    modulus: Array
    inertia: Array


class ElasticValues(NamedTuple):
    """Values of a group in motion: fields and the rate of the modulus; flow y, the gyristor's loads g, weight
    (bodies, k); efforts of strains, stored and resisted (bodies, k - 6)."""

    fields: ElasticFields
    modulus_rate: Array
    state: ElasticState
    turning: Array
    weight: Array
    stored: Array
    resisted: Array


def elastic_fields(system: System, at: Configuration, L) -> tuple[ElasticFields, ...]:
    """Moduli and inertias by group, with the rate map L (nv, r).  Source: S2 (35) for bodies that deform."""
    found = []
    for group in system.elastic:
        s = elastic_state(system, group, at_rest(system, at))
        found.append(ElasticFields(flow_map(system, group, at, s) @ L, jax.vmap(_inertia)(group.body, s.q)))
    return tuple(found)


def _inertia(body, q):
    """I_y (k, k) of one body."""
    Z = jax.vmap(lambda y: body.speeds(q, y), out_axes=1)(jnp.eye(NUM_RIGID + q.size, dtype=q.dtype))
    return Z.T @ body.inertia @ Z


def elastic_values(system: System, at: VelocityKinematics, fields, modulus_rates) -> tuple[ElasticValues, ...]:
    """The values of every group."""

    def of_body(body, s):
        y = s.flow
        weight = body.gravity_loads(s.q, system.gravity @ s.R)
        strain = body.stiffness @ s.q if body.stiffening is None else jax.grad(body.strain_energy)(s.q)
        return body.gyroscopic_loads(s.q, y), weight, strain, body.damping @ y[NUM_RIGID:]

    found = []
    for group, of_group, rate in zip(system.elastic, fields, modulus_rates, strict=True):
        s = elastic_state(system, group, at)
        found.append(ElasticValues(of_group, rate, s, *jax.vmap(of_body)(group.body, s)))
    return tuple(found)


def field_inertia(fields):
    """Share of the elastic bodies in I* (r, r)."""
    return sum(jnp.einsum("eki,ekl,elj->ij", G, I, G) for G, I in fields)


def field_gyristor(system: System, numbers):
    """Share of the elastic bodies in GR (r, r): `G_dot^T I G - 1/2 G^T (dg/dy) G`, g being quadratic in y."""
    found = 0.0
    for group, n in zip(system.elastic, numbers, strict=True):
        G, I = n.fields
        slope = jax.vmap(lambda body, s: jax.jacfwd(body.gyroscopic_loads, 1)(s.q, s.flow))(group.body, n.state)
        found = found + jnp.einsum("eki,ekl,elj->ij", n.modulus_rate, I, G)
        found = found - 0.5 * jnp.einsum("eki,ekl,elj->ij", G, slope, G)
    return found


def field_weight(numbers):
    """Share of the elastic bodies in the effort (r,) of gravity."""
    return sum(jnp.einsum("eki,ek->i", n.fields.modulus, n.weight) for n in numbers)


def momentum_rates(system: System, numbers, rates, w_dot):
    """pi_dot (bodies, k) by group, from the root rates (r,) and their rates w_dot (r,)."""
    found = []
    for group, n in zip(system.elastic, numbers, strict=True):
        y_dot = n.modulus_rate @ rates + n.fields.modulus @ w_dot

        def of_body(body, s, y_dot):
            return jax.jvp(body.momenta, (s.q, s.flow), (s.flow[NUM_RIGID:], y_dot))[1]

        found.append(jax.vmap(of_body)(group.body, n.state, y_dot))
    return found


def elastic_names(system: System):
    """Element name of the inertia, name of the body, group, and place in the group, of every elastic body."""
    for g, group in enumerate(system.elastic):
        for i, name in enumerate(group.names):
            yield f"I:{name}.flow", name, g, i
