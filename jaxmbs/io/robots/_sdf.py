"""Mechanisms from SDF, the files of Gazebo and Drake."""

import os
from pathlib import Path

from ...builder import SystemBuilder
from ...builder._arrays import compose_poses
from ...errors import ModelFileError
from ...forces import SpringDamper
from ...joints import Coupler, Free, Prismatic, Revolute, Screw, Spherical, Weld
from ...typing import ArrayLike
from ._friction import add_friction
from ._imported import Imported, JointLimits, UniqueNames, count_nouns, frame_names_of_joints, quote_names
from ._link_tree import GROUND, IDENTITY, LinkJoint, TreeLink, declare_links, pose_of_pair
from ._reading_options import require_choices
from ._sdf_elements import text_vector
from ._sdf_models import SdfModels
from ._sdf_poses import WORLD
from ._stops import add_stops, describe_ignored_limits
from ._xml_text import read_xml

_MOST_FAULTS = 50


def read_sdf(
    path: str | os.PathLike,
    *,
    base: str = "free",
    fixed: str = "frames",
    stops: float | None = None,
    gravity: ArrayLike | None = None,
    inertias: str = "refuse",
    friction: str = "smooth",
) -> Imported:
    """A mechanism from an SDF file: links, inertias, joints that may close loops, frames, models inside models.

    Mimics are couplers, springs, damping and friction of joints force elements.

    Poses are taken as the version of the file has them (`relative_to`, `expressed_in`, `attached_to`).  Links and
    joints keep their names, those of several models with the model before them, "arm::link".  Shapes are never
    opened; plugins, sensors and what else belongs to simulators is left out and listed.

    Args:
        base: "free" lets links that no joint carries float, as simulators do, unless their model is static; "fixed"
            holds them where they are.
        fixed, stops, inertias, friction: as of `read_urdf`.
        gravity: (3,) [m/s^2]; by default that of the file's world, else 9.81 down.

    Raises: ModelFileError with every fault of the file; ValueError for unknown options.
    """
    path = Path(path)
    require_choices(base=base, fixed=fixed, inertias=inertias, friction=friction)
    faults, notes = list[str](), list[str]()
    models, world = _models(path, inertias, faults, notes)
    if faults:
        more = [f"and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ModelFileError(path, faults[:_MOST_FAULTS] + more)
    if gravity is None:
        found = None if world is None else world.find("gravity")
        gravity = (0.0, 0.0, -9.81) if found is None else text_vector("gravity", found, 3, faults)
    builder = SystemBuilder(gravity)
    tree = _Tree(models, base == "free")
    homes = declare_links(builder, tree.links(), welds=fixed == "welds", any_inertia=inertias == "accept")
    tree.close_loops(builder, homes)
    _add_frames(builder, models, tree, homes)
    limits, losses, left = _laws(builder, models, tree)
    add_stops(builder, limits, stops)
    dropped = [f"{count_nouns(number, what)}" for what, number in models.left.items()] + left
    rubbing = add_friction(builder, losses, friction)
    dropped += [f"friction of the joints {quote_names(rubbing)}"] if rubbing else []
    dropped += describe_ignored_limits(limits, stops)
    return Imported(builder, tuple(dropped), limits, notes=(*notes, *tree.names.notes("link or frame")))


def _models(path, mode, faults, notes):
    """All models, and the world that holds them, None without one."""
    root = read_xml(path)
    if root.tag != "sdf":
        raise ModelFileError(path, [f"its outermost element is <{root.tag}>, that of an SDF is <sdf>"])
    world = root.find("world")
    holder = root if world is None else world
    found = holder.findall("model")
    if not found:
        faults.append("it has no model")
    if holder.find("include") is not None:
        faults.append("it includes other files; `gz sdf -p world.sdf` writes them into one")
    models = SdfModels(root.get("version", "1.6"), mode, faults, notes)
    for model in found:
        if not model.get("name"):
            faults.append("a model has no name")
        models.read(model, f"{model.get('name')}::" if len(found) > 1 else "", WORLD)
    models.read_joints()
    return models, world


class _Tree:
    """Spanning tree of links, names of bodies and joints, and joints that close loops."""

    def __init__(self, models, floats: bool) -> None:
        self._models, self._floats = models, floats
        self.carrying: dict[str, str] = {}  # link -> joint
        self.closing: list[str] = []
        for name, joint in models.joints.items():
            fixed = joint.child == WORLD or joint.child in models.static
            if fixed or joint.child in self.carrying or self._carries(joint.child, joint.parent):
                self.closing.append(name)
            else:
                self.carrying[joint.child] = name
        self.names = UniqueNames(GROUND, *frame_names_of_joints(models.joints))
        self.called = {name: self.names(name) for name in models.masses}
        self._bases = UniqueNames(*models.joints)
        self.closing = [name for name in self.closing if not self._is_still(name)]

    def _is_still(self, name):
        joint = self._models.joints[name]
        return all(end == WORLD or end in self._models.static for end in (joint.parent, joint.child))

    def _carries(self, first, second) -> bool:
        """True if the first link is the second or carries it."""
        while second != first and second in self.carrying:
            second = self._models.joints[self.carrying[second]].parent
        return second == first

    def links(self) -> list[TreeLink]:
        """All links, parents before children."""
        children: dict[str, list[str]] = {}
        for link, joint in self.carrying.items():
            children.setdefault(self._models.joints[joint].parent, []).append(link)
        order = [name for name in self._models.masses if name not in self.carrying] + children.pop(WORLD, [])
        for name in order:
            order += children.get(name, [])
        return [self._link(name) for name in order]

    def _link(self, name):
        poses, masses = self._models.poses, self._models.masses[name]
        if name not in self.carrying:
            held = name in self._models.static or not self._floats
            base = LinkJoint(
                self._bases("base" if len(self.called) == 1 else f"{name}.base"), Weld() if held else Free()
            )
            place = poses.pose(name)
            start = (IDENTITY, place) if held else (place, IDENTITY)
            return TreeLink(self.called[name], None, start[1], (base._replace(before=start[0]),), *masses)
        joint = self._models.joints[self.carrying[name]]
        parent = None if joint.parent == WORLD else self.called[joint.parent]
        place = poses.between(joint.parent, name)
        return TreeLink(
            self.called[name], parent, place, tuple(self._joints(joint, poses.between(name, joint.name))), *masses
        )

    def _joints(self, joint, at):
        kinds = joint_kinds(joint)
        for k, (name, kind) in enumerate(kinds):
            yield LinkJoint(name, kind, at if k == 0 else IDENTITY, at if k == len(kinds) - 1 else IDENTITY)

    def close_loops(self, builder, homes) -> None:
        """Declare the joints that the tree has not."""
        for name in self.closing:
            joint, poses = self._models.joints[name], self._models.poses
            ends = []
            for link in (joint.parent, joint.child):
                home = homes[None if link == WORLD else self.called[link]]
                ends.append((home.body, compose_poses(home.pose, poses.between(link, name))))
            *between, (last, kind) = joint_kinds(joint)
            (parent, near), (child, far) = ends
            for one, law in between:
                builder.body(f"{child}.{one}", 0.0)
                builder.joint(one, law, parent, f"{child}.{one}", pose_of_pair(near))
                parent, near = f"{child}.{one}", IDENTITY
            builder.joint(last, kind, parent, child, pose_of_pair(near), pose_of_pair(far))

    def home(self, homes, link):
        """Body and pose of a link in it."""
        return homes[None if link == WORLD else self.called[link]]


def joint_kinds(joint) -> list[tuple]:
    """(name, kind) of the one or two joints that stand for a joint."""
    directions = [axis.direction for axis in joint.axes]
    if joint.kind in ("universal", "revolute2"):
        return [(joint.name, Revolute(directions[0])), (f"{joint.name}.2", Revolute(directions[1]))]
    if joint.kind in ("ball", "fixed"):
        return [(joint.name, Spherical() if joint.kind == "ball" else Weld())]
    if joint.kind == "screw":
        return [(joint.name, Screw(directions[0], pitch=joint.pitch))]
    return [(joint.name, (Prismatic if joint.kind == "prismatic" else Revolute)(directions[0]))]


def _add_frames(builder, models, tree, homes):
    for name, on in models.frames.items():
        link = models.poses.link_of(on, f"frame {name!r}")
        home = tree.home(homes, link)
        R, p = compose_poses(home.pose, models.poses.between(link, name))
        builder.frame(tree.names(name), home.body, p, R)


def _laws(builder, models, tree):
    """Limits and friction losses by joint, and what was left out; springs, dampers and mimics are declared."""
    limits, losses, left = {}, {}, []
    tree_joints = set(tree.carrying.values())
    for joint in models.joints.values():
        for axis, (name, _) in zip(joint.axes, joint_kinds(joint), strict=False):
            if axis.limits != JointLimits():
                limits[name] = axis.limits
            if axis.stiffness or axis.damping:
                what = "spring" if axis.stiffness else "damper"
                builder.force(f"{name}.{what}", SpringDamper(axis.stiffness, axis.damping, axis.rest), joint=name)
            if axis.friction:
                losses[name] = axis.friction
            if axis.mimic is not None:
                leader, which, factor, offset = axis.mimic
                scope = joint.name[: joint.name.rfind("::") + 2] if "::" in joint.name else ""
                led = f"{scope}{leader}" + (".2" if which == "axis2" else "")
                builder.constraint(f"{name}.mimic", Coupler({name: 1.0, led: -factor}, offset))
    cut = [name for name in tree.closing if name not in tree_joints]
    for table in (limits, losses):
        for name in cut:
            if table.pop(name, None) is not None:
                left.append(f"limits or friction of the joint {name!r}, which closes a loop")
    return limits, losses, left
