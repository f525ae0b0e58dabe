"""The system: a pytree whose topology is static and whose every physical number is a leaf."""

import abc

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..checks import place_of
from ..errors import ModelError
from ..forces._base import AbstractLaw
from ..forces._port import AbstractPort
from ..friction._joint_friction import JointFriction
from ..joints._base import AbstractJoint
from ..runtime import as_array
from ..typing import ArrayLike
from ._changes import Changes
from ._describe import describe, describe_html, part_lines, summary
from ._elastic import ElasticGroup
from ._entry_points import check_state
from ._internal_states import InternalStates
from ._open_friction import open_friction_lines
from ._pose import Pose
from ._rows import RowGroup
from ._scale import scale_lines
from ._signals import BlockGroup, MeasureGroup
from ._topology import Topology


class ForceGroup(eqx.Module):
    """Force elements of one law on one kind of port, their parameters stacked.

    `port` is one of `forces._ports`; `first` and `second` are frame indices, for a joint its velocity and coordinate;
    `internal` are (name, shape, unit) of each internal state of the law; `frames` are all frames of each element
    where it acts on several, of which `first` and `second` are then the ends.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    port: AbstractPort = eqx.field(static=True)
    first: tuple[int, ...] = eqx.field(static=True)
    second: tuple[int, ...] = eqx.field(static=True)
    law: AbstractLaw
    internal: tuple[tuple[str, tuple[int, ...], str], ...] = eqx.field(static=True, default=())
    frames: tuple[tuple[int, ...], ...] = eqx.field(static=True, default=())


class ClosureGroup(eqx.Module):
    """Cut joints or two-frame constraints of one kind; `basis` (n, 3, 3) turns canonical axes into frame axes."""

    names: tuple[str, ...] = eqx.field(static=True)
    first: tuple[int, ...] = eqx.field(static=True)
    second: tuple[int, ...] = eqx.field(static=True)
    kind: AbstractJoint
    basis: Float[Array, "n 3 3"]


class AbstractState(eqx.Module):
    """A state of a mechanism as rooms below its assembly read it: `State`, which `assembly` finds.

    Attributes:
        t: (...) [s]; coordinates, velocities: (..., nq), (..., nv) of the tree's joints.
        structure: the layout of the system that it was made for; None by hand.
        internal: internal states of force elements; changes: numbers that events have changed.
    """

    t: eqx.AbstractVar[Float[Array, "..."]]
    coordinates: eqx.AbstractVar[Float[Array, "... nq"]]
    velocities: eqx.AbstractVar[Float[Array, "... nv"]]
    structure: eqx.AbstractVar[tuple | None]
    internal: eqx.AbstractVar[InternalStates | None]
    changes: eqx.AbstractVar[Changes | None]

    @abc.abstractmethod
    def topology_at(self, system: "System") -> Topology:
        """The topology of a system with the mobility counted at this state."""


class System(eqx.Module):
    """A mechanism, built by `SystemBuilder` and evaluated by functions `f(system, state, ...)`.

    Leaves: gravity (3,) [m/s^2]; per body mass [kg], com [m] and inertia [kg m^2] about it in body axes, and the
    body's pose in its node; per node (simple joint) its placement in the parent node and its lead [m/rad]; per frame
    its pose in its node; the parameters of forces, constraints, friction, elastic bodies, measures and blocks
    (these in the order of their evaluation); the length [m] that a concrete build finds for distances and angles.
    """

    topology: Topology = eqx.field(static=True)
    gravity: Float[Array, "3"]
    mass: Float[Array, " bodies"]
    com: Float[Array, "bodies 3"]
    inertia: Float[Array, "bodies 3 3"]
    body_pose: Pose
    placement: Pose
    lead: Float[Array, " nodes"]
    frames: Pose
    forces: tuple[ForceGroup, ...] = ()
    closures: tuple[ClosureGroup, ...] = ()
    rows: tuple[RowGroup, ...] = ()
    elastic: tuple[ElasticGroup, ...] = ()
    measures: tuple[MeasureGroup, ...] = ()
    blocks: tuple[BlockGroup, ...] = ()
    length: Float[Array, ""] = eqx.field(default_factory=lambda: as_array(1.0))
    friction: JointFriction | None = None

    @property
    def has_constraints(self) -> bool:
        """True if constraint rows (loops, drives, couplers, ...) restrict the tree."""
        return self.topology.num_rows > 0

    @property
    def joint_friction(self) -> JointFriction:
        """`friction` of a system in which some joint rubs."""
        assert self.friction is not None
        return self.friction

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the constraints between frames that follow a path in time."""
        return tuple(name for group in self.closures if group.kind.may_depend_on_time for name in group.names)

    @property
    def is_rigid_tree(self) -> bool:
        """True if no row restricts the tree and no body deforms: it is solved body by body, without a matrix."""
        return not self.has_constraints and not self.elastic

    def coordinates(self, state: AbstractState) -> dict:
        """Joint coordinates of a state by joint name: (..., ) for one freedom, else (..., n); tree joints only."""
        check_state(self, state)
        return coordinates_by_joint(self.topology, state.coordinates)

    def velocities(self, state: AbstractState) -> dict:
        """Joint velocities of a state by joint name: (..., ) for one freedom, else (..., n); tree joints only."""
        check_state(self, state)
        return velocities_by_joint(self.topology, state.velocities)

    def by_joint(self, values: ArrayLike) -> dict:
        """Rates, accelerations, efforts or rows of a matrix (..., nv) by joint name: (..., ) for one freedom, else
        (..., n); tree joints only.

        Raises: ValueError for another number of values.
        """
        values = as_array(values)
        if values.shape[-1:] != (self.topology.num_velocities,):
            raise ValueError(f"the last axis must be the {self.topology.num_velocities} velocities: {values.shape}")
        return velocities_by_joint(self.topology, values)

    def columns(self, *names: str) -> np.ndarray:
        """Columns of the velocities of joints, `mass_matrix(system, state)[:, system.columns("crank")]`.

        Raises: UnknownNameError; ModelError for a joint without velocities: a weld, or one that closes a loop.
        """
        found = [np.zeros(0, int)]
        for name in names:
            joint = self.topology.joints[place_of("joint", name, self.topology.joint_names)]
            if not joint.num_velocities:
                raise ModelError([f"joint {name!r} has no velocities of its own in the tree"])
            found.append(np.arange(joint.velocities.start, joint.velocities.stop))
        return np.concatenate(found)

    def describe(self, state: AbstractState | None = None) -> str:
        """Bodies, joints, loops, freedoms, redundant constraints and the names of all other parts, as text.

        Args: state: the State at which freedoms and redundancy are counted (default: the pose of the build).
        """
        if state is None:
            return describe(self.topology, rows=self.rows, more=self._more_lines())
        check_state(self, state)
        return describe(state.topology_at(self), self.topology.analysis, self.rows, self._more_lines())

    def doubts(self) -> list[str]:
        """Sentences on what may not be as it was meant: loads of rubbing joints that are open, numbers far out of the
        model's own scale."""
        return [*open_friction_lines(self), *scale_lines(self)]

    def __repr__(self) -> str:
        return f"System: {summary(self.topology)}"

    def _repr_html_(self) -> str:
        return describe_html(self.topology, self.rows, self._more_lines())

    def _more_lines(self):
        return [*part_lines(self), *self.doubts()]


def coordinates_by_joint(topology: Topology, values: Array) -> dict:
    """Coordinates (..., nq) by the name of the joint."""
    return _by_joint(topology, values, lambda j: j.coordinates)


def velocities_by_joint(topology: Topology, values: Array) -> dict:
    """Velocities (..., nv) by the name of the joint."""
    return _by_joint(topology, values, lambda j: j.velocities)


def _by_joint(topology, values, part):
    named = {}
    for joint in topology.joints:
        index = part(joint)
        if index.stop - index.start == 1:
            named[joint.name] = values[..., index.start]
        elif index.stop > index.start:
            named[joint.name] = values[..., index]
    return named
