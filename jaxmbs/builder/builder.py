"""`SystemBuilder`: declare bodies, joints, forces and constraints by name, then build the system."""

import dataclasses
import functools
import warnings
from collections.abc import Callable, Iterable, Mapping

import jax.numpy as jnp

from ..checks import known, no_such
from ..errors import ModelError
from ..forces.base import AbstractLaw
from ..joints import Coupler, Weld
from ..joints.base import AbstractJoint
from ..joints.closures import AbstractClosure, Rows, VelocityRows
from ..math.host import as_array
from ..math.precision import follow_precision
from ..model.elastic import ElasticBody
from ..model.frame import Pose
from ..model.system import System
from ..typing import ArrayLike, Explained, FrameLike
from . import declarations as declared
from .arrays import reference_poses
from .assemble_system import assemble_system
from .elastic import Elastic, elastic_faults, entry_faults
from .mobility import analyse, check_numbers, with_analysis
from .spanning import spanning_tree
from .validation import body_faults, constraint_faults, force_faults, joint_faults, system_law_faults


class SystemBuilder:
    """Collects a model by names and builds a `System`; SI units, radians, the fixed body is "ground".

    Every number may be traced: a function of design variables that builds a system is differentiable.  A traced
    system with loops takes its freedoms from a concrete build of the same topology, `build(like=system)`.
    """

    def __init__(self, gravity: ArrayLike = (0.0, 0.0, -9.81)) -> None:
        self.gravity = as_array(gravity)
        self._bodies: dict[str, declared.Body] = {}
        self._frames: dict[str, declared.Frame] = {}
        self._joints: dict[str, declared.Joint] = {}
        self._forces: dict[str, declared.Force] = {}
        self._constraints: dict[str, declared.Constraint] = {}
        self._elastic: dict[str, Elastic] = {}
        self._faults: list[str] = []

    def _add(self, what, table, item):
        names = {**self._bodies, **self._frames} if what in ("body", "frame") else table
        if what in ("joint", "constraint"):
            names = {**self._joints, **self._constraints}
        if item.name in names or (what in ("body", "frame") and item.name == declared.GROUND):
            self._faults.append(f"{what} {item.name!r}: the name is taken")
        else:
            table[item.name] = item

    def body(
        self,
        name: str,
        mass: ArrayLike,
        com: ArrayLike = (0.0, 0.0, 0.0),
        inertia: ArrayLike = 0.0,
        position: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
    ) -> None:
        """A rigid body.

        Args:
            mass: [kg].
            com: centre of mass in body axes [m].
            inertia: about the centre of mass in body axes [kg m^2]: 0, three principal values or (3, 3).
            position, rotation: world pose of its frame in the reference pose, for joints given by `at=`; by default
                the world frame: com and points are then given in world axes.
        """
        self._add("body", self._bodies, declared.Body(name, mass, com, inertia, _placed(position, rotation)))

    def elastic(
        self,
        name: str,
        body: Explained[ElasticBody],
        motions: Mapping[str, AbstractJoint] | None = None,
        position: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
    ) -> None:
        """An elastic body; its interfaces are bodies "name.interface" to which joints attach.

        Args:
            body: an `ElasticBody`, see `jaxmbs.flexible.floating_frame`.  Name the interface that the ground reaches
                first as its first: it carries the floating frame.
            motions: joints by other interface that restrict its motion on the first one: `{"tip": Planar("z")}`
                holds it in the plane (default `Free()`; directions left out are held rigidly).
            position, rotation: world pose of the first interface in the reference pose, for joints given by `at=`.

        The state holds the motion of each other interface under "name.interface" and the modes under "name.modes".
        """
        motions = dict(motions or {})
        found = elastic_faults(name, body, motions)
        self._faults += found
        if found:
            return
        item = Elastic(name, body, motions)
        bodies, joints = item.parts(_placed(position, rotation))
        for part in bodies:
            self._add("body", self._bodies, part)
        for joint in joints:
            self._add("joint", self._joints, joint)
        self._elastic[name] = item

    def frame(
        self, name: str, on: str, position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None
    ) -> None:
        """A named frame fixed in the body `on` at `position` [m], `rotation` (3, 3), in body axes."""
        self._add("frame", self._frames, declared.Frame(name, on, Pose(position, rotation)))

    def joint(
        self,
        name: str,
        kind: Explained[AbstractJoint],
        parent: str,
        child: str,
        parent_frame: str | Pose | ArrayLike | None = None,
        child_frame: str | Pose | ArrayLike | None = None,
        at: ArrayLike | None = None,
        drive: Callable | None = None,
    ) -> None:
        """A joint between two bodies, which may close a loop.

        Args:
            kind: a joint such as `Revolute(axis="z")`.
            parent_frame, child_frame: its place in each body: a point, `Pose` or frame name (default: the origin).
            at: instead, a world point in the reference pose, where bodies stand at their `position=` or, without
                one, in the world frame; joint axes are then world axes.
            drive: function of time that prescribes its coordinate.
        """
        self._add(
            "joint", self._joints, declared.Joint(name, kind, parent, child, parent_frame, child_frame, at, drive)
        )

    def drive(self, joint: str, function: Callable) -> None:
        """Prescribe the coordinate of a one-freedom joint as a function of time (rheonomic)."""
        if joint not in self._joints:
            self._faults.append(f"drive: {no_such('joint', joint, self._joints)}")
        elif self._joints[joint].drive is not None:
            self._faults.append(f"drive: joint {joint!r} is driven already")
        else:
            self._joints[joint] = dataclasses.replace(self._joints[joint], drive=function)

    def force(
        self,
        name: str,
        law: Explained[AbstractLaw],
        between: tuple | list | None = None,
        joint: str | None = None,
        on: Explained[FrameLike | None] = None,
    ) -> None:
        """A force element: a scalar law `between` two frames or on a `joint`, a `Bushing` `between` two frames, a
        load `on` a frame, or a `GeneralisedEffort`.  Frames: body or frame names, (body, point), (body, Pose)."""
        if name == "drives":
            self._faults.append("force 'drives': the account of work keeps that name for driven joints")
        self._add("force", self._forces, declared.Force(name, law, between, joint, on))

    def constraint(
        self,
        name: str,
        law: Explained[AbstractClosure | Coupler | VelocityRows | Rows],
        between: tuple | list | None = None,
    ) -> None:
        """Constraint rows beside joints: `Distance`, `PointOnPlane`, `PointOnLine` between two frames, `Coupler`
        of joint coordinates, or `Rows` of the user."""
        self._add("constraint", self._constraints, declared.Constraint(name, law, between))

    def faults(self) -> list[str]:
        """Every fault of the model so far, one sentence each."""
        found = list(self._faults)
        if not self._bodies:
            found.append("the model has no bodies")
        if known(self.gravity) and self.gravity.shape != (3,):
            found.append(f"gravity must be three numbers, got shape {self.gravity.shape}")
        for body in self._bodies.values():
            found += body_faults(body)
        for frame in self._frames.values():
            if frame.body != declared.GROUND and frame.body not in self._bodies:
                found.append(f"frame {frame.name!r}: {no_such('body', frame.body, self._bodies)}")
        for joint in self._joints.values():
            found += joint_faults(joint, self._bodies, self._frames)
        for force in self._forces.values():
            found += force_faults(force, self._bodies, self._frames, self._joints)
        for item in self._constraints.values():
            found += constraint_faults(item, self._bodies, self._frames, self._joints)
        return found

    def build(
        self, like: System | None = None, independent: Iterable[str] | None = None, cut: Iterable[str] | None = None
    ) -> System:
        """The system.

        Args:
            like: a concrete build of the same topology, whose freedoms and independent set are taken over; needed
                for traced models with constraints, and quick for concrete ones.
            independent: joint names whose velocities are the independent ones of the KIC (default: by pivoting).
            cut: joint names to cut (default: those that close a loop in the order declared).

        Raises: ModelError with every fault of the model.
        """
        follow_precision()
        found = self.faults()
        found += [f"cut: {no_such('joint', name, self._joints)}" for name in cut or () if name not in self._joints]
        found += entry_faults(self._elastic, [j for name, j in self._joints.items() if name not in (cut or ())])
        if found:
            raise ModelError(found)
        bodies, joints, keep = dict(self._bodies), dict(self._joints), self._kept()
        tree = spanning_tree(bodies, joints, keep, set(cut or ()))
        split = [name for name in tree[-1] if name in keep]
        if split:
            _split_bodies(split, bodies, joints, self._frames)
            tree = spanning_tree(bodies, joints, keep, {f"{n}.weld" for n in split} | (set(cut or ()) - keep))
        loose = [name for name in tree[-1] if joints[name].kind.num_rows == 0]
        if loose:
            raise ModelError(
                [f"joint {n!r} (Free) leaves all motions free, so it cannot close a loop" for n in loose]
            )
        system = assemble_system(
            self.gravity, bodies, self._frames, joints, self._forces, self._constraints, self._elastic, tree
        )
        found = system_law_faults(self._forces.values(), system.topology)
        if found:
            raise ModelError(found)
        if like is not None:
            return _take_over(system, like)
        traced = not known(system)
        if traced and system.has_constraints:
            raise ModelError(["a traced model with constraints needs build(like=system) with a concrete build of it"])
        _warn_single_precision()
        return system if traced else with_analysis(system, *analyse(system, independent))

    def _kept(self):
        """Joints that must keep their coordinate: they carry a law, a drive or a coupler, or an elastic body."""
        names = {n for e in self._elastic.values() for n in e.joints}
        names |= {f.joint for f in self._forces.values() if f.joint is not None}
        names |= {j.name for j in self._joints.values() if j.drive is not None}
        for item in self._constraints.values():
            if isinstance(item.law, Coupler):
                names |= set(item.law.joints)
        return names


