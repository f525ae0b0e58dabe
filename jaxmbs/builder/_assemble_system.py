"""Assembly of the `System` pytree from declarations and a spanning tree."""

import itertools

import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..forces._fields import as_function
from ..forces._internal_state import internal_layout
from ..forces._path_ports import PathPort, WinchPort
from ..forces._ports import JointPort, port_of
from ..forces._signals import as_signal
from ..friction._joint_friction import bristle_groups
from ..joints import AbstractClosure, FramePath
from ..joints._rows import DriveRow
from ..model._internal_states import internal_records
from ..model._pose import Pose
from ..model._system import ClosureGroup, ForceGroup, System
from ..model._topology import JointRecord, Topology
from ..model._tree import Tree
from ..model.inertia import as_matrix
from ._arrays import compose_poses, joint_poses, rotation_and_position, stack, stack_poses, tree_arrays
from ._declarations import GROUND, Model, resolve_frame
from ._elastic import elastic_groups, elastic_items
from ._friction import joint_friction_of
from ._groups import group_by_structure
from ._measures import make_measures
from ._row_groups import RowItem, row_groups
from ._spanning_tree import SpanningTree


class _FrameList:
    """List of frames: names, bodies and poses in body axes."""

    def __init__(self):
        self.names, self.bodies, self.poses = [], [], []

    def add(self, name, body, pose):
        self.names.append(name)
        self.bodies.append(body)
        self.poses.append(pose)
        return len(self.names) - 1


def assemble_system(model: Model, tree: SpanningTree, guess: dict | None = None) -> System:
    """The system of a validated model; its mobility is not counted yet.  guess: coordinates of a pose by joint."""
    order, parent, via, _, cuts = tree
    bodies, named, joints = model.bodies, model.frames, model.joints
    poses = joint_poses(bodies, joints, named)
    in_node, placements, leads = tree_arrays(*tree[:4], joints, poses)
    index = {GROUND: -1, **{name: k for k, name in enumerate(order)}}
    nodes, body_node = _node_rows(order, parent, via, joints, index)

    frames = _FrameList()
    for name in (GROUND, *order):
        frames.add(name, name, rotation_and_position(Pose()))
    for frame in named.values():
        frames.add(frame.name, frame.body, rotation_and_position(frame.pose))
    joint_frames = {
        name: tuple(
            frames.add(f"{name}.{end}", body, pose)
            for end, body, pose in zip(("parent", "child"), (j.parent, j.child), poses[name], strict=True)
        )
        for name, j in joints.items()
    }
    records = _joint_records(joints, joint_frames, nodes, cuts, index)
    record = {r.name: r for r in records}
    measures = make_measures(model, lambda name, body, pose: frames.add(name, body, rotation_and_position(pose)))
    rubbing = joint_friction_of(model.friction, joints, record)
    force_groups = _force_groups(model.forces, frames, record, bodies, named)
    closures, rows, row_names, slip_rows = _constraint_groups(
        model.constraints, joints, cuts, record, frames, bodies, named
    )

    topology = Topology(
        body_names=tuple(order),
        bodies=Tree(tuple(index[parent[b]] for b in order)),
        body_node=body_node,
        body_joint=tuple(list(joints).index(via[b]) for b in order),
        nodes=Tree(tuple(n[0] for n in nodes)),
        node_kind=tuple(n[1] for n in nodes),
        node_joint=tuple(list(joints).index(n[2]) for n in nodes),
        node_coordinate=tuple(n[3] for n in nodes),
        num_coordinates=sum(r.num_coordinates for r in records),
        joints=records,
        frame_names=tuple(frames.names),
        frame_node=tuple(-1 if b == GROUND else body_node[index[b]] for b in frames.bodies),
        frame_body=tuple(index[b] for b in frames.bodies),
        row_joint=row_names,
        slip_rows=slip_rows,
        guess=tuple((name, tuple(np.atleast_1d(x).astype(float).tolist())) for name, x in (guess or {}).items()),
        internal=internal_records((*force_groups, *bristle_groups(rubbing))),
        circuits=model.circuits,
    )
    return System(
        topology=topology,
        gravity=model.gravity,
        mass=_stack_numbers([bodies[b].mass for b in order]),
        com=_stack_numbers([bodies[b].com for b in order]),
        inertia=_stack_numbers([as_matrix(bodies[b].inertia) for b in order]),
        body_pose=stack_poses([in_node[b] for b in order]),
        placement=stack_poses(placements),
        lead=_stack_numbers(leads) if leads else jnp.zeros(0),
        frames=stack_poses(
            [compose_poses(in_node[b], pose) for b, pose in zip(frames.bodies, frames.poses, strict=True)]
        ),
        forces=force_groups,
        closures=closures,
        rows=rows,
        measures=measures,
        elastic=elastic_groups(group_by_structure(elastic_items(model.elastic, index, record))),
        friction=rubbing,
    )


