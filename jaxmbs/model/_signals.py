"""Measures and blocks of a system: the layout of its signals."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from ..blocks._base import AbstractBlock
from ..blocks._readings import AbstractReading
from ..named_arrays import element_of
from ..typing import ScalarLike


class MeasureGroup(eqx.Module):
    """Signals of coordinates, velocities, internal states and time that are read in one way.

    Attributes:
        reading: of `blocks._readings`: `reading.values(instant, places)` gives the values (n, ...).
        places: (n, k) joint or frames of each measure.
        internal: names of the internal states that are read.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    reading: AbstractReading
    places: tuple[tuple[str, ...], ...] = eqx.field(static=True)
    internal: tuple[str, ...] = eqx.field(static=True, default=())


class BlockGroup(eqx.Module):
    """Blocks of one structure, at one place in the order of evaluation, their parameters stacked.

    Attributes:
        reads: (n, k) names of signals, or numbers of `functions` of time.
        drives: of each block the fields of force elements and blocks that it drives, "motor.voltage"; of several
            each gets one entry of its output.
        internal: (name, shape, unit) of each state of the block.
        shape: of the output; size: of all inputs together, None for one number.
        mix: (n, size, entries) factors of all that is read in each input, None where the inputs are what is read.
        is_early: True for an output that is evaluated before its inputs are, on which it does not depend.
        period: (n,) [s] of sampled blocks, whose last state is their "output"; rhythms: number of each period among
            the different ones.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    block: AbstractBlock
    reads: tuple[tuple[str | int, ...], ...] = eqx.field(static=True)
    functions: tuple[Callable[[ScalarLike], Array], ...]
    drives: tuple[tuple[str, ...], ...] = eqx.field(static=True)
    internal: tuple[tuple[str, tuple[int, ...], str], ...] = eqx.field(static=True)
    shape: tuple[int, ...] = eqx.field(static=True, default=())
    size: int | None = eqx.field(static=True, default=None)
    mix: tuple[tuple[tuple[int, ...], ...], ...] | None = eqx.field(static=True, default=None)
    is_early: bool = eqx.field(static=True, default=False)
    period: Float[Array, " n"] | None = None
    rhythms: tuple[int, ...] = eqx.field(static=True, default=())


class BlocksAt(NamedTuple):
    """A group of blocks whose driven fields have their values, their inputs u (n, ...) and states s by name."""

    group: BlockGroup
    block: AbstractBlock
    u: Array
    s: dict[str, Array]

    def one(self, element: "BlockElement") -> tuple[AbstractBlock, Array, dict[str, Array]]:
        """(block, inputs, states) of one of them."""
        return element_of((self.block, self.u, self.s), element.number)


class Signals(NamedTuple):
    """Signals at an instant: of each group of force elements the values (n, ...) of the fields that blocks drive, by
    name, and all groups of blocks."""

    driven: tuple[dict[str, Array], ...]
    blocks: tuple[BlocksAt, ...]


class BlockElement(NamedTuple):
    """One block of a group."""

    group: BlockGroup
    number: int

    @property
    def name(self) -> str:
        """Of the block."""
        return self.group.names[self.number]

    @property
    def block(self) -> AbstractBlock:
        """With the element's own numbers."""
        return element_of(self.group.block, self.number)


def block_elements(groups: tuple[BlockGroup, ...]) -> list[BlockElement]:
    """All blocks in the order of their evaluation."""
    return [BlockElement(group, k) for group in groups for k in range(len(group.names))]


def block_named(groups: tuple[BlockGroup, ...], name: str) -> list[BlockElement]:
    """The block of a name, alone in a list; an empty one where there is none."""
    return [BlockElement(group, group.names.index(name)) for group in groups if name in group.names]


def drivers_of(groups: tuple[BlockGroup, ...]) -> dict[str, tuple[str, int | None]]:
    """(block, entry of its output or None for all of it) by the field that it drives, "motor.voltage"."""
    found = {}
    for group in groups:
        for name, drives in zip(group.names, group.drives, strict=True):
            found |= drives_by_field(name, drives)
    return found


def drives_by_field(name: str, drives: tuple[str, ...]) -> dict[str, tuple[str, int | None]]:
    """(name, entry of its output or None for all of it) by the fields that a block drives."""
    alone = len(drives) == 1
    return {field: (name, None if alone else k) for k, field in enumerate(drives)}


def internal_reads(system) -> set[str]:
    """Names of the internal states that measures and blocks read, among the names of other signals."""
    of_measures = {name for group in system.measures for name in group.internal}
    of_blocks = {read for group in system.blocks for reads in group.reads for read in reads if isinstance(read, str)}
    return of_measures | of_blocks