def _placed(position, rotation):
    """The pose of a body in the reference pose, None where none is given."""
    if position is None and rotation is None:
        return None
    return Pose((0, 0, 0) if position is None else position, rotation)


@functools.cache
def _warn_single_precision():
    if jnp.result_type(float).itemsize == 4:
        warnings.warn(
            "building in single precision: loops close to 1e-4 and stiff systems lose all digits; "
            "call jax.config.update('jax_enable_x64', True) first",
            stacklevel=3,
        )


def _split_bodies(names, bodies, joints, frames):
    """Cut loops whose every joint is needed inside a body: a massless twin of the child, welded to it."""
    world = reference_poses(bodies, joints, frames) if any(j.at is not None for j in joints.values()) else {}
    for name in names:
        joint = joints[name]
        twin = f"{joint.child}.{name}"
        place = world.get(joint.child)
        pose = None if place is None else Pose(place[1], place[0])
        bodies[twin] = declared.Body(twin, 0.0, (0.0, 0.0, 0.0), 0.0, pose)
        frame = joint.child_frame
        joints[name] = dataclasses.replace(joint, child=twin)
        joints[f"{name}.weld"] = declared.Joint(
            f"{name}.weld", Weld(), joint.child, twin, None, None, None, is_hidden=True
        )
        if isinstance(frame, str):
            raise ModelError([f"joint {name!r}: give child_frame as a point or Pose, its body must be split"])


def _take_over(system, like):
    """The system with the mobility of `like`; what concrete numbers can show, closed loops and inertia, is asked."""
    wanted = dataclasses.replace(like.topology, analysis=None)
    if dataclasses.replace(system.topology, analysis=None) != wanted:
        raise ModelError(["build(like=system): the topology differs from that of `like` (names, joints or order)"])
    if like.topology.analysis is None:
        return system
    if known(system):
        check_numbers(system)
    return with_analysis(system, like.topology.analysis, like.length)
