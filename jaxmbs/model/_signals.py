"""Measures and blocks of a system: the layout of its signals."""

from typing import Any

import equinox as eqx

from ._internal_states import replace_field


class Measure(eqx.Module):
    """A signal of coordinates, velocities, internal states and time: `function(instant)`.

    Attributes: internal: names of the internal states that the function reads.
    """

    name: str = eqx.field(static=True)
    function: Any
    internal: tuple[str, ...] = eqx.field(static=True, default=())


class BlockElement(eqx.Module):
    """A block with its connections.

    Attributes:
        reads: names of signals, or numbers of `functions` of time.
        drives: fields of force elements and blocks, "motor.voltage"; of several each gets one entry of the output.
        internal: (name, shape, unit) of each state of the block; s: their values by name, None where not given.
        shape: of the output; size: of all inputs together, None for one number.
        is_early: True for an output that is evaluated before its inputs are, on which it does not depend.
        period: () [s] of a sampled block, whose last state is its "output"; rhythm: number of the period among the
            different ones.
    """

    name: str = eqx.field(static=True)
    block: Any
    reads: tuple[str | int, ...] = eqx.field(static=True)
    functions: tuple[Any, ...]
    drives: tuple[str, ...] = eqx.field(static=True)
    internal: tuple[tuple[str, tuple[int, ...], str], ...] = eqx.field(static=True)
    shape: tuple[int, ...] = eqx.field(static=True, default=())
    size: int | None = eqx.field(static=True, default=None)
    is_early: bool = eqx.field(static=True, default=False)
    s: dict[str, Any] | None = None
    period: Any = None
    rhythm: int | None = eqx.field(static=True, default=None)

    @property
    def names(self) -> tuple[str, ...]:
        """Its name alone, as of a group of one."""
        return (self.name,)


def drivers_of(system) -> dict[str, tuple[str, int | None]]:
    """(block, entry of its output or None for all of it) by the field that it drives, "motor.voltage"."""
    found = {}
    for element in system.blocks:
        alone = len(element.drives) == 1
        found |= {field: (element.name, None if alone else k) for k, field in enumerate(element.drives)}
    return found


def internal_reads(system) -> set[str]:
    """Names of the internal states that measures and blocks read, among the names of other signals."""
    of_measures = {name for measure in system.measures for name in measure.internal}
    return of_measures | {read for element in system.blocks for read in element.reads if isinstance(read, str)}


def law_of(law):
    """The law itself, of a law at its internal states."""
    return getattr(law, "law", law)


def with_law_field(law, name: str, value):
    """A law, at its internal states or not, with another value of a field."""
    inner = law_of(law)
    changed = replace_field(inner, name, value)
    return changed if inner is law else replace_field(law, "law", changed)
