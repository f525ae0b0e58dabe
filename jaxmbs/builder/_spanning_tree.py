"""Spanning tree of the graph of bodies and joints, and the joints that are cut."""

from typing import NamedTuple

from ..errors import ModelError
from ..model._tree import depth_first
from ._declarations import GROUND, Joint


class SpanningTree(NamedTuple):
    """Bodies in depth-first order; parent and joint of each; joints traversed from child to parent; cut joints."""

    order: list[str]
    parent: dict[str, str]
    via: dict[str, str]
    backwards: set[str]
    cuts: list[str]


def spanning_tree(bodies, joints: dict[str, Joint], keep: set[str], cut: set[str]) -> SpanningTree:
    """The tree of a model.

    Joints in `keep` (they carry a law or a drive) enter the tree first, then the others as declared; those in `cut`
    and those that would close a loop are the cuts.  Joints are then directed away from the ground.

    Raises:
        ModelError: bodies that no joint connects to the ground; joints that cannot be traversed from child to parent.
    """
    group = {name: name for name in (GROUND, *bodies)}

    def find(x):
        while group[x] != x:
            group[x] = group[group[x]]
            x = group[x]
        return x

    neighbours: dict = {name: [] for name in group}
    cuts = []
    for name in sorted(joints, key=lambda n: n not in keep):
        joint = joints[name]
        a, b = find(joint.parent), find(joint.child)
        if name in cut or a == b:
            cuts.append(name)
            continue
        group[a] = b
        neighbours[joint.parent].append(name)
        neighbours[joint.child].append(name)
    faults = [
        f"body {name!r} is not connected to the ground: add joints (Free() if it floats)"
        for name in bodies
        if find(name) != find(GROUND)
    ]
    parent, via, backwards = _direct_joints(joints, neighbours)
    faults += [
        f"joint {name!r} ({type(joints[name].kind).__name__}) is declared from its outer to its inner body: swap its "
        "parent and child"
        for name in backwards
        if not joints[name].kind.is_reversible
    ]
    if faults:
        raise ModelError(faults)
    parent = {b: parent[b] for b in bodies}
    order = depth_first({b: None if p == GROUND else p for b, p in parent.items()})
    return SpanningTree(order, parent, via, backwards, [n for n in joints if n in set(cuts)])


def _direct_joints(joints, neighbours):
    """Direct the joints away from the ground, breadth first: parent body and parent joint of each body, joints
    traversed from child to parent."""
    parent, via, backwards, queue = {GROUND: None}, {}, set(), [GROUND]
    for body in queue:
        for name in neighbours[body]:
            joint = joints[name]
            other = joint.child if joint.parent == body else joint.parent
            if other in parent:
                continue
            parent[other], via[other] = body, name
            if joint.parent != body:
                backwards.add(name)
            queue.append(other)
    return parent, via, backwards
