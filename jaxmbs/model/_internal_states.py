"""Internal states of force elements and blocks: their layout in one vector, by name and by groups."""

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

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


class GroupStates(NamedTuple):
    """Internal states at an instant as laws and blocks take them, group by group.

    Attributes:
        whole: all of them in one vector.
        laws, blocks: of each group of force elements, and of blocks, (n, *shape) by name; empty for those without.
        bends: (ns,) of the bristles in joints [m]; None without.
        steps: of each group of force elements the lengths (n,) [s] of an implicit stage that starts at its states,
            None for one that is at them; None where all are.
    """

    whole: InternalStates
    laws: tuple[dict[str, Array], ...]
    bends: Array | None
    blocks: tuple[dict[str, Array], ...]
    steps: tuple[Array | None, ...] | None = None


def group_states(system, internal: InternalStates | Array | None) -> GroupStates | None:
    """The states of a state, an `InternalStates` or its values (ns,), by groups; None where there are none."""
    if internal is None or not system.topology.internal:
        return None
    whole = internal if isinstance(internal, InternalStates) else InternalStates(internal, system.topology.internal)
    values, first = whole.values, 0

    def parts(groups):
        nonlocal first
        for group in groups:
            begin, first = first, first + len(group.names) * group_size(group)
            yield split_states(group, values[begin:first]) if group.internal else {}

    laws, bends = tuple(parts(system.forces)), None
    if system.friction is not None and (number := sum(system.friction.bristle_sizes)):
        bends, first = values[first : first + number], first + number
    return GroupStates(whole, laws, bends, tuple(parts(system.blocks)))


def replace_field(module, name: str, value):
    """A module with another value of one field, also of one without leaves."""
    made = object.__new__(type(module))
    for field in dataclasses.fields(module):
        object.__setattr__(made, field.name, value if field.name == name else getattr(module, field.name))
    return made


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
