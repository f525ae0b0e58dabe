"""Removal of drives from a mechanism: their coordinates become independent."""

import dataclasses

import numpy as np

from ..checks import is_concrete
from ..constraints._constraint_rows import constraint_jacobian
from ..errors import ModelError
from ..model._rows import groups_without
from ..model._system import System


def release_drives(system: System, names, state) -> System:
    """The system without the drives of the joints `names`, their velocities added to the independent set.

    Raises: ModelError when a concrete state shows that drives are redundant: taking one off frees nothing.
    """
    if not names:
        return system
    top = system.topology
    found = top.analysis
    assert found is not None  # the mobility of a system with drives is counted when it is built
    keep = np.array([not (row in names and _is_drive(system, k)) for k, row in enumerate(top.row_joint)])
    number = np.cumsum(keep) - 1
    freed = tuple(top.joints[top.joint_index[name]].first_velocity for name in names)
    analysis = dataclasses.replace(
        found,
        rank=found.rank - len(freed),
        num_rows=found.num_rows - len(freed),
        independent=tuple(sorted({*found.independent, *freed})),
        independent_positions=tuple(sorted({*found.independent_positions, *freed})),
    )
    topology = dataclasses.replace(
        top,
        row_joint=tuple(name for name, kept in zip(top.row_joint, keep, strict=True) if kept),
        slip_rows=tuple(int(number[k]) for k in top.slip_rows),
        analysis=analysis,
    )
    rows = groups_without(system.rows, names, keep)
    released = dataclasses.replace(system, topology=topology, rows=rows)
    A = constraint_jacobian(released, state)
    if is_concrete(A) and np.linalg.matrix_rank(np.asarray(A), tol=1e-7) > analysis.rank:
        raise ModelError([f"the drives of {', '.join(names)} are redundant: releasing them gives no freedom"])
    return released


def _is_drive(system, k):
    """True if row k is no row of a closure: closures come first."""
    closures = sum(len(g.names) * g.kind.num_rows for g in system.closures)
    return k >= closures
