"""The static half of a system: names, tree, cuts and index maps; hashable: equal ones share compiled code."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ._internal_states import InternalRecord
from ._tree import Tree


@dataclass(frozen=True)
class JointRecord:
    """One declared joint.  `parent` and `child` are body indices as in the tree (-1 ground); slices into the
    coordinates and velocities are empty for a cut joint.  `frames` are its (parent, child) frame indices.
    `symbol`: how pictures show it; `units`: of its coordinates.
    `is_hidden`: a weld inside a body that the builder split; no bearing, so it has no compliance of its own.
    `is_elastic`: its motion is a deformation of an elastic body or of a beam."""

    name: str
    kind: str
    parent: int
    child: int
    is_cut: bool
    frames: tuple[int, int]
    first_coordinate: int = 0
    num_coordinates: int = 0
    first_velocity: int = 0
    num_velocities: int = 0
    labels: tuple[str, ...] = ()
    is_hidden: bool = False
    is_elastic: bool = False
    symbol: str = "point"
    units: tuple[str, ...] = ()

    @property
    def coordinates(self) -> slice:
        return slice(self.first_coordinate, self.first_coordinate + self.num_coordinates)

    @property
    def velocities(self) -> slice:
        return slice(self.first_velocity, self.first_velocity + self.num_velocities)


@dataclass(frozen=True)
class Mobility:
    """Freedoms and redundancy at a pose.

    `rank` of the constraint rows, `mobility` = velocities - rank, `redundant` = rows - rank.  `undetermined` marks
    per joint, then per two-frame constraint, the reaction components (force x y z, moment x y z, its own axes) that
    statics cannot determine; `redundant_names` are theirs, and of couplers and drives that share.  `independent` are
    the velocity columns of the KIC; `independent_positions` adds those that only rows of velocity restrict;
    `dependencies` are, of every velocity column, the columns of that set (by their place there) on which it depends;
    empty where no row restricts positions.  `pose_dependent_rows` are the position rows (by their place among them)
    whose redundancy depends on the pose, as that of three parallel cranks.
    `ranks` are those of the position rows of each joint or constraint by itself.
    """

    rank: int
    num_rows: int
    num_velocities: int
    independent: tuple[int, ...]
    undetermined: tuple[tuple[bool, ...], ...] = ()
    redundant_names: tuple[str, ...] = ()
    independent_positions: tuple[int, ...] = ()
    dependencies: tuple[tuple[int, ...], ...] = ()
    pose_dependent_rows: tuple[int, ...] = ()
    ranks: tuple[tuple[str, int], ...] = ()

    @property
    def mobility(self) -> int:
        return self.num_velocities - self.rank

    @property
    def redundant(self) -> int:
        return self.num_rows - self.rank


@dataclass(frozen=True)
class CircuitRecord:
    """An element or node of a hydraulic circuit.

    Attributes:
        nodes: (port, node) of each port of an element, none for a node; a chamber of a cylinder is "boom.p0".
        shaft: the force element of a pump on a joint, empty for the others.
    """

    name: str
    nodes: tuple[tuple[str, str], ...] = ()
    shaft: str = ""


@dataclass(frozen=True)
class Topology:
    """Names, the tree of bodies and the tree of nodes (simple joints), in depth-first order.

    Each body hangs on its tree joint, a run of nodes; `body_node` is the last node of the run (or the parent's node
    for a weld, -1 on the ground).  A ball is three nodes with one quaternion.  `frame_node` says which node carries
    each frame.  `row_joint` names the joint or constraint of every constraint row; `slip_rows` are those of velocity
    alone.  `guess` are coordinates by joint where searches for a pose begin; `analysis` is of the pose they lead to;
    `linear_solver` is "dense", "frontal" or "multifrontal"; `internal` are the internal states of force elements
    and blocks; `circuits` are the parts of hydraulic circuits, nodes first.
    """

    body_names: tuple[str, ...]
    bodies: Tree
    body_node: tuple[int, ...]
    body_joint: tuple[int, ...]
    nodes: Tree
    node_kind: tuple[str, ...]
    node_joint: tuple[int, ...]
    node_coordinate: tuple[int, ...]
    num_coordinates: int
    joints: tuple[JointRecord, ...]
    frame_names: tuple[str, ...]
    frame_node: tuple[int, ...]
    frame_body: tuple[int, ...]
    row_joint: tuple[str, ...] = ()
    slip_rows: tuple[int, ...] = ()
    guess: tuple[tuple[str, tuple[float, ...]], ...] = ()
    analysis: Mobility | None = field(default=None)
    linear_solver: str = "dense"
    internal: tuple[InternalRecord, ...] = ()
    circuits: tuple[CircuitRecord, ...] = ()

    @property
    def num_velocities(self) -> int:
        return self.nodes.size

    @property
    def num_internal(self) -> int:
        """Number of numbers of all internal states."""
        return sum(record.size for record in self.internal)

    @property
    def joint_names(self) -> tuple[str, ...]:
        return tuple(j.name for j in self.joints)

    @cached_property
    def quaternion_joints(self) -> tuple[str, ...]:
        """Names of the joints whose velocities are not the rates of their coordinates."""
        names = (
            self.joints[j].name for j, kind in zip(self.node_joint, self.node_kind, strict=True) if kind == "ball"
        )
        return tuple(dict.fromkeys(names))

    @cached_property
    def structure(self) -> tuple:
        """Layout of a state: (joint, kind, numbers of coordinates and velocities, labels) in tree order."""
        moving = [j for j in self.joints if j.num_velocities]
        moving.sort(key=lambda j: j.first_velocity)
        return tuple((j.name, j.kind, j.num_coordinates, j.num_velocities, j.labels) for j in moving)

    @cached_property
    def joint_index(self) -> dict:
        return {j.name: i for i, j in enumerate(self.joints)}

    @cached_property
    def frame_index(self) -> dict:
        return {name: i for i, name in enumerate(self.frame_names)}

    @property
    def cut_joints(self) -> tuple[str, ...]:
        return tuple(j.name for j in self.joints if j.is_cut)

    @property
    def num_rows(self) -> int:
        return len(self.row_joint)

    @cached_property
    def position_rows(self) -> np.ndarray:
        """Rows that restrict positions, in the order of the residual."""
        return np.setdiff1d(np.arange(self.num_rows), self.slip_rows)

    @property
    def mobility(self) -> int:
        return self.num_velocities if self.analysis is None else self.analysis.mobility

    @cached_property
    def balls(self) -> np.ndarray:
        """First node of every ball."""
        kinds = np.array(self.node_kind)
        return np.nonzero(kinds == "ball")[0][::3]

    @cached_property
    def is_simple(self) -> bool:
        """True if every coordinate is the integral of one velocity: there are no quaternions."""
        return len(self.balls) == 0

    @cached_property
    def spins(self) -> np.ndarray:
        """Array (nodes,): 1 where the column is a rotation (revolute, screw, ball), 0 for a slide; S2 (11) alpha."""
        return np.array([kind != "prismatic" for kind in self.node_kind], float)

    @cached_property
    def deformations(self) -> np.ndarray:
        """Velocity columns of the deformations of elastic bodies and beams."""
        return np.array([k for k, j in enumerate(self.node_joint) if self.joints[j].is_elastic], int)

    @cached_property
    def independent_deformations(self) -> tuple[int, ...]:
        """The deformations that other motions need not take up where loops close."""
        independent = () if self.analysis is None else self.analysis.independent_positions
        return tuple(int(k) for k in self.deformations if k in independent)

    @cached_property
    def turns(self) -> np.ndarray:
        """Array (nodes,): 1 where the node's own coordinate is an angle about z."""
        return np.array([kind in ("revolute", "screw") for kind in self.node_kind], float)

    @cached_property
    def has_translations(self) -> bool:
        """True if some node moves along its z: a slide or a screw."""
        return any(kind in ("prismatic", "screw") for kind in self.node_kind)

    @cached_property
    def column_frame(self) -> np.ndarray:
        """Node whose frame carries each column: itself, but the last node of a ball for all its three."""
        frame = np.arange(self.nodes.size)
        for first in self.balls:
            frame[first : first + 3] = first + 2
        return frame

    @cached_property
    def column_joint_name(self) -> tuple[str, ...]:
        return tuple(self.joints[j].name for j in self.node_joint)
