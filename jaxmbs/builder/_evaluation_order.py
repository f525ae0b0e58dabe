"""Order in which the blocks of a model are evaluated."""

from typing import NamedTuple

from ._block_connections import driven_fields, reads_of
from ._declarations import Model


class Turn(NamedTuple):
    """The turn of a block: its level, and whether its output is evaluated before its inputs."""

    name: str
    level: int
    is_early: bool


def evaluation_order(model: Model) -> tuple[list[Turn], list[str]]:
    """(turns of all blocks in order, blocks left in a loop).

    Blocks of one level need outputs of lower levels alone.  Outputs that are states come before all others, and what
    is sampled or has a driven field before its inputs where a loop asks for it.
    """
    drivers = driven_fields(model)
    needs = {}
    for item in model.blocks.values():
        read = {one for one in reads_of(item) if isinstance(one, str) and one in model.blocks}
        needs[item.name] = read | {
            drivers[f"{item.name}.{field}"] for field in item.block.inputs if f"{item.name}.{field}" in drivers
        }
    fields = {field.rpartition(".")[0] for field in drivers}
    states = [name for name, item in model.blocks.items() if not _feeds_through(item) and item.every is None]
    order = [Turn(name, 0, True) for name in states if name not in fields]
    level = 0
    while len(order) < len(needs):
        done, level = {turn.name for turn in order}, level + 1
        left = [name for name in needs if name not in done]
        free = [name for name in left if needs[name] <= done]
        early = [] if free else [name for name in left if not _feeds_through(model.blocks[name])][:1]
        if not free and not early:
            return order, left
        order += [Turn(name, level, not free) for name in free or early]
    return order, []


def _feeds_through(item):
    return item.every is None and item.block.is_feedthrough
