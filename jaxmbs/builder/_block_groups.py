"""Groups of the blocks of a declared model, in the order of their evaluation."""

from typing import Any, NamedTuple

from ..forces._fields import number
from ..forces._internal_state import internal_layout
from ..forces._signals import as_signal
from ..model._signals import BlockGroup
from ._block_connections import drives_of, field_of, reads_of, rhythms
from ._declarations import Model
from ._evaluation_order import evaluation_order
from ._groups import group_by_structure


class BlockItem(NamedTuple):
    """A declared block with its connections and its level; other fields as of a `BlockGroup`, of one block.

    Shapes of the output and of the inputs are found later, by an abstract evaluation.
    """

    name: str
    block: Any
    reads: tuple[str | int, ...]
    functions: tuple[Any, ...]
    drives: tuple[str, ...]
    internal: tuple[tuple[str, tuple[int, ...], str], ...]
    mix: tuple[tuple[int, ...], ...] | None
    level: int
    is_early: bool
    period: Any = None
    rhythm: int | None = None
    shape: tuple[int, ...] = ()
    size: int | None = None


def block_items(model: Model) -> list[BlockItem]:
    """Blocks of a model in the order of their evaluation, their shapes not yet known."""
    found, numbers = [], rhythms(model)
    for name, level, is_early in evaluation_order(model)[0]:
        item, reads, functions = model.blocks[name], [], []
        for read in reads_of(item):
            reads.append(read if isinstance(read, str) else len(functions))
            functions += [] if isinstance(read, str) else [as_signal(read)]
        drives = tuple(field_of(one, model)[0] for one in drives_of(item))
        block = item.block if item.every is None else item.block.sampled(item.every)
        layout = internal_layout(block)
        sampling: tuple = ()
        if item.every is not None:
            layout += (("output", (), ""),)
            sampling = number(item.every), numbers[name]
        connections = tuple(reads), tuple(functions), drives
        found.append(BlockItem(name, block, *connections, layout, item.mix, level, is_early, *sampling))
    return found


def block_groups(items: list[BlockItem]) -> tuple[BlockGroup, ...]:
    """Blocks of one structure at one level together, their parameters stacked."""
    members = []
    for item in items:
        kind = (item.level, item.is_early, item.internal, item.shape, item.size, item.mix is not None)
        members.append((item.name, (item.block, item.functions, item.period), item, None, kind))
    return tuple(
        BlockGroup(
            names,
            block,
            tuple(item.reads for item in own),
            functions,
            tuple(item.drives for item in own),
            own[0].internal,
            shape=own[0].shape,
            size=own[0].size,
            mix=None if own[0].mix is None else tuple(item.mix for item in own),
            is_early=own[0].is_early,
            period=period,
            rhythms=tuple(item.rhythm for item in own if item.rhythm is not None),
        )
        for _, names, (block, functions, period), own, *_ in group_by_structure(members)
    )
