"""Internal states of force elements and blocks: their layout in one vector, by name, and a system at them.

For all functions of one instant the internal states are numbers of the laws: `with_internal` puts them there.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import place_of


@dataclass(frozen=True)
class InternalRecord:
    """One internal state of one force element or block: "boom.p0" of the element "boom".

    Attributes:
        shape: of its array, () for one number; unit: of its numbers.
        first: its place in the vector of all.
    """

    name: str
    shape: tuple[int, ...]
    unit: str
    first: int

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    @property
    def entries(self) -> tuple[str, ...]:
        """A name for every number."""
        return (self.name,) if self.shape == () else tuple(f"{self.name} {k}" for k in range(self.size))


class InternalStates(eqx.Module):
    """Internal states of all force elements and blocks, `states["boom.p0"]`; with leading axes for a motion.

    Attributes:
        values: (..., ns) in one vector, in the order of the elements' powers, those of blocks at the end.
        records: their names, shapes and units (static).
    """

    values: Float[Array, "... ns"]
    records: tuple[InternalRecord, ...] = eqx.field(static=True)

    def __getitem__(self, name: str) -> Array:
        """The state of a name (..., *shape).  Raises: UnknownNameError."""
        record = self.records[place_of("internal state", name, [r.name for r in self.records])]
        part = self.values[..., record.first : record.first + record.size]
        return part.reshape(*self.values.shape[:-1], *record.shape)

    def named(self) -> dict[str, Array]:
        """All of them by name."""
        return {record.name: self[record.name] for record in self.records}

    @property
    def ok(self) -> Array:
        """True (...) where all numbers are finite."""
        return jnp.all(jnp.isfinite(self.values), axis=-1)

    @property
    def entries(self) -> tuple[str, ...]:
        """A name for every number of `values`."""
        return tuple(entry for record in self.records for entry in record.entries)


def internal_records(groups) -> tuple[InternalRecord, ...]:
    """Records of all internal states of groups of force elements, and of blocks."""
    found, first = [], 0
    for group in groups:
        for element in group.names:
            for name, shape, unit in group.internal:
                found.append(InternalRecord(f"{element}.{name}", shape, unit, first))
                first += found[-1].size
    return tuple(found)


def group_size(group) -> int:
    """Number of numbers of one element's internal states."""
    return sum(math.prod(shape) for _, shape, _ in group.internal)


def split_states(group, values) -> dict[str, Array]:
    """States (n, *shape) of a group's elements by name, from values (n * size,)."""
    rows, found, first = values.reshape(len(group.names), group_size(group)), {}, 0
    for name, shape, _ in group.internal:
        size = math.prod(shape)
        found[name] = rows[:, first : first + size].reshape(len(rows), *shape)
        first += size
    return found


def join_states(group, states: dict[str, Array]) -> Array:
    """Values (n * size,) of a group from states (n, *shape) by name."""
    rows = [states[name].reshape(len(group.names), -1) for name, *_ in group.internal]
    return (rows[0] if len(rows) == 1 else jnp.concatenate(rows, axis=1)).reshape(-1)


def with_internal(system, internal: Any, group_at: Callable | None = None):
    """The system whose laws have the internal states of a state, an `InternalStates` or its values (ns,).

    One without internal states, or at given ones already where none are given, is returned as it is.

    Args: group_at: (group, states by name) -> the group in its place; default the group at its states.
    """
    if internal is None or not system.topology.internal:
        return system
    values, first, groups = getattr(internal, "values", internal), 0, []
    for group in system.forces:
        if not group.internal:
            groups.append(group)
            continue
        end = first + len(group.names) * group_size(group)
        s = split_states(group, values[first:end])
        groups.append(replace_field(group, "s", s) if group_at is None else group_at(group, s))
        first = end
    if groups:
        system = eqx.tree_at(lambda s: s.forces, system, tuple(groups))
    if system.friction is not None and (number := sum(system.friction.bristle_sizes)):
        at_bends = replace_field(system.friction, "bristles", values[first : first + number])
        system, first = replace_field(system, "friction", at_bends), first + number
    return _with_block_states(system, values[first:]) if system.blocks else system


def _with_block_states(system, values):
    """The system whose blocks are at states in one vector."""
    blocks, first = [], 0
    for group in system.blocks:
        end = first + len(group.names) * group_size(group)
        blocks.append(replace_field(group, "s", split_states(group, values[first:end]) if group.internal else {}))
        first = end
    return replace_field(system, "blocks", tuple(blocks))


def replace_field(module, name: str, value):
    """A module with another value of one field, also of one without leaves."""
    made = object.__new__(type(module))
    for field in dataclasses.fields(module):
        object.__setattr__(made, field.name, value if field.name == name else getattr(module, field.name))
    return made


def has_internal(system) -> bool:
    """True if the laws of the system are at their internal states, or have none."""
    laws = all(group.s is not None for group in system.forces if group.internal)
    rubs = system.friction is None or not any(system.friction.bristle_sizes) or system.friction.bristles is not None
    return laws and rubs and all(group.s is not None for group in system.blocks if group.internal)


def stacked(values) -> Array:
    """One vector of the values of all groups."""
    found = list(values)
    return found[0] if len(found) == 1 else jnp.concatenate(found)


def declared_scales(group) -> dict[str, Array]:
    """Scales (n, *shape) of a group's states by name, as its laws declare them."""
    return jax.vmap(lambda law: _scales(group, law), axis_size=len(group.names))(group.law)


def block_scales(group) -> dict[str, Array]:
    """Scales (n, *shape) of the states of a group of blocks by name, as these declare them."""
    return jax.vmap(lambda block: _scales(group, block), axis_size=len(group.names))(group.block)


def _scales(group, law):
    found = law.internal_states
    scales = {name: one.scale for name, one in found.items()}  # the held output of a sampled block has none
    return {
        name: jnp.broadcast_to(jnp.asarray(scales.get(name, 1.0), float), shape) for name, shape, _ in group.internal
    }
