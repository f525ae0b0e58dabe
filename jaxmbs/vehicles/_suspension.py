"""A wheel suspension by its hardpoints: an upright on rods, arms, a hinge or a sliding strut.

Axes: x forwards, y outwards, z up; points are those of the design position, in metres.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..builder import SystemBuilder
from ..checks import any_concrete, faults_if, is_concrete, no_such, not_positive
from ..errors import ModelError
from ..forces import Force, Torque
from ..forces._fields import number
from ..joints import Distance, FramePath, Free, Prismatic, Revolute, Spherical, Universal
from ..model import Pose
from ..tables import fields_repr
from ..typing import Convertible, Scalar

UPRIGHT = "upright"
STRUT = "strut"


class SuspensionRod(NamedTuple):
    """A rod with a ball at each end: its name, its point on the chassis, and its point on a body."""

    name: str
    inner: str
    outer: str
    body: str = UPRIGHT


class Arm(NamedTuple):
    """A rigid arm: its name, its points on the chassis, and its ball on the upright."""

    name: str
    inner: tuple[str, ...]
    ball: str


class Strut(NamedTuple):
    """A spring and damper: its top on the chassis, its foot and the body of the foot.

    `guides`: it slides along the line of its points in a tube that is fixed to the body (McPherson), in place of a
    ball at the foot.
    """

    top: str
    foot: str
    body: str = UPRIGHT
    guides: bool = False


class Suspension(eqx.Module):
    """A wheel suspension whose wheel travels and steers; made by `double_wishbone`, `mcpherson` and others.

    Attributes:
        hardpoints: (3,) by name [m].
        radius: of the wheel under load, for the contact point [m].
        rods, arms: (static).
        strut: spring and damper (static).
        hinge: names of two points about whose line the upright turns on the chassis, None for none (static).
        axle: names of the inner and outer point of the wheel's axle, the outer one is the wheel centre (static).
        kingpin: names of the lower and upper point of the steering axis, None where it has none (static).
        rack: names of points that move along y with the rack (static).
    """

    hardpoints: dict[str, Array]
    radius: Convertible[Scalar] = eqx.field(converter=number)
    rods: tuple[SuspensionRod, ...] = eqx.field(static=True)
    arms: tuple[Arm, ...] = eqx.field(static=True)
    strut: Strut = eqx.field(static=True)
    hinge: tuple[str, str] | None = eqx.field(static=True)
    axle: tuple[str, str] = eqx.field(static=True)
    kingpin: tuple[str, str] | None = eqx.field(static=True)
    rack: tuple[str, ...] = eqx.field(static=True)

    __repr__ = fields_repr

    def __init__(
        self,
        hardpoints: Mapping[str, Any],
        radius: Any,
        strut: Strut,
        rods: tuple[SuspensionRod, ...] = (),
        arms: tuple[Arm, ...] = (),
        hinge: tuple[str, str] | None = None,
        axle: tuple[str, str] = ("AI", "AO"),
        kingpin: tuple[str, str] | None = ("LO", "UO"),
        rack: tuple[str, ...] = (),
    ) -> None:
        """Raises: ModelError for points that are missing or not three numbers, and a radius that is not positive."""
        self.rods, self.arms, self.strut, self.hinge = tuple(rods), tuple(arms), strut, hinge
        self.axle, self.kingpin, self.rack = axle, kingpin, rack
        pairs = {"axle": axle, "kingpin": kingpin, "hinge": hinge}
        wrong = [n for n, x in pairs.items() if x is not None and not (isinstance(x, tuple | list) and len(x) == 2)]
        if wrong:
            raise ModelError([f"{name} must be the names of two points" for name in wrong], "the suspension")
        used = self.used_points()
        if not isinstance(hardpoints, Mapping):
            raise ModelError(["hardpoints must be {name: (x, y, z)}"], "the suspension")
        faults = [f"hardpoint {name!r} is missing" for name in used if name not in hardpoints]
        faults += [no_such("hardpoint", name, used) for name in hardpoints if name not in used]
        if not faults:
            self.hardpoints = {name: number(hardpoints[name]) for name in used}
            faults += [
                f"hardpoint {name!r} must be three finite numbers"
                for name, x in self.hardpoints.items()
                if x.shape != (3,) or any_concrete(lambda x: ~np.isfinite(x), x)
            ]
            self.radius = number(radius)
            faults += faults_if((self.radius.shape != (), "radius must be one number"))
            faults += faults_if((not_positive(self.radius), "radius must be positive"))
        if not faults and is_concrete(self.hardpoints):
            faults += self._short_parts()
        if self.hinge is not None and self.strut.guides:
            faults.append("an upright on a hinge does not slide along its strut")
        if faults:
            raise ModelError(faults, "the suspension")

    def used_points(self) -> tuple[str, ...]:
        """Names of all points, in the order of the parts."""
        names = [name for rod in self.rods for name in (rod.inner, rod.outer)]
        names += [name for arm in self.arms for name in (*arm.inner, arm.ball)]
        names += [*(self.hinge or ()), self.strut.top, self.strut.foot, *(self.kingpin or ()), *self.axle]
        return tuple(dict.fromkeys(names))

    def declare(self, b: SystemBuilder, rack: Any = 0.0, stretch: Mapping[str, Any] | None = None) -> list[str]:
        """Add massless bodies and joints to a builder, on its ground; bodies have the axes of the design position.

        Args: rack: displacement along y [m]; stretch: of rods by name [m].
        Returns: names of the joints that close loops, for `build(cut=)`.
        """
        H = self.points_at_rack(rack)
        b.body(UPRIGHT, 1.0, com=H[self.axle[1]], inertia=0.1)
        if self.hinge is None and not self.strut.guides:
            b.joint("float", Free(), "ground", UPRIGHT)
        elif self.hinge is not None:
            first, second = (H[name] for name in self.hinge)
            along = (second - first) / jnp.linalg.norm(second - first)
            frame = Pose(first, axes_along(along))
            b.joint("hinge", Revolute("x"), "ground", UPRIGHT, parent_frame=frame, child_frame=frame)
        for rod in self.rods:
            length = jnp.linalg.norm(self.hardpoints[rod.inner] - self.hardpoints[rod.outer])
            length = length + (stretch or {}).get(rod.name, 0.0)
            b.constraint(rod.name, Distance(length), between=(("ground", H[rod.inner]), (rod.body, H[rod.outer])))
        cut = [name for arm in self.arms for name in self._declare_arm(b, H, arm)]
        return [*cut, *self._declare_strut(b, H)]

    def points_at_rack(self, rack: Any) -> dict[str, Array]:
        """Hardpoints with those of the rack moved."""
        along = rack * jnp.asarray(np.array([0.0, 1.0, 0.0]))
        return {name: x + along if name in self.rack else x for name, x in self.hardpoints.items()}

    def system(
        self,
        travel: Any = 0.0,
        rack: Any = 0.0,
        force: Any = None,
        moment: Any = None,
        place: Any = None,
        like: Any = None,
        stretch: Mapping[str, Any] | None = None,
    ) -> Any:
        """The mechanism with its wheel centre led to a height.

        Args:
            travel: rise of the wheel centre from the design position [m].
            rack: displacement of the rack along y [m].
            force, moment: (3,) on the upright [N, N m].
            place: (3,) where the force acts, in the upright's axes at design [m]; default the wheel centre.
            like: system of the same suspension, see `SystemBuilder.build`.
            stretch: of rods by name [m].
        """
        b = SystemBuilder(gravity=(0.0, 0.0, 0.0))
        cut = self.declare(b, rack, stretch)
        centre = self.hardpoints[self.axle[1]]
        zero = jnp.zeros(3)
        at = centre if place is None else place
        b.force("load", Force(zero if force is None else force), on=(UPRIGHT, at))
        b.force("moment", Torque(zero if moment is None else moment), on=(UPRIGHT, at))
        height = centre[2] + travel
        lead = FramePath(height * jnp.asarray(np.array([0.0, 0.0, 1.0])), hold=("z",))
        b.constraint("travel", lead, between=("ground", (UPRIGHT, centre)))
        return b.build(like=like, cut=cut)

    def _declare_arm(self, b, H, arm):
        b.body(arm.name, 1.0, com=H[arm.ball], inertia=0.1)
        for name in arm.inner:
            b.joint(name, Spherical(), "ground", arm.name, at=H[name])
        b.joint(arm.ball, Spherical(), arm.name, UPRIGHT, at=H[arm.ball])
        return [*arm.inner[1:], arm.ball]

    def _declare_strut(self, b, H):
        top, foot = H[self.strut.top], H[self.strut.foot]
        axes, length = axes_along((foot - top) / jnp.linalg.norm(foot - top)), jnp.linalg.norm(foot - top)
        b.body("tube", 1.0, inertia=0.1)
        there = length * jnp.asarray(np.array([1.0, 0.0, 0.0]))
        if self.strut.guides:
            b.joint("strut_top", Spherical(), "ground", "tube", parent_frame=Pose(top, axes))
            slide = Pose(foot, axes)
            b.joint(STRUT, Prismatic("x"), "tube", self.strut.body, parent_frame=there, child_frame=slide)
            return []
        b.body("rod", 1.0, inertia=0.1)
        b.joint("strut_top", Universal(("y", "z")), "ground", "tube", parent_frame=Pose(top, axes))
        b.joint(STRUT, Prismatic("x"), "tube", "rod")
        b.joint("strut_foot", Spherical(), "rod", self.strut.body, parent_frame=there, child_frame=foot)
        return ["strut_foot"]

    def _short_parts(self):
        """Sentences for parts whose ends are in one place."""
        pairs = [(rod.name, rod.inner, rod.outer) for rod in self.rods]
        pairs += [(STRUT, self.strut.top, self.strut.foot), ("axle", *self.axle)]
        pairs += [("hinge", *self.hinge)] if self.hinge else []
        H = {name: np.asarray(x) for name, x in self.hardpoints.items()}
        return [f"{name!r}: both ends are in one place" for name, a, b in pairs if np.linalg.norm(H[a] - H[b]) < 1e-9]


def axes_along(x):
    """Axes (3, 3) whose first is a unit vector x (3,)."""
    first, second = (jnp.asarray(axis) for axis in np.eye(3)[:2])
    helper = jnp.where(jnp.abs(x[0]) < 0.9, first, second)
    y = jnp.cross(x, helper)
    y = y / jnp.linalg.norm(y)
    return jnp.stack([x, y, jnp.cross(x, y)], axis=1)
