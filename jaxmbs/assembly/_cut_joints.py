"""Prescribed values of cut joints: during assembly an extra constraint row prescribes each value.

A cut joint has no coordinate in the tree, but its frames have the same angle or distance between them.
"""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..joints._base import AbstractJoint, half_angle_tangents
from ..joints._closures import AbstractClosure
from ..model._system import ClosureGroup, System


class CutJointValue(AbstractClosure):
    """Row that prescribes the angle about canonical z, or the distance along it, as `value` [rad or m]."""

    value: Float[Array, "..."]
    turns: bool = eqx.field(static=True)

    @property
    def row_units(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("rad",) if self.turns else ("m",)

    def closure(self, R: Array, d: Array) -> Array:
        if not self.turns:
            return (d[2] - self.value)[None]
        cosine, sine = jnp.cos(self.value), jnp.sin(self.value)
        turned = R[1, 0] * cosine - R[0, 0] * sine
        return half_angle_tangents(turned[None], R[0, 0] * cosine + R[1, 0] * sine)


def with_cut_values(system: System, values: Mapping[str, Array]) -> System:
    """The system with rows that prescribe values () of cut joints, of those for which `can_prescribe` is true."""
    top, groups = system.topology, []
    for name, value in values.items():
        group, k = _find_closure(system, name)
        kind = CutJointValue(
            jnp.reshape(jnp.asarray(value, group.basis.dtype), (1,)), group.kind.nodes[0].kind != "prismatic"
        )
        groups.append(ClosureGroup((name,), (group.first[k],), (group.second[k],), kind, group.basis[k : k + 1]))
    n = sum(len(group.names) * group.kind.num_rows for group in system.closures)
    topology = dataclasses.replace(
        top,
        row_joint=(*top.row_joint[:n], *values, *top.row_joint[n:]),
        slip_rows=tuple(row + len(values) * (row >= n) for row in top.slip_rows),
    )
    return dataclasses.replace(system, topology=topology, closures=(*system.closures, *groups))


def can_prescribe(system: System, name: str) -> bool:
    """True if a cut joint has exactly one angle or distance."""
    kind: AbstractJoint = _find_closure(system, name)[0].kind
    return len(kind.nodes) == 1 and kind.nodes[0].kind != "ball"


def _find_closure(system, name):
    """The group of a cut joint and its place there."""
    return next((group, group.names.index(name)) for group in system.closures if name in group.names)
