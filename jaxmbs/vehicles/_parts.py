"""MountedParts that a function adds to a builder, by name, and the loads of the hardpoints where they are carried."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..assembly import State
from ..assembly._state import HasStates
from ..builder import SystemBuilder
from ..checks import any_concrete, no_such, number_faults, shape_of
from ..errors import ModelError
from ..forces import AbstractLaw
from ..forces._fields import number
from ..joints import Distance
from ..kinematics import rotation
from ..model import System
from ..reaction import Reactions, reactions
from ..typing import ArrayLike, WordedError

SIDES = {"left": 1.0, "right": -1.0}


class MountedParts(NamedTuple):
    """Names of what was added to a builder.

    Attributes:
        bodies, joints, rods, forces: full names of bodies, joints, rods (constraints) and force elements, by part.
        points: by hardpoint on what carries the parts, full names of the joints, rods and force elements that meet
            there.
        cut: joints that close loops, for `build(cut=)`.
    """

    bodies: dict[str, str]
    joints: dict[str, str]
    rods: dict[str, str]
    forces: dict[str, str]
    points: dict[str, tuple[str, ...]]
    cut: tuple[str, ...]


class Side(NamedTuple):
    """A side of a car: sign of y (1 left, -1 right), and the origin of the hardpoints (3,) [m]."""

    sign: float
    origin: Any

    def point(self, x: Any) -> Any:
        """A hardpoint (3,) in the axes of the car, y to the left."""
        return number(self.origin) + number(x) * jnp.asarray(np.array([1.0, self.sign, 1.0]))


def side_of(side: str, at: ArrayLike) -> Side:
    """A side by name.  Raises: ValueError."""
    if side not in SIDES:
        raise ValueError(no_such("side", side, SIDES))
    return Side(SIDES[side], at)


def check_parts(
    numbers: Mapping[str, Any] | None = None,
    vectors: Mapping[str, Any] | None = None,
    laws: Mapping[str, Any] | None = None,
    names: Mapping[str, Any] | None = None,
    points: Mapping[str, Any] | None = None,
) -> None:
    """Raise a ModelError with a sentence for each argument that is not of its kind; None among laws is taken.

    Args: by name of the argument, numbers that are not negative, vectors (3,), force laws, names, and points (3,) by
    name.
    """
    faults: list[str] = []
    for name, value in (numbers or {}).items():
        faults += number_faults(name, value)
    of_points = {f"hardpoint {name!r}": x for name, x in (points or {}).items()}
    for name, value in {**(vectors or {}), **of_points}.items():
        is_text = isinstance(value, str | bytes | None)
        if is_text or shape_of(value) != (3,) or np.iscomplexobj(value) or any_concrete(_is_odd, value):
            faults.append(f"{name} must be three finite numbers, not {value!r}")
    for name, value in (laws or {}).items():
        if value is not None and not isinstance(value, AbstractLaw):
            faults.append(f"{name} must be a force law, not {value!r}")
    faults += [f"{n} must be text, not {value!r}" for n, value in (names or {}).items() if not isinstance(value, str)]
    if faults:
        raise ModelError(faults, "the parts")


def _is_odd(x):
    return ~np.isfinite(np.asarray(x, float))


class Adder:
    """Adds parts to a builder under a common name before theirs, and keeps what it added."""

    def __init__(self, b: Any, name: str) -> None:
        """Raises: ModelError for what is no builder."""
        if not isinstance(b, SystemBuilder):
            raise ModelError([f"parts are added to a SystemBuilder, got {type(b).__name__}"], "the parts")
        self.builder, self.name = b, name
        self.bodies: dict[str, str] = {}
        self.joints: dict[str, str] = {}
        self.rods: dict[str, str] = {}
        self.forces: dict[str, str] = {}
        self.points: dict[str, tuple[str, ...]] = {}
        self.cut: list[str] = []

    def full(self, part: str) -> str:
        """Full name of a part."""
        return f"{self.name} {part}"

    def body(self, part: str, *args: Any, **options: Any) -> str:
        """A body; arguments as of `SystemBuilder.body`.  Returns: its full name."""
        self.bodies[part] = self.full(part)
        self.builder.body(self.full(part), *args, **options)
        return self.full(part)

    def joint(self, part: str, *args: Any, point: str | None = None, is_cut: bool = False, **options: Any) -> None:
        """A joint from its carrier, at a hardpoint or at none; other arguments as of `SystemBuilder.joint`."""
        self.joints[part] = self.full(part)
        self.builder.joint(self.full(part), *args, **options)
        self._at(point, part)
        if is_cut:
            self.cut.append(self.full(part))

    def rod(self, part: str, point: str | None, inner: tuple[str, Any], outer: tuple[str, Any]) -> None:
        """A rod from its carrier, with the length of the design position."""
        self.rods[part] = self.full(part)
        length = jnp.linalg.norm(number(outer[1]) - number(inner[1]))
        self.builder.constraint(self.full(part), Distance(length), between=(inner, outer))
        self._at(point, part)

    def slide(self, point: str, law: Any, inner: tuple[str, Any], outer: tuple[str, Any]) -> None:
        """A constraint between a frame of the carrier and one of a part, at a hardpoint of its name."""
        self.rods[point] = self.full(point)
        self.builder.constraint(self.full(point), law, between=(inner, outer))
        self._at(point, point)

    def force(self, part: str, law: Any, point: str | None = None, **options: Any) -> None:
        """A force element from its carrier; other arguments as of `SystemBuilder.force`."""
        self.forces[part] = self.full(part)
        self.builder.force(self.full(part), law, **options)
        self._at(point, part)

    def parts(self) -> MountedParts:
        """Names of all that has been added."""
        return MountedParts(self.bodies, self.joints, self.rods, self.forces, self.points, tuple(self.cut))

    def _at(self, point, part):
        if point is not None:
            self.points[point] = (*self.points.get(point, ()), self.full(part))


def hardpoint_loads(
    system: WordedError[System],
    motion: WordedError[State | HasStates],
    parts: WordedError[MountedParts],
    carrier: str = "ground",
) -> dict[str, Array]:
    """Forces (..., 3) [N] of the carrier on parts at their hardpoints, along a motion or at a state.

    Args:
        system: the built system.
        motion: a State, or a Motion or states with leading axes.
        parts: as a `mount_` function returned them.
        carrier: body in whose axes the forces are given; its name, or "ground".

    Between the points of one rigid arm, what statics does not determine is shared by least compliance.
    Raises: ModelError for what are no parts.
    """
    if not isinstance(parts, MountedParts):
        raise ModelError([f"parts are what a mount_ function returns, got {type(parts).__name__}"], "the question")
    R: Any = rotation(system, motion, carrier)  # type: ignore[arg-type]
    return point_loads(reactions(system, motion), R, parts)


def point_loads(found: Reactions, R: Any, parts: MountedParts) -> dict[str, Array]:
    """Forces (..., 3) at the hardpoints of parts [N] along axes (..., 3, 3), of known reactions."""
    laws = set(parts.forces.values())
    force: Any = lambda name: found.law(name).force if name in laws else found[name].force
    in_world = {point: sum(force(name) for name in names) for point, names in parts.points.items()}
    return {point: jnp.einsum("...ji,...j->...i", R, total) for point, total in in_world.items()}
