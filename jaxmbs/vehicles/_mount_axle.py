"""Axles of two wheels: a solid axle on links, a twist beam; the anti-roll bar."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..builder import SystemBuilder
from ..errors import ModelError
from ..forces import AbstractLaw, BeamElement, BeamSection, SpringDamper
from ..forces._fields import number
from ..joints import Free, PointOnLine, Revolute, Spherical
from ..model import Pose
from ..typing import ArrayLike, ScalarLike, WordedError
from ._parts import SIDES, Adder, MountedParts, check_parts, side_of

_BEAM_ENDS = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # x of a section along y of the car
_BEARING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # z along y of the car


def mount_solid_axle(
    b: WordedError[SystemBuilder],
    hardpoints: Mapping[str, ArrayLike],
    links: Mapping[str, tuple[str, str]],
    name: str,
    chassis: str,
    mass: ScalarLike,
    inertia: ArrayLike,
    spring: WordedError[AbstractLaw | None] = None,
    at: ArrayLike = (0.0, 0.0, 0.0),
) -> MountedParts:
    """Add a solid axle on links to a builder: body "NAME axle" on rods with ball ends, and two springs.

    Four links leave it two freedoms, to bounce and to roll: two lower and two oblique upper ones, or three along and
    a Panhard rod across.

    Args:
        b: the builder, which has the chassis; both have the axes of the design position.
        hardpoints: points (3,) by name, x forwards, y left, z up [m]: ends of the links, AO the left wheel's centre,
            and S and D, top and foot of the left spring.  The right ones of AO, S, D are their mirror images.
        links: by name, the names of their points on the chassis and on the axle.
        name: of the axle, before the names of its parts.
        chassis: body that carries it.
        mass, inertia: of the axle, about the middle of its wheels [kg, kg m^2].
        spring: law over the length from S to D; None for none.
        at: origin of the hardpoints (3,) [m].

    Raises: ModelError for points that are missing.
    """
    if not isinstance(links, Mapping) or any(isinstance(x, str) or len(x) != 2 for x in links.values()):
        raise ModelError(["links must be {name: (point on the chassis, point on the axle)}"], "the axle")
    needed = ["AO", *(point for ends in links.values() for point in ends)]
    _check_axle(hardpoints, needed, mass, {"at": at, "inertia": inertia}, spring, {"name": name, "chassis": chassis})
    add, place = Adder(b, name), side_of("left", at)
    H = {point: place.point(x) for point, x in hardpoints.items()}
    middle = place.point(number(hardpoints["AO"]) * jnp.asarray(np.array([1.0, 0.0, 1.0])))
    axle = add.body("axle", mass, com=middle, inertia=inertia)
    add.joint("float", Free(), "ground", axle)
    for link, (inner, outer) in links.items():
        add.rod(link, inner, (chassis, H[inner]), (axle, H[outer]))
    if spring is not None:
        _add_springs(add, hardpoints, at, chassis, {side: axle for side in SIDES}, spring)
    return add.parts()


def mount_twist_beam(
    b: WordedError[SystemBuilder],
    hardpoints: Mapping[str, ArrayLike],
    section: WordedError[BeamSection],
    name: str,
    chassis: str,
    mass: ScalarLike,
    inertia: ArrayLike,
    spring: WordedError[AbstractLaw | None] = None,
    at: ArrayLike = (0.0, 0.0, 0.0),
) -> MountedParts:
    """Add a twist beam to a builder: "NAME left arm" and "NAME right arm" in balls, joined by an elastic beam.

    Args:
        b: the builder, which has the chassis; both have the axes of the design position.
        hardpoints: of the left side (3,) [m]: P the bushing on the chassis, B the end of the beam on the arm, AO the
            wheel's centre, S and D top and foot of the spring.
        section: of the beam across, whose axes y and z are -x and z of the car; without its mass.
        name: of the axle, before the names of its parts.
        chassis: body that carries it.
        mass, inertia: of each arm with its half of the beam, about the wheel's centre [kg, kg m^2].
        spring: law over the length from S to D; None for none.
        at: origin of the hardpoints (3,) [m].

    Raises: ModelError for points that are missing.
    """
    if not isinstance(section, BeamSection):
        raise ModelError([f"section must be a BeamSection, not {type(section).__name__}"], "the axle")
    needed, vectors = ["P", "B", "AO"], {"at": at, "inertia": inertia}
    _check_axle(hardpoints, needed, mass, vectors, spring, {"name": name, "chassis": chassis})
    add, arms, ends = Adder(b, name), {}, {}
    for side in SIDES:
        H = {point: side_of(side, at).point(x) for point, x in hardpoints.items()}
        arms[side] = add.body(f"{side} arm", mass, com=H["AO"], inertia=inertia)
        add.joint(f"{side} P", Spherical(), chassis, arms[side], at=H["P"], point=f"{side} P")
        ends[side] = H["B"]
    length = ends["left"][1] - ends["right"][1]
    straight = jnp.zeros(6).at[0].set(length)
    law = BeamElement(section.element_stiffness(length), straight)
    add.force("beam", law, between=tuple((arms[s], Pose(ends[s], _BEAM_ENDS.T)) for s in ("right", "left")))
    if spring is not None:
        _add_springs(add, hardpoints, at, chassis, arms, spring)
    return add.parts()


def mount_anti_roll_bar(
    b: WordedError[SystemBuilder],
    hardpoints: Mapping[str, ArrayLike],
    stiffness: ScalarLike,
    name: str,
    chassis: str,
    left: str,
    right: str,
    at: ArrayLike = (0.0, 0.0, 0.0),
    mass: ScalarLike = 2.0,
) -> MountedParts:
    """Add an anti-roll bar to a builder: two halves that turn about y in two bearings and are twisted against each
    other, with a drop link on each side.

    Args:
        b: the builder, which has chassis, left and right.
        hardpoints: of the left side (3,) [m]: M on the line of the bar, E the end of its lever, L the end of the
            drop link on the suspension.
        stiffness: of the bar in torsion [N m/rad].
        name: of the bar, before the names of its parts.
        chassis: body that carries it.
        left, right: bodies to which the drop links go.
        at: origin of the hardpoints (3,) [m].
        mass: of each half [kg].

    Raises: ModelError for points that are missing.
    """
    _refuse_missing(hardpoints, ["M", "E", "L"])
    names = {"name": name, "chassis": chassis, "left": left, "right": right}
    check_parts({"stiffness": stiffness, "mass": mass}, {"at": at}, None, names, hardpoints)
    add, axis = Adder(b, name), jnp.asarray(_BEARING)
    for side, body in (("left", left), ("right", right)):
        H = {point: side_of(side, at).point(x) for point, x in hardpoints.items()}
        half = add.body(f"{side} half", mass, com=H["E"], inertia=0.02 * number(mass))
        add.rod(f"{side} drop link", None, (half, H["E"]), (body, H["L"]))
        if side == "left":
            add.joint("left M", Spherical(), chassis, half, at=H["M"], point="left M")
        else:
            add.joint("twist", Revolute("y"), add.bodies["left half"], half, at=H["M"])
            add.slide("right M", PointOnLine(), (chassis, Pose(H["M"], axis)), (half, H["M"]))
    add.force("bar", SpringDamper(stiffness=stiffness), joint=add.joints["twist"])
    return add.parts()


def _add_springs(add: Adder, hardpoints: Any, at: Any, chassis: str, bodies: Mapping[str, str], law: Any) -> None:
    """A spring on each side."""
    for side, body in bodies.items():
        top, foot = (side_of(side, at).point(hardpoints[point]) for point in ("S", "D"))
        add.force(f"{side} spring", law, f"{side} S", between=((chassis, top), (body, foot)))


def _check_axle(hardpoints, needed, mass, vectors, spring, names):
    """Raise a ModelError for what is no axle: hardpoints that are missing, those of springs too, and odd parts."""
    _refuse_missing(hardpoints, [*needed, *(["S", "D"] if spring else [])])
    check_parts({"mass": mass}, vectors, {"spring": spring}, names, hardpoints)


def _refuse_missing(hardpoints, needed):
    if not isinstance(hardpoints, Mapping):
        raise ModelError(["hardpoints must be {name: (x, y, z)}"], "the axle")
    faults = [f"hardpoint {point!r} is missing" for point in dict.fromkeys(needed) if point not in hardpoints]
    if faults:
        raise ModelError(faults, "the axle")
