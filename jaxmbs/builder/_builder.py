"""`SystemBuilder`: declare bodies, joints, forces and constraints by name, then build the system."""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ..blocks import AbstractBlock
from ..checks import no_such
from ..errors import ModelError
from ..forces._base import AbstractLaw
from ..joints._base import AbstractJoint
from ..joints._closures import AbstractClosure
from ..joints._rows import AbstractRows
from ..model._elastic import ElasticBody
from ..model._pose import Pose
from ..model._system import System
from ..runtime import as_array, follow_precision
from ..typing import ArrayLike, FrameLike, WordedError
from . import _declarations as declared
from ._build import build_system
from ._circuits import with_circuits
from ._elastic import ElasticDeclaration, elastic_faults
from ._links import link_parts
from ._machine_elements import MachineElements
from ._references import resolve_references
from ._rotors import rotor_faults, rotor_parts
from ._validation import cut_faults, guess_faults, model_faults


class SystemBuilder(MachineElements):
    """Collects a model by names and builds a `System`; SI units, radians, the fixed body is "ground".

    Every number may be traced: a function of design variables that builds a system is differentiable.  A traced
    system with loops takes its freedoms from a concrete build of the same topology, `build(like=system)`.
    """

    _computes = True  # its methods are public calls, see `explain_arguments`

    def __init__(self, gravity: ArrayLike = (0.0, 0.0, -9.81)) -> None:
        self._model = declared.Model(as_array(gravity))
        self._faults: list[str] = []

    @property
    def declared(self) -> declared.Model:
        """All declarations, by name; to be read, not changed."""
        return self._model

    def __repr__(self) -> str:
        kinds = ("bodies", "joints", "forces", "constraints", "elastic", "frames", "friction")
        kinds += ("hydraulics", "measures", "blocks")
        counts = [f"{len(getattr(self._model, kind))} {kind}" for kind in kinds if getattr(self._model, kind)]
        return f"SystemBuilder({', '.join(counts)})"

    def _add(self, what, table, item):
        names = {**self._model.bodies, **self._model.frames} if what in ("body", "frame") else table
        if what in ("joint", "constraint"):
            names = {**self._model.joints, **self._model.constraints}
        if item.name in names or (what in ("body", "frame") and item.name == declared.GROUND):
            self._faults.append(f"{what} {item.name!r}: the name is taken")
        else:
            table[item.name] = item

    def _placed(self, where, position, rotation):
        """World pose in the reference pose, None where none is given; an invalid one is recorded as a fault."""
        if position is None and rotation is None:
            return None
        try:
            pose = Pose((0.0, 0.0, 0.0) if position is None else position, rotation)
        except (TypeError, ValueError) as error:
            self._faults.append(f"{where}: {error}")
            return None
        self._faults += [f"{where}: {fault}" for fault in pose.faults()]
        return pose

    def body(
        self,
        name: str,
        mass: ArrayLike,
        com: ArrayLike = (0.0, 0.0, 0.0),
        inertia: ArrayLike = 0.0,
        position: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
        any_inertia: bool = False,
    ) -> None:
        """A rigid body.

        Args:
            mass: [kg].
            com: centre of mass in body axes [m].
            inertia: about the centre of mass in body axes [kg m^2]: 0, three principal values or (3, 3).
            position, rotation: world pose of its frame in the reference pose, for joints given by `at=`; by default
                the world frame: com and points are then given in world axes.
            any_inertia: take principal inertias that no real body has, A + B < C, as some files have them.
        """
        pose = self._placed(f"body {name!r}", position, rotation)
        self._add("body", self._model.bodies, declared.Body(name, mass, com, inertia, pose, any_inertia))

    def elastic(
        self,
        name: str,
        body: WordedError[ElasticBody],
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
        item = ElasticDeclaration(name, body, motions)
        bodies, joints = item.parts(self._placed(f"elastic body {name!r}", position, rotation))
        for part in bodies:
            self._add("body", self._model.bodies, part)
        for joint in joints:
            self._add("joint", self._model.joints, joint)
        self._model.elastic[name] = item

    def frame(
        self, name: str, on: str, position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None
    ) -> None:
        """A named frame fixed in the body or frame `on` at `position` [m], `rotation` (3, 3), in its axes."""
        pose = self._placed(f"frame {name!r}", position, rotation)
        self._add("frame", self._model.frames, declared.Frame(name, on, pose or Pose()))

    def link(
        self,
        name: str,
        /,
        mass: ArrayLike = 0.0,
        com: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        plane: str = "xy",
        points: Mapping[str, ArrayLike] | None = None,
        **more_points: ArrayLike,
    ) -> None:
        """A rigid body drawn by its points in the reference pose: `b.link("arm", A=(0, 0.2), D=(2, 1.2), mass=3.0)`.

        The points are world points [m]; each is a frame of the body, "arm.A" and "arm.D", for joints, forces and
        questions.  Links joined at points that are drawn at one place are assembled where all coordinates are zero,
        so that `State.at` needs no guess near the drawing.

        Args:
            mass: [kg].
            com: centre of mass, a world point [m] of the drawing (default: that of thin bars along the outline).
            inertia: about the centre of mass in world axes of the drawing [kg m^2], as of `body` (default: that of
                thin bars of this mass from point to point and back to the first; none for one point).
            plane: "xy", "xz" or "yz", in which points of two numbers lie; points may have three numbers.
            points: the same by a dict, for names that are no words of Python.
        """
        try:
            drawn = link_parts(name, mass, com, inertia, plane, {**(points or {}), **more_points})
        except (TypeError, ValueError) as error:
            self._faults.append(f"link {name!r}: {error}")
            return
        self._add("body", self._model.bodies, drawn[0])
        for frame in drawn[1]:
            self._add("frame", self._model.frames, frame)

    def joint(
        self,
        name: str,
        kind: WordedError[AbstractJoint],
        parent: WordedError[FrameLike],
        child: WordedError[FrameLike],
        parent_frame: str | Pose | ArrayLike | None = None,
        child_frame: str | Pose | ArrayLike | None = None,
        at: str | ArrayLike | None = None,
        drive: Callable | None = None,
        guess: ArrayLike | None = None,
    ) -> None:
        """A joint between two bodies, which may close a loop.

        Args:
            kind: a joint such as `Revolute(axis="z")`.
            parent, child: names of bodies, or of frames on them, which are then the joint's frames: "arm.tip"; or
                (body, point), (body, Pose).
            parent_frame, child_frame: its place in each body: a point, `Pose` or frame name (default: the origin).
            at: instead, a world point in the reference pose, or the frame whose point it is.  Bodies are there at
                their `position=` or, without one, have the world frame as their own; joint axes are world axes.
            drive: function of time that prescribes its coordinate.
            guess: its coordinate [rad or m] in the pose of use, about (several freedoms: an array, as in a State).
                Freedoms are counted there, and every search for a state begins there.
        """
        item = declared.Joint(name, kind, parent, child, parent_frame, child_frame, at, drive, guess=guess)
        self._add("joint", self._model.joints, item)

    def drive(self, joint: str, function: Callable) -> None:
        """Prescribe the coordinate of a one-freedom joint as a function of time (rheonomic)."""
        if joint not in self._model.joints:
            self._faults.append(f"drive: {no_such('joint', joint, self._model.joints)}")
        elif self._model.joints[joint].drive is not None:
            self._faults.append(f"drive: joint {joint!r} is driven already")
        else:
            self._model.joints[joint] = dataclasses.replace(self._model.joints[joint], drive=function)

    def rotor(self, joint: str, inertia: ArrayLike, ratio: ArrayLike = 1.0) -> None:
        """The inertia of a rotor in the parent of a joint, which turns `ratio` times as fast as the joint moves.

        A body and joint "joint.rotor" about the joint's axis, and a coupler "joint.gear": the joint feels
        `ratio^2 inertia`, the parent its gyroscopic moment, and the reaction of the gear is that of the coupler.
        Neglected are its mass and its inertia across the axis, which belong to the parent's own.  A `Motor` acts on
        the joint with its `ratio`, or on "joint.rotor" with ratio 1, the gear then carrying its torque.

        Args:
            joint: a `Revolute` or `Prismatic` joint declared before.
            inertia: about the axis of the rotor, > 0 [kg m^2].
            ratio: turns of the rotor for one of the joint, or rad per m of a sliding one; negative where it turns
                the other way.
        """
        found = rotor_faults(joint, inertia, ratio, self._model.joints)
        self._faults += found
        if found:
            return
        body, turning, gear = rotor_parts(self._model.joints[joint], inertia, ratio)
        self._add("body", self._model.bodies, body)
        self._add("joint", self._model.joints, turning)
        self._add("constraint", self._model.constraints, gear)

    def force(
        self,
        name: str,
        law: WordedError[AbstractLaw],
        between: tuple | list | None = None,
        joint: str | None = None,
        on: WordedError[FrameLike | None] = None,
    ) -> None:
        """A force element: a scalar law `between` two frames or on a `joint`, a `Bushing` `between` two frames, a
        load `on` a frame, or a `GeneralisedEffort`.  Frames: body or frame names, (body, point), (body, Pose)."""
        self._add("force", self._model.forces, declared.ForceElement(name, law, between, joint, on))

    def constraint(
        self,
        name: str,
        law: WordedError[AbstractClosure | AbstractRows],
        between: tuple | list | None = None,
    ) -> None:
        """Constraint rows beside joints: `Distance`, `PointOnPlane`, `PointOnLine`, or a `FramePath` in time between
        two frames, `Coupler` of joint coordinates, or `PositionRows` of the user."""
        self._add("constraint", self._model.constraints, declared.Constraint(name, law, between))

    def measure(
        self,
        name: str,
        function: WordedError[Callable | None] = None,
        *,
        joint: str | None = None,
        between: tuple | list | None = None,
        on: WordedError[FrameLike | None] = None,
        of: str | None = None,
        axis: str | None = None,
        force: str | None = None,
    ) -> None:
        """A signal that blocks and questions read by its name.

        Args:
            function: `f(instant)` to a number or (n,); it has the time `instant.t`, `instant.coordinates["pin"]`,
                `instant.velocities["pin"]`, `instant.internal["motor.current"]` and the methods position, rotation,
                velocity and angular_velocity of a frame, `instant.position("tip")`.
            joint: a joint; `of` its "position" (default) or "velocity", one number or (n,).
            on: a frame; `of` its "position", "velocity" or "angular velocity" (3,) in world axes.
            between: two frames; `of` the "distance", the "distance rate", or the "position", "velocity" or
                "angular velocity" (3,) of the second one, seen in the axes of the first.
            axis: "x", "y" or "z", of which a vector's entry is taken.
            force: a force element that no block drives; its effort, one number, positive where it pushes two points
                apart (a cable that pulls is negative), else (n,), those of a bushing in its axes.
        """
        of = of or ("position" if force is None else "effort")
        self._add_signal(declared.Measure(name, function, joint, between, on, of, axis, force), self._model.measures)

    def block(
        self,
        name: str,
        block: WordedError[AbstractBlock],
        reads: WordedError[str | tuple | list | Callable],
        drives: WordedError[str | tuple | list | None] = None,
        every: WordedError[ArrayLike | None] = None,
    ) -> None:
        """A block such as `PI(kp, ki)` between signals and what they drive; its output is a signal of its name.

        Args:
            reads: a signal, or several one after another: measures, outputs of other blocks, internal states such as
                "motor.current", functions of time.
            drives: "motor.voltage", or "motor" where it has one such field; several take an entry of the output each.
                The fields are the `inputs` of force laws and blocks, and hold 0.0 in the declaration.
            every: period [s] of a sampled block: at the start of a motion and after each period its states and its
                output get new values, by its discrete form, and keep them until the next.  The output is the internal
                state "loop.output" of a block "loop"; a state saved at a sample is that before it.
        """
        self._add_signal(declared.Block(name, block, reads, drives, every), self._model.blocks)

    def _add_signal(self, item, table):
        if item.name in self._model.measures or item.name in self._model.blocks:
            self._faults.append(f"{type(item).__name__.lower()} {item.name!r}: a measure or block has this name")
        else:
            table[item.name] = item

    def faults(self) -> list[str]:
        """Faults of the model so far, one sentence each."""
        return self._faults + model_faults(resolve_references(self._model))

    def build(
        self,
        like: System | None = None,
        independent: Iterable[str] | None = None,
        cut: Iterable[str] | None = None,
        guess: Mapping[str, Any] | None = None,
        linear_solver: str = "auto",
    ) -> System:
        """Build the system.

        Args:
            like: a concrete build of the same topology, whose freedoms and independent set are taken over; needed
                for traced models with constraints, and quick for concrete ones.
            independent: joint names whose velocities are the independent ones of the KIC (default: by pivoting).
            cut: joint names to cut (default: those that close a loop in the order declared).
            guess: joint name -> coordinate of a pose of use, beside and before the guesses of the joints themselves.
                Freedoms, the independent set and undetermined reactions are counted at the closed pose nearest to it,
                and searches of `State.at` begin there; by default at the reference pose, all coordinates zero.
            linear_solver: how mechanisms with loops are solved, with equal results: "dense", "frontal" (node by node,
                for rigid bodies in rows, rings, ladders) or "multifrontal" (any graph of bodies), the last two in
                work linear in the bodies; default the fastest for the model, which `describe` prints.

        Raises: ModelError with every fault of the model.
        """
        follow_precision()
        cut = tuple(cut or ())
        model, guess = resolve_references(self._model), dict(guess or {})
        found = self._faults + model_faults(model) + cut_faults(model, cut) + guess_faults(model, guess)
        if found:
            raise ModelError(found)
        return build_system(with_circuits(model), like, independent, set(cut), guess, linear_solver)