def _stack_numbers(values):
    """Array of the numbers of bodies or nodes, one row each; a point may be a tuple with traced entries."""
    return stack(
        [_stack_traced(v) if isinstance(v, tuple | list) and not is_concrete(v) else v for v in values], float
    )


def _stack_traced(point):
    return jnp.stack([jnp.asarray(x, float) for x in point])


def _node_rows(order, parent, via, joints, index):
    """Rows (parent node, kind, joint, coordinate) of the node tree, and the last node of every body."""
    nodes, last, coordinate = [], {GROUND: -1}, 0
    for body in order:
        at = last[parent[body]]
        for node in joints[via[body]].kind.nodes:
            for _ in range(3 if node.kind == "ball" else 1):
                nodes.append((at, node.kind, via[body], coordinate))
                at = len(nodes) - 1
            coordinate += 4 if node.kind == "ball" else 1
        last[body] = at
    return nodes, tuple(last[b] for b in order)


def _joint_records(joints, joint_frames, nodes, cuts, index):
    """A `JointRecord` per declared joint."""
    records = []
    for name, joint in joints.items():
        mine = [k for k, node in enumerate(nodes) if node[2] == name]
        balls = any(nodes[k][1] == "ball" for k in mine)
        records.append(
            JointRecord(
                name=name,
                kind=type(joint.kind).__name__,
                parent=index[joint.parent],
                child=index[joint.child],
                is_cut=name in cuts,
                frames=joint_frames[name],
                first_coordinate=nodes[mine[0]][3] if mine else 0,
                num_coordinates=len(mine) + (1 if balls else 0),
                first_velocity=mine[0] if mine else 0,
                num_velocities=len(mine),
                labels=joint.kind.own_labels if mine else (),
                is_hidden=joint.is_hidden,
                is_elastic=joint.is_elastic,
                symbol=joint.kind.symbol,
                units=joint.kind.units if mine else (),
            )
        )
    return tuple(records)


def _force_groups(forces, frames, record, bodies, named):
    items, paths = [], {}
    for force in forces.values():
        if force.joint is not None and force.between is None:
            joint = record[force.joint]
            items.append((force.name, force.law, joint.first_velocity, joint.first_coordinate, JointPort()))
            continue
        ends = force.between if force.between is not None else (() if force.on is None else (force.on, force.on))
        labels, port = ("a", "b"), port_of(force.law)
        if isinstance(port, PathPort):
            labels = tuple(str(k) for k in range(port.num_frames))
            if force.joint is not None:
                joint = record[force.joint]
                port = WinchPort(port.num_frames, joint.first_velocity, joint.first_coordinate)
        places = []
        for label, reference in zip(labels, ends, strict=False):
            body, pose = resolve_frame(reference, bodies, named)
            places.append(frames.add(f"{force.name}.{label}", body, rotation_and_position(pose)))
        if isinstance(port, PathPort):
            paths[force.name] = tuple(places)
            places = [places[0], places[-1]]
        items.append((force.name, force.law, *(places or (0, 0)), port))
    return tuple(
        ForceGroup(
            names,
            port,
            first,
            second,
            law,
            internal_layout(members[0][1]),
            tuple(paths[name] for name in names) if isinstance(port, PathPort) else (),
        )
        for port, names, law, first, second, members in group_by_structure(items)
    )


def _constraint_groups(constraints, joints, cuts, record, frames, bodies, named):
    """Closure groups, row groups, the joint or constraint of each row, and the numbers of nonholonomic rows."""
    items = [(name, joints[name].kind, *record[name].frames, "closure") for name in cuts]
    declared = [
        RowItem(name, DriveRow(as_signal(j.drive)), (), (record[name],))
        for name, j in joints.items()
        if j.drive is not None
    ]

    def frames_of(item, labels):
        for label, reference in zip(labels, item.between or (), strict=False):
            body, pose = resolve_frame(reference, bodies, named)
            yield frames.add(f"{item.name}.{label}", body, rotation_and_position(pose))

    for item in constraints.values():
        if isinstance(item.law, AbstractClosure):
            items.append((item.name, _with_signals(item.law), *frames_of(item, "ab"), "closure"))
        else:
            own, mine = tuple(frames_of(item, itertools.count())), tuple(record[n] for n in item.law.joints)
            declared.append(RowItem(item.name, item.law.row(as_function), own, mine))
    groups, names, slips = [], [], []
    for _, group_names, kind, first, second, members in group_by_structure(items):
        basis = stack([member[1].basis() for member in members])
        groups.append(ClosureGroup(group_names, first, second, kind, basis))
        for name in group_names:
            names += [name] * kind.num_rows
            slips += range(len(names) - kind.num_slips, len(names))
    rows, more, more_slips = row_groups(declared, len(names), record.values())
    return tuple(groups), rows, (*names, *more), (*slips, *more_slips)


def _with_signals(law):
    """A constraint between frames whose functions of time are signals."""
    if not isinstance(law, FramePath):
        return law
    signals = (None if path is None else as_signal(path) for path in (law.position, law.rotation))
    return FramePath(*signals, law.hold)
