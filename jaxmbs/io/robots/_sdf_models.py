"""Models of an SDF with those inside them as one list of links, joints and frames, all by full names."""

import collections
import re
import xml.etree.ElementTree as ET
from typing import NamedTuple

import numpy as np

from ._link_tree import IDENTITY
from ._sdf_elements import SdfAxis, pose_of, sdf_axis, sdf_inertial, text_number
from ._sdf_poses import WORLD, NamedPose, PoseTable

KINDS = ("revolute", "continuous", "prismatic", "ball", "fixed", "universal", "revolute2", "screw")
_LISTED = ("plugin", "sensor", "light", "projector", "particle_emitter", "gripper", "audio_source", "audio_sink")
_KNOWN = {
    "model": {"pose", "link", "joint", "frame", "model", "include", "static", *_LISTED},
    "link": {"pose", "inertial", "visual", "collision", *_LISTED},
    "joint": {"pose", "parent", "child", "axis", "axis2", "screw_thread_pitch", "thread_pitch", *_LISTED},
}
_SILENT = {"self_collide", "allow_auto_disable", "must_be_base_link", "physics"}


class SdfJoint(NamedTuple):
    """A joint: links by full name, its frame's pose, its axes and the advance of a screw [m/rad]."""

    name: str
    kind: str
    parent: str
    child: str
    axes: tuple[SdfAxis, ...]
    pitch: float


class SdfModels:
    """All that models hold.

    Attributes:
        poses: of links, joints, frames and models.
        masses: (mass, centre, inertia) of links by name; joints, frames: by name; static: links that never move.
        left: parts that are not read, counted.
    """

    def __init__(self, version: str, mode: str, faults: list[str], notes: list[str]) -> None:
        self.poses = PoseTable(faults)
        self.masses: dict[str, tuple] = {}
        self.joints: dict[str, SdfJoint] = {}
        self.frames: dict[str, str] = {}
        self.static: set[str] = set()
        self.left: collections.Counter[str] = collections.Counter()
        self._version = tuple(map(int, re.findall(r"\d+", version)[:2]))
        self._mode, self._faults, self._notes = mode, faults, notes
        self._later: list[tuple[ET.Element, str]] = []

    def read(self, model: ET.Element, scope: str, parent: str, is_static: bool = False) -> None:
        """Enter a model.  Args: scope: what its names begin with; parent: full name of the frame it is placed in."""
        where = f"model {model.get('name')!r}"
        if model.get("placement_frame"):
            self._faults.append(f"{where}: placement_frame is not supported; give the pose of the model itself")
        if model.find("include") is not None:
            self._faults.append(f"{where}: it includes other files; `gz sdf -p model.sdf` writes them into one")
        is_static = is_static or (model.findtext("static") or "").strip() in ("true", "1")
        own, links = f"{scope}__model__", model.findall("link")
        canonical = model.get("canonical_link") or (links[0].get("name") if links else None)
        outer = scope[: scope[:-2].rfind("::") + 2] if "::" in scope[:-2] else ""
        self._place(where, model, own, parent, _full(scope, canonical) or WORLD, outer)
        if scope:
            self.poses.add(scope.removesuffix("::"), NamedPose(IDENTITY, own, own))
        for link in links:
            name = self._name(link, scope, where)
            self._place(f"link {name!r}", link, name, own, None, scope)
            self.masses[name] = sdf_inertial(
                f"link {name!r}", link.find("inertial"), self._mode, self._faults, self._notes
            )
            self._count("link", link)
            if is_static:
                self.static.add(name)
        for frame in model.findall("frame"):
            name, on = self._name(frame, scope, where), frame.get("attached_to")
            on = _full(scope, on) or own
            self._place(f"frame {name!r}", frame, name, on, on, scope)
            self.frames[name] = on
        for joint in model.findall("joint"):
            name, child = self._name(joint, scope, where), _full(scope, (joint.findtext("child") or "").strip())
            if child is None or joint.find("parent") is None:
                self._faults.append(f"joint {name!r}: it has no <parent> and <child>")
                continue
            self._place(f"joint {name!r}", joint, name, child, child, scope)
            self._later.append((joint, scope))
            self._count("joint", joint)
        for inner in model.findall("model"):
            self.read(inner, f"{scope}{inner.get('name')}::", own, is_static)
        self._count("model", model)

    def read_joints(self) -> None:
        """Read the joints of all models, whose places are known now."""
        self.poses.resolve()
        for element, scope in self._later:
            name = f"{scope}{element.get('name')}"
            where, kind = f"joint {name!r}", element.get("type", "")
            if kind not in KINDS:
                self._faults.append(f"{where}: type={kind!r} is none of {', '.join(KINDS)}")
                continue
            parent, child = (self._end(where, element, end, scope) for end in ("parent", "child"))
            tags = {"ball": (), "fixed": (), "universal": ("axis", "axis2"), "revolute2": ("axis", "axis2")}
            axes = tuple(self._axis(where, element, name, scope, tag) for tag in tags.get(kind, ("axis",)))
            self.joints[name] = SdfJoint(name, kind, parent, child, axes, self._pitch(where, kind, element))

    def _end(self, where, element, end, scope):
        return self.poses.link_of(_full(scope, (element.findtext(end) or "").strip()) or "", where)

    def _axis(self, where, element, name, scope, tag):
        found = element.find(tag)
        xyz = None if found is None else found.find("xyz")
        seen = "" if xyz is None else xyz.get("expressed_in", "")
        of_model = found is not None and (found.findtext("use_parent_model_frame") or "").strip() in ("true", "1")
        if self._version < (1, 5) or of_model:
            seen = "__model__"
        rotation = self.poses.between(name, _full(scope, seen))[0] if seen else np.eye(3)
        return sdf_axis(where, found, rotation, self._faults)

    def _pitch(self, where, kind, element):
        if kind != "screw":
            return 0.0
        if element.find("screw_thread_pitch") is None:
            self._faults.append(
                f"{where}: give its <screw_thread_pitch> [m] for a turn; thread_pitch has two meanings"
            )
        return text_number(where, element, "screw_thread_pitch", self._faults, 1.0) / (2 * np.pi)

    def _place(self, where, element, name, relative_to, on, scope):
        """Enter a pose.  Args: relative_to: full name where the pose says none; scope: of the name that it says."""
        pose = element.find("pose")
        given = None if pose is None else pose.get("relative_to")
        if pose is not None and pose.get("frame"):
            self._faults.append(
                f"{where}: frame={pose.get('frame')!r} of its pose is not supported; give relative_to="
            )
        if given and self._version < (1, 7):
            self._faults.append(f"{where}: its pose is relative_to={given!r}, which needs version 1.7 of the file")
        self.poses.add(name, NamedPose(pose_of(where, pose, self._faults), _full(scope, given) or relative_to, on))

    def _name(self, element, scope, where):
        name = element.get("name")
        if not name:
            self._faults.append(f"{where}: a {element.tag} has no name")
        return f"{scope}{name}"

    def _count(self, kind, element):
        for child in element:
            if child.tag in _LISTED:
                self.left[child.tag] += 1
            elif child.tag == "collision":
                self.left["collision shape"] += 1
            elif child.tag not in _KNOWN[kind] | _SILENT:
                self.left[f"<{child.tag}> of a {kind}"] += 1


def _full(scope, name):
    """Full name of a thing in a model, None where there is no name; "world" is everywhere."""
    return name if name == WORLD else f"{scope}{name}" if name else None
