"""Elements of machines that the builder declares: hydraulics, friction, contact, cables, gears."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

from .. import contact, forces  # by their rooms: an element is imported when it is declared
from ..typing import ArrayLike, FrameLike, WordedError
from . import _declarations as declared

if TYPE_CHECKING:
    from ..contact import AbstractPair, HuntCrossley
    from ..forces import AbstractScalarLaw, BeamSection
    from ..forces._old_friction import OldModel
    from ..friction import AbstractFriction
    from ..hydraulics import AbstractHydraulicElement, AbstractNode


class MachineElements:
    """Methods of the `SystemBuilder` that declare elements of machines."""

    _model: declared.Model
    _faults: list[str]
    _add: Callable[..., None]
    force: Callable[..., None]

    def hydraulic(
        self,
        name: str,
        element: "WordedError[AbstractHydraulicElement | AbstractNode]",
        ports: Mapping[str, str] | None = None,
        signal: str | Callable | ArrayLike | None = None,
        shaft: str | None = None,
    ) -> None:
        """An element or a node of a hydraulic circuit; see `jaxmbs.hydraulics`.

        Args:
            element: a node (`Volume`, `Accumulator`, `Tank`), or an element between nodes such as `Valve`, `Pump`.
            ports: node by port, `{"p": "supply", "t": "tank", "a": "boom.p0", "b": "boom.p1"}`: names of nodes, or
                chambers of a `HydraulicCylinder`, which then has no valve of its own.  None for a node.
            signal: place of a valve's spool, speed of a pump, opening of an orifice: name of a measure or block,
                function of time, or number.
            shaft: joint of one coordinate that turns a `Pump` in place of a signal and feels its torque, which is the
                force element "pump shaft" of a pump "pump".
        """
        ports = dict(ports) if isinstance(ports, Mapping) else ports
        self._add("hydraulic", self._model.hydraulics, declared.Hydraulic(name, element, ports, signal, shaft))

    def friction(
        self,
        name: str,
        joint: str,
        friction: "WordedError[AbstractFriction | ArrayLike | None]" = None,
        *,
        radius: ArrayLike | None = None,
        preload: ArrayLike = 0.0,
        length: ArrayLike | None = None,
        mu: ArrayLike | None = None,
        static_ratio: ArrayLike | None = None,
        transition_speed: ArrayLike | None = None,
        model: "WordedError[AbstractFriction | OldModel | None]" = None,
    ) -> None:
        """Friction of a joint, from the load N that the joint itself carries.

        `mu(s) (N + preload)` acts against the slip s [m/s] of its surface, along the slide or at the radius about the
        axis; mu(s) is the coefficient of the model.

        Args:
            joint: a Revolute, Prismatic, Cylindrical, Spherical, Universal, Planar or Screw, of the tree or closing a
                loop, driven or not.
            friction: a model of `jaxmbs.friction`, or one of your own; a number is the coefficient of its
                `SmoothCoulomb`.
            radius: of the pin, ball or thread, at which a rotation rubs [m]; of a Planar about its normal, which does
                not rub by default.
            preload: load that is there without any other [N].
            length: between the two ends of the bearing, centred at the joint's frame on the child [m]; moments across
                the axis then load both ends, and an axial force loads the collar of a pin.  Of a Planar, the side of
                its square pad.  By default moments and, on a pin, axial forces do not rub.
            mu, static_ratio, transition_speed, model: deprecated; give `friction`.

        `jaxmbs.dynamics.joint_friction` gives the loads and whether they are unique.
        """
        from ._old_friction import joint_model

        try:
            given = joint_model(friction, mu, static_ratio, transition_speed, model)
        except (TypeError, ValueError) as error:
            self._faults.append(f"friction {name!r}: {error}")
            return
        self._add("friction", self._model.friction, declared.Friction(name, joint, given, radius, preload, length))

    def contact(
        self,
        name: str,
        pair: "WordedError[AbstractPair]",
        body: WordedError[FrameLike],
        surface: WordedError[FrameLike],
        force: "WordedError[HuntCrossley]",
        friction: "WordedError[AbstractFriction | ArrayLike | None]" = None,
        max_depth: ArrayLike | None = None,
        wear: ArrayLike = 0.0,
    ) -> None:
        """A contact, which is a force element: `b.contact("tappet", RollerOnCurve(...), "follower", "cam", force)`.

        Args:
            pair: the surfaces, such as `SphereOnPlane(radius)`.
            body, surface: frames of the round part and of the plane, tube, curve or road.  Frames: body or frame
                names, (body, point), (body, Pose).
            force, max_depth, wear: as of `contact.Contact`.
            friction: a model of `jaxmbs.friction`, of which `LuGre` sticks, or one of your own; a number is the
                coefficient of its `SmoothCoulomb`; None for smooth surfaces.
        """
        try:
            law = contact.Contact(pair, force, friction, max_depth, wear)
        except (TypeError, ValueError) as error:
            self._faults.append(f"contact {name!r}: {error}")
            return
        self.force(name, law, between=(surface, body))

    def cable(
        self,
        name: str,
        path: WordedError[Iterable],
        stiffness: ArrayLike | None = None,
        axial_stiffness: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        free_length: ArrayLike | Callable = 1.0,
        pretension: ArrayLike | None = None,
        slack: bool | None = None,
        friction: "WordedError[AbstractFriction | ArrayLike | None]" = None,
        closed: bool = False,
        slip_speed: ArrayLike | None = None,
        transition: ArrayLike = 1e-4,
        inextensible: bool = False,
        law: "WordedError[AbstractScalarLaw | None]" = None,
    ) -> None:
        """A cable over points, sheaves, cylinders and spheres, or a belt around them.

        `b.cable("hoist", [Attachment("boom.tip"), Sheave("hook", 0.3, side="+"), Attachment("boom.end")],
        stiffness=2e6, free_length=21.0)`.  It is a force element of the law `forces.Cable`, which says more, or a
        constraint of `forces.InextensibleCable`.

        Args:
            path: elements in order: `Attachment` at the ends or `Winch` at the first, `Eyelet`, `Sheave`,
                `WrapCylinder`, `WrapSphere` between them; of a closed belt all but the first.
            stiffness: tension per stretch [N/m]; or axial_stiffness: modulus times cross section [N].
            damping: tension per rate of stretch [N s/m], by default none.
            free_length: length without tension [m], or a function of time for a winch at the first element.
            pretension: tension at the free length [N], by default none.
            slack: True, the default, if the cable takes no compression.
            friction: at all elements that give none of their own (default: none): a model of `jaxmbs.friction`
                without bristles, or the coefficient of its `SmoothCoulomb`.
            closed: True for a belt.
            slip_speed: deprecated; the `transition_speed` of `friction.SmoothCoulomb`, which friction takes.
            transition: half of the stretch over which the cable becomes slack [m].
            inextensible: True for a cable of constant length, whose tension is the multiplier of a constraint.  It
                takes no stiffness, damping, pretension or friction, and it cannot become slack: its tension has a
                sign.
            law: instead of all numbers, a scalar law over the length of the path, which may push: a `SpringDamper`,
                `Actuator`, `BumpStop`, ...
        """
        elastic = {
            "stiffness": stiffness,
            "axial_stiffness": axial_stiffness,
            "damping": damping,
            "pretension": pretension,
            "friction": friction,
            "slack": slack or None,
        }
        if slip_speed is not None:
            from ..forces._old_friction import warn_of_old_name

            warn_of_old_name("slip_speed of a cable", "friction=SmoothCoulomb(dynamic, transition_speed=)")
        if inextensible:
            if self._has_no_numbers(name, elastic, "an inextensible cable", "inextensible=True"):
                self._path_row(name, path, bool(closed), free_length)
            return
        if law is not None:
            if self._has_no_numbers(name, elastic, "a cable with law=", "law="):
                self._path_force(name, path, bool(closed), law)
            return
        values = elastic | {
            "damping": 0.0 if damping is None else damping,
            "pretension": 0.0 if pretension is None else pretension,
            "free_length": free_length,
            "slack": True if slack is None else bool(slack),
            "transition": transition,
        }
        from ._cables import cable_parts

        try:
            law, frames, drum = cable_parts(path, bool(closed), values.pop("friction"), slip_speed, values)
        except (TypeError, ValueError) as error:
            self._faults.append(f"cable {name!r}: {error}")
            return
        self.force(name, law, between=frames, joint=drum)

    def _has_no_numbers(self, name, elastic, what, how):
        """False with a fault where a cable has numbers that only one with a stiffness has."""
        given = [key for key, value in elastic.items() if value is not None]
        if given:
            self._faults.append(
                f"cable {name!r}: {what} takes no {', '.join(given)}; leave them out, or give a "
                f"stiffness without {how}"
            )
        return not given

    def _path_row(self, name, path, closed, free_length):
        from ._cables import inextensible_cable_parts

        try:
            law, frames = inextensible_cable_parts(path, closed, free_length)
        except (TypeError, ValueError) as error:
            self._faults.append(f"cable {name!r}: {error}")
            return
        self._add("constraint", self._model.constraints, declared.Constraint(name, law, frames))

    def _path_force(self, name, path, closed, law):
        from ._cables import path_force_parts

        try:
            law, frames = path_force_parts(path, closed, law)
        except (TypeError, ValueError) as error:
            self._faults.append(f"cable {name!r}: {error}")
            return
        self.force(name, law, between=frames)

    def beam(
        self,
        name: str,
        section: "WordedError[BeamSection | list]",
        points: ArrayLike,
        elements: WordedError[int | None] = None,
        reference: ArrayLike = (0.0, 1.0, 0.0),
    ) -> None:
        """A geometrically exact beam for large bending, twist and stretch: a chain of bodies and elastic elements.

        `b.beam("blade", BeamSection.of_material(...), [(0, 0, 0), (8, 0, 0)], elements=16)` makes the bodies
        "blade.0" to "blade.16" at the nodes, to which joints, forces and contacts attach as to others, free joints
        "blade.1" to "blade.16", each from the node before, without motion where there is no load, and force elements
        of these names, of the law `forces.BeamElement`.  Join a node to the rest by a joint: `b.joint("clamp",
        Weld(), "hub", "blade.0", at=(0, 0, 0))`.

        Mass and inertia are lumped at the nodes; the largest lag of a beam spun up is right to 2e-4 with 8
        elements.
        Axial waves make it stiff: simulate with `ode.Rodas5P()` or at fixed steps.

        Args:
            section: a `BeamSection`, or a list of one for each element.
            points: the two ends of a straight beam, or all nodes (n + 1, 3) of one that is curved without load, in
                world axes in the reference pose [m]; arcs of circles are exact.
            elements: number of elements of a straight beam (default 8).
            reference: (3,) vector in the plane of the section's x and y axes, world axes, or (n + 1, 3), one at each
                node of a beam that is twisted without load.

        Source: Sonneville, Cardona and Bruls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451-474.
        """
        from ._beams import beam_parts

        try:
            bodies, joints, elastic = beam_parts(name, section, points, elements, reference)
        except (TypeError, ValueError) as error:
            self._faults.append(f"beam {name!r}: {error}")
            return
        for body in bodies:
            self._add("body", self._model.bodies, body)
        for joint in joints:
            self._add("joint", self._model.joints, joint)
        for force in elastic:
            self._add("force", self._model.forces, force)

    def gear_pair(
        self,
        name: str,
        first: WordedError[FrameLike],
        second: WordedError[FrameLike],
        teeth: tuple[int, int],
        module: ArrayLike,
        pressure_angle: ArrayLike = math.pi / 9,
        helix_angle: ArrayLike = 0.0,
        internal: bool = False,
        stiffness: ArrayLike = 1e8,
        damping: ArrayLike = 0.0,
        backlash: ArrayLike = 0.0,
        phase: ArrayLike = 0.0,
        transition: ArrayLike = 1e-6,
    ) -> None:
        """Two gears in mesh, whose teeth press along the line of action: `Coupler` is the ideal ratio without loads.

        `b.gear_pair("stage", "wheel", "pinion", teeth=(60, 20), module=2e-3)`: a force element of the law
        `forces.GearPair`, which says more.

        Args:
            first, second: frames of the wheels A and B at their centres, z along their axes: body or frame names,
                (body, point), (body, Pose).
            teeth: numbers of teeth of A and B; their ratio is that of the gear.
            module: normal module [m]; the pitch radii are teeth times module over 2 cos(helix angle).
            pressure_angle, helix_angle: normal pressure angle, and helix angle of A, positive if right-handed [rad].
            internal: True if B is a ring gear around A.
            stiffness, damping: of the teeth along their normal [N/m, N s/m].
            backlash: play along the normal of the teeth [m].
            phase: of the mesh [rad]: with 0 the teeth are in the middle of their play where the x axes of both frames
                point from A to B.
            transition: half of the approach over which the teeth come into touch [m].
        """
        try:
            law = forces.GearPair(
                tuple(teeth),  # type: ignore[arg-type]
                module,
                pressure_angle,
                helix_angle,
                internal,
                stiffness,
                damping,
                backlash,
                phase,
                transition,
            )
        except (TypeError, ValueError) as error:
            self._faults.append(f"gear pair {name!r}: {error}")
            return
        self.force(name, law, between=(first, second))
