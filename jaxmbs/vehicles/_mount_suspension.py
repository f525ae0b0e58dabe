"""Suspension and wheel of a corner on a chassis: bodies, joints, rods and a spring by name."""

import jax.numpy as jnp

from ..builder import SystemBuilder
from ..errors import ModelError
from ..forces import AbstractLaw
from ..forces._fields import number
from ..joints import Free, Prismatic, Revolute, Spherical
from ..model import Pose
from ..typing import ArrayLike, ScalarLike, WordedError
from ._parts import Adder, MountedParts, check_parts, side_of
from ._suspension import Suspension, axes_along

_ARM_INERTIA = 0.02  # of an arm or tube over its mass, which hardly matters [m^2]


def mount_suspension(
    b: WordedError[SystemBuilder],
    suspension: WordedError[Suspension],
    name: str,
    chassis: str,
    side: str = "left",
    at: ArrayLike = (0.0, 0.0, 0.0),
    mass: ScalarLike = 30.0,
    inertia: ArrayLike = (0.5, 0.5, 0.5),
    arm_mass: ScalarLike = 3.0,
    spring: WordedError[AbstractLaw | None] = None,
    rack: str | None = None,
) -> MountedParts:
    """Add the suspension of one wheel to a builder: "NAME upright", arms, joints, rods, a spring.

    Args:
        b: the builder, which has the chassis; both have the axes of the design position (x forwards, y left, z up).
        name: of the corner, "front left", before the names of its parts.
        chassis: body that carries it.
        side: "left" or "right", to which y of the hardpoints points.
        at: origin of the hardpoints (3,) [m].
        mass, inertia: of the upright, about the wheel centre [kg, kg m^2].
        arm_mass: of each arm, and of the tube of a guiding strut [kg].
        spring: law over the length of the strut, such as `SpringDamper` or `AirSpring`; None for none.
        rack: body that carries the inner ends of tie rods, see `mount_steering`; by default the chassis.

    Raises: ModelError for what is no suspension, ValueError for an unknown side.
    """
    if not isinstance(suspension, Suspension):
        raise ModelError([f"mount_suspension takes a Suspension, got {type(suspension).__name__}"], "the suspension")
    numbers, vectors = {"mass": mass, "arm_mass": arm_mass}, {"at": at, "inertia": inertia}
    check_parts(numbers, vectors, {"spring": spring}, {"name": name, "chassis": chassis, "side": side})
    add, place, own = Adder(b, name), side_of(side, at), suspension
    H = {point: place.point(x) for point, x in own.hardpoints.items()}
    upright = add.body("upright", mass, com=H[own.axle[1]], inertia=inertia)
    if own.hinge is not None:
        first, second = (H[point] for point in own.hinge)
        frame = Pose(first, axes_along((second - first) / jnp.linalg.norm(second - first)))
        add.joint("hinge", Revolute("x"), chassis, upright, point=own.hinge[0], parent_frame=frame, child_frame=frame)
    elif not own.strut.guides:
        add.joint("float", Free(), "ground", upright)
    for arm in own.arms:
        body = add.body(arm.name, arm_mass, com=H[arm.ball], inertia=_ARM_INERTIA * number(arm_mass))
        for k, point in enumerate(arm.inner):
            add.joint(point, Spherical(), chassis, body, at=H[point], point=point, is_cut=k > 0)
        add.joint(arm.ball, Spherical(), body, upright, at=H[arm.ball], is_cut=True)
    for rod in own.rods:
        carrier = rack if rack is not None and rod.inner in own.rack else chassis
        add.rod(rod.name, rod.inner, (carrier, H[rod.inner]), (add.bodies[rod.body], H[rod.outer]))
    _add_strut(add, own, H, chassis, arm_mass, spring)
    return add.parts()


def _add_strut(add, own, H, chassis, mass, spring):
    top, foot = own.strut.top, own.strut.foot
    body = add.bodies[own.strut.body]
    if own.strut.guides:
        slide = Pose(H[foot], axes_along((H[foot] - H[top]) / jnp.linalg.norm(H[foot] - H[top])))
        tube = add.body("tube", mass, com=H[top], inertia=_ARM_INERTIA * number(mass))
        add.joint("strut_top", Spherical(), chassis, tube, at=H[top], point=top)
        add.joint("strut", Prismatic("x"), tube, body, parent_frame=slide, child_frame=slide)
    if spring is not None:
        add.force("spring", spring, top, between=((chassis, H[top]), (body, H[foot])))


def mount_wheel(
    b: WordedError[SystemBuilder],
    name: str,
    upright: str,
    centre: ArrayLike,
    mass: ScalarLike,
    inertia: ArrayLike,
    tyre: WordedError[AbstractLaw | None] = None,
    axle: ArrayLike = (0.0, 1.0, 0.0),
    road: str = "ground",
    brake: WordedError[AbstractLaw | None] = None,
) -> MountedParts:
    """Add a wheel to a builder: body "NAME wheel", joint "NAME spin" about its axle, its tyre and its brake.

    Args:
        b: the builder, which has the upright.
        name: of the corner.
        upright: body that carries the wheel, with the axes of the design position.
        centre: of the wheel (3,) [m].
        mass, inertia: of the wheel; the second of (3,) about the axle [kg, kg m^2].
        tyre: `Tyre`, or None.
        axle: direction (3,) of the axle, to the left.
        road: body whose frame the road has: "ground", or the post of a rig.
        brake: law on the spin, such as `BrakeTorque`; None for none.
    """
    vectors = {"centre": centre, "inertia": inertia, "axle": axle}
    check_parts(
        {"mass": mass}, vectors, {"tyre": tyre, "brake": brake}, {"name": name, "upright": upright, "road": road}
    )
    add, along = Adder(b, name), number(axle)
    axes = jnp.roll(axes_along(along / jnp.linalg.norm(along)), 1, axis=1)  # the axle second
    wheel = add.body("wheel", mass, inertia=inertia, position=centre, rotation=axes)
    add.joint("spin", Revolute("y"), upright, wheel, parent_frame=Pose(centre, axes))
    if tyre is not None:
        add.force("tyre", tyre, between=(road, wheel))
    if brake is not None:
        add.force("brake", brake, joint=add.joints["spin"])
    return add.parts()
