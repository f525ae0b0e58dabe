"""`reactions` of every joint: by sums over subtrees, multipliers, and compliances where statics is indeterminate.

Source: S1 (26)-(29).
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..assembly._state import HasStates, State
from ..checks import is_concrete, no_such
from ..constraints import _reaction_map as reaction_map
from ..constraints._linear_solver import solver_for
from ..errors import UnknownNameError
from ..kinematics._poses import node_parameters
from ..model._changes import with_changes
from ..model._entry_points import rates_of, states_of
from ..model._system import System
from ..runtime import as_dtype, jit, map_chunked
from ..typing import ArrayLike
from ._result import Reactions


class _Options(NamedTuple):
    """Options of `reactions`; `columns` of the actuators, None where the drives produce the motion."""

    frame: str
    side: str
    compliance: dict
    method: str
    columns: tuple | None

    def actuators(self, system):
        """Slice of the velocities of each actuator, by name."""
        top = system.topology
        return {top.column_joint_name[a]: slice(a, b) for a, b in self.columns or ()}


def reactions_of_freedoms(
    system: System, state: State, accelerations: ArrayLike, columns: Sequence[int], frame: str = "world"
) -> Reactions:
    """`reactions` at a state whose accelerations (nv,) efforts on single velocities produce, in place of all drives.

    Args: columns: velocities that determine the motion, one for each freedom: then their efforts are unique, which
    those on all velocities of joints with several are not.
    """
    acceleration = as_dtype(accelerations, state.coordinates.dtype)
    own = tuple((int(k), int(k) + 1) for k in columns)
    options = _Options(frame, "child", {}, solver_for(system, "auto"), own)
    return _along(system, states_of(system, state), acceleration, False, options)


@jit  # asked once it takes milliseconds; in a loop of the user's it is part of a full program
def _along(system, states, accelerations, batched, options):
    """`reactions_at` of a state, or of every one of a batch."""
    from ._balance import reactions_at  # with all of dynamics and statics, which an answer of the store does not need

    P = node_parameters(system)

    def one(row):
        here = with_changes(system, row[0])
        return reactions_at(here, P if row[0].changes is None else node_parameters(here), *row, options)

    return map_chunked(one, (states, accelerations)) if batched else one((states, accelerations))


def _compliance(name, value, dtype):
    """Check the compliances of one joint, one number or six.  Raises: ValueError."""
    value = as_dtype(value, dtype)
    if value.shape not in ((), (6,)):
        raise ValueError(f"compliance of {name!r} must be one number or six, got shape {value.shape}")
    if is_concrete(value) and not np.all(np.isfinite(value) & (np.asarray(value) >= 0.0)):
        raise ValueError(f"compliance of {name!r} must be finite and not negative, got {np.asarray(value)}")
    return value


def reactions(
    system: System,
    motion: State | HasStates,
    frame: str = "world",
    side: str = "child",
    compliance: Mapping | None = None,
    method: str = "auto",
    accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None,
    actuators: Sequence[str] | None = None,
) -> Reactions:
    """Reactions of all joints at a state or along a motion.

    Args:
        motion: a State, an Equilibrium, a Motion, or a State with one leading axis.
        frame: "world" axes, or "joint": those of the joint's frame on that side.
        side: "child": the wrench the parent applies on the child; "parent": the opposite one on the parent.
        compliance: name -> (6,), of joints and two-frame constraints for force x, y, z [m/N] and moment x, y, z
            [rad/(N m)] in their own axes on the child's side; default 1 and 1 / length^2 for those not named.
        method: how loops and drives are solved, with equal results: "dense" in the tree's velocities; "block-sparse"
            on the graph of bodies, linear in their number, which is "frontal" or "multifrontal" as the graph is
            narrow or wide; default that of the build, which `describe` prints.
        accelerations: (nv,) along a given trajectory, with the states' leading axis if they have one, or by joint;
            default those that the drives and force elements cause.
        actuators: joints whose efforts produce the motion in place of all drives and frame paths, see
            `inverse_dynamics`; default the drives, or every joint of the tree where accelerations are given.

    Returns: Reactions by joint name, and of two-frame constraints by theirs (on frame B, or A for the parent side).

    Redundant loops: components that statics cannot determine have `unique_force` or `unique_moment` False.  They are
    distributed so that the complementary energy `1/2 sum w.C w` of the compliances is least; by default that is the
    least norm, moments over the system's characteristic length `system.length`: the largest distance of its frames
    from their middle in the reference pose, so that the unit of length does not matter, but a frame far away does.
    Give `compliance` where the shares matter.  The friction of joints follows the same compliances; that of a motion
    follows the default ones.

    Raises: ValueError for an unknown frame, side, method or name, and accelerations of another shape; ModelError for
    an actuator without freedom.  Source: S1 (26)-(29).
    """
    if frame not in ("world", "joint") or side not in ("child", "parent"):
        raise ValueError(f"frame must be 'world' or 'joint' and side 'child' or 'parent', got {frame!r}, {side!r}")
    states = states_of(system, motion)
    compliance = {} if compliance is None else dict(compliance)
    names = [name for name, *_ in reaction_map.reaction_carriers(system)]
    for name in compliance:
        if name not in names:
            raise UnknownNameError(f"compliance: {no_such('joint or constraint', name, names)}")
    compliance = {name: _compliance(name, c, states.coordinates.dtype) for name, c in compliance.items()}
    if accelerations is not None:
        accelerations = as_dtype(rates_of(system, states, accelerations, "accelerations"), states.coordinates.dtype)
        every = [name for name, *_ in system.topology.structure]
        actuators = every if actuators is None else actuators
    options = _Options(frame, side, compliance, solver_for(system, method), _columns(system, actuators))
    found = _along(system, states, accelerations, states.coordinates.ndim == 2, options)
    return dataclasses.replace(found, note=note) if (note := getattr(motion, "note", "")) else found


def _columns(system, actuators):
    """Velocities of the actuators; None for none."""
    if actuators is None:
        return None
    from ._inverse_dynamics import actuated_columns

    return actuated_columns(system, actuators)
