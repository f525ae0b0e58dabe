"""Removal of all drives and frame paths from a mechanism, for motions that actuators produce instead."""

import dataclasses

import numpy as np

from ..model._rows import drives, groups_without
from ..model._system import System


def without_drives(system: System) -> System:
    """The system without the rows of its drives and frame paths; its independent set stays that of the driven one."""
    gone = {row.name for row in drives(system.rows)} | set(system.paths)
    if not gone:
        return system
    top, found = system.topology, system.topology.analysis
    keep = np.array([name not in gone for name in top.row_joint], bool)
    number, taken = np.cumsum(keep) - 1, int(np.sum(~keep))
    if found is not None:
        found = dataclasses.replace(found, rank=found.rank - taken, num_rows=found.num_rows - taken, undetermined=())
    topology = dataclasses.replace(
        top,
        row_joint=tuple(name for name in top.row_joint if name not in gone),
        slip_rows=tuple(int(number[k]) for k in top.slip_rows),
        analysis=found,
    )
    rows = groups_without(system.rows, gone, keep)
    closures = tuple(group for group in system.closures if not group.kind.may_depend_on_time)
    return dataclasses.replace(system, topology=topology, rows=rows, closures=closures)
