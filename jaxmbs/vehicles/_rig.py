"""Kinematics and compliance rig: a suspension over wheel travel and rack, its curves, and loads of its parts."""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..assembly import State
from ..checks import no_such, not_positive
from ..errors import ModelError
from ..forces._fields import number
from ..kinematics import position, rotation
from ..model import System
from ..reaction import reactions
from ..runtime import jit
from ..typing import ArrayLike, WordedError
from ._rig_curves import RigCurves
from ._suspension import STRUT, UPRIGHT, Suspension

_UP = np.array([0.0, 0.0, 1.0])


class Rig(eqx.Module):
    """A suspension on the rig, made by `kc_rig`.

    Attributes: suspension: as it was given; first: its mechanism in the design position, whose programs serve all
    others.
    """

    suspension: Suspension
    first: System

    def curves(
        self, travel: ArrayLike, rack: ArrayLike = 0.0, hardpoints: Mapping[str, ArrayLike] | None = None
    ) -> RigCurves:
        """Curves over wheel travel and rack, arrays of one shape or numbers [m].

        Args: hardpoints: in place of those of the suspension, all or some of them [m]; derivatives by these.
        """
        own = self.with_points(hardpoints)
        travel, rack = jnp.broadcast_arrays(number(travel), number(rack))
        return _curves(own, travel, rack)

    def with_points(self, hardpoints: Mapping[str, ArrayLike] | None) -> "Rig":
        """The rig of other hardpoints.  Raises: ModelError for names that the suspension does not have."""
        if hardpoints is None:
            return self
        own = self.suspension
        unknown = [name for name in hardpoints if name not in own.hardpoints]
        if unknown:
            raise ModelError([f"the suspension has no hardpoint {name!r}" for name in unknown], "the question")
        points = own.hardpoints | {name: number(x) for name, x in hardpoints.items()}
        return Rig(eqx.tree_at(lambda s: s.hardpoints, own, points), self.first)

    def loads(
        self,
        force: ArrayLike,
        moment: ArrayLike = (0.0, 0.0, 0.0),
        travel: ArrayLike = 0.0,
        rack: ArrayLike = 0.0,
        at: str = "contact",
        hardpoints: Mapping[str, ArrayLike] | None = None,
    ) -> "PartLoads":
        """Loads of all parts at one pose; the wheel is held at its travel by the spring.

        Args:
            force, moment: (3,) on the wheel, which is locked to the upright, at the contact or the wheel centre
                [N, N m].
            travel, rack: as of `curves`, one number each [m].
            at: "contact" or "centre".
            hardpoints: as of `curves`.

        What statics does not determine is shared by least compliance.  Raises: ValueError for an unknown `at`.
        """
        if at not in ("contact", "centre"):
            raise ValueError(f"at must be 'contact' or 'centre', got {at!r}")
        load, pose = (number(force), number(moment)), (number(travel), number(rack))
        return self.with_points(hardpoints).part_loads(*load, *pose, jnp.asarray(at == "contact"))

    def compliance(
        self,
        stiffness: Mapping[str, ArrayLike],
        force: ArrayLike,
        moment: ArrayLike = (0.0, 0.0, 0.0),
        travel: ArrayLike = 0.0,
        rack: ArrayLike = 0.0,
        at: str = "contact",
    ) -> "Compliance":
        """Small changes of toe, camber and place under a load, by rods with bushings at their ends.

        Args:
            stiffness: along the rod, of both bushings and the rod together, by its name [N/m]; others are rigid.
            force, moment, travel, rack, at: as of `loads`.

        To first order: the wheel stays at its travel, each rod stretches by its tension over its stiffness.
        Raises: ModelError for names of no rod, and a stiffness that is not positive.
        """
        rods = [rod.name for rod in self.suspension.rods]
        faults = [no_such("rod", name, rods) for name in stiffness if name not in rods]
        faults += [f"stiffness of {name!r} must be positive" for name, k in stiffness.items() if not_positive(k)]
        if faults:
            raise ModelError(faults, "the question")
        tensions = self.loads(force, moment, travel, rack, at).tensions
        stretch = {name: tensions[name] / number(k) for name, k in stiffness.items()}
        return _compliance(self, number(travel), number(rack), stretch)

    def part_loads(self, force: Array, moment: Array, travel: Array, rack: Array, is_contact: Array) -> "PartLoads":
        """`loads` of arrays; is_contact: True where the force acts at the contact."""
        return _loads(self, force, moment, travel, rack, is_contact)


class PartLoads(NamedTuple):
    """Loads of the parts of a suspension; vectors in the axes of the chassis.

    Attributes:
        tensions: of rods and "strut" by name [N].
        balls: forces (3,) of arms on the upright at their balls [N].
        chassis: forces (3,) of the chassis on the suspension at every hardpoint there [N].
        hinge: force (3,) [N] and moment (3,) [N m] of the chassis on an upright with a hinge, at its first point.
    """

    tensions: dict[str, Array]
    balls: dict[str, Array]
    chassis: dict[str, Array]
    hinge: dict[str, Array]


class Compliance(NamedTuple):
    """Changes of a wheel by elastic rods under a load, at the height of its centre.

    Attributes: toe, camber: [rad]; centre, contact: (3,) of the wheel centre and of the point of the upright at the
    contact [m]; strut: of its length [m].
    """

    toe: Array
    camber: Array
    centre: Array
    contact: Array
    strut: Array


def kc_rig(suspension: WordedError[Suspension]) -> Rig:
    """Put a suspension on the rig: its mechanism is built once; numbers must be known.

    `rig.curves(travel, rack)` are its curves, `rig.loads(force)` what its parts carry, both with derivatives by
    hardpoints.

    Raises: ModelError for what is no suspension, or one whose wheel does not travel.
    """
    if not isinstance(suspension, Suspension):
        raise ModelError([f"kc_rig takes a Suspension, got {type(suspension).__name__}"], "the question")
    first = suspension.system()
    if first.topology.mobility:
        raise ModelError(
            [f"the wheel has {first.topology.mobility + 1} freedoms in place of its travel: see the rods and arms"],
            "the suspension",
        )
    return Rig(suspension, first)


@jit
def _curves(rig, travel, rack):
    one = lambda z, y: _pose_curves(rig, z, y)
    flat = jax.vmap(one)(travel.ravel(), rack.ravel())
    return jax.tree.map(lambda x: x.reshape(*travel.shape, *x.shape[1:]), flat)


def _pose_curves(rig, travel, rack):
    """Curves (RigCurves) at one pose, with what they change by over the travel."""
    places, rates = jax.jvp(lambda z: _places(rig, z, rack), (travel,), (jnp.ones_like(travel),))
    # the wheel locked to the upright: velocity of the material point at the contact
    locked = _locked_velocity(rig, places, rates)
    return RigCurves.of(rig.suspension, travel, rack, places, rates, locked)


def _places(rig, travel, rack, stretch=None):
    """Points and axes of the upright at a pose: rotation, origin, hardpoints on the upright, length of the strut."""
    own = rig.suspension
    system = own.system(travel, rack, like=rig.first, stretch=stretch)
    state = State.at(system)
    R, origin = rotation(system, state, UPRIGHT), position(system, state, UPRIGHT)
    H = own.points_at_rack(rack)
    at = lambda name: R @ own.hardpoints[name] + origin
    axle = at(own.axle[1]) - at(own.axle[0])
    axle = axle / jnp.linalg.norm(axle)
    down = axle * axle[2] - jnp.asarray(_UP)
    contact = at(own.axle[1]) + own.radius * down / jnp.linalg.norm(down)
    body = own.strut.body
    foot = position(system, state, (body, own.hardpoints[own.strut.foot]))
    found = {"R": R, "origin": origin, "axle": axle, "centre": at(own.axle[1]), "contact": contact}
    found["strut"] = jnp.linalg.norm(foot - H[own.strut.top])
    if own.kingpin is not None:
        on_upright = [at(own.kingpin[0])]
        upper = own.kingpin[1]
        on_upright.append(H[upper] if upper == own.strut.top else at(upper))
        found["lower"], found["upper"] = on_upright
    return found


@jit
def _compliance(rig, travel, rack, stretch):
    nothing = jax.tree.map(jnp.zeros_like, stretch)
    places, rates = jax.jvp(lambda x: _places(rig, travel, rack, x), (nothing,), (stretch,))
    axle, turn = places["axle"], rates["axle"]
    flat = axle[0] ** 2 + axle[1] ** 2
    camber = -(turn[2] * flat - axle[2] * (axle[0] * turn[0] + axle[1] * turn[1])) / jnp.sqrt(flat)
    toe = (turn[0] * axle[1] - axle[0] * turn[1]) / flat
    return Compliance(toe, camber, rates["centre"], _locked_velocity(rig, places, rates), rates["strut"])


def _locked_velocity(rig, places, rates):
    """Velocity (3,) over the travel of the point of the upright that is at the contact."""
    R = places["R"]
    local = R.T @ (places["contact"] - places["origin"])
    return rates["R"] @ local + rates["origin"]


@jit
def _loads(rig, force, moment, travel, rack, is_contact):
    own = rig.suspension
    places = _places(rig, travel, rack)
    centre = own.hardpoints[own.axle[1]]
    place = jnp.where(is_contact, places["R"].T @ (places["contact"] - places["origin"]), centre)
    system = own.system(travel, rack, force, moment, place, like=rig.first)
    state = State.at(system)
    still = jnp.zeros_like(state.velocities)
    found = reactions(system, state, accelerations=still, actuators=[STRUT])
    H, tensions, chassis, balls = own.points_at_rack(rack), {}, {}, {}
    for rod in own.rods:
        along = H[rod.inner] - (places["R"] @ own.hardpoints[rod.outer] + places["origin"])
        along = along / jnp.linalg.norm(along)
        tensions[rod.name] = jnp.dot(found[rod.name].force, along)
        _add(chassis, rod.inner, tensions[rod.name] * along)
    tensions[STRUT] = -found[STRUT].effort[0]
    _add(chassis, own.strut.top, found["strut_top"].force)
    for arm in own.arms:
        balls[arm.ball] = found[arm.ball].force
        for name in arm.inner:
            _add(chassis, name, found[name].force)
    hinge = {} if own.hinge is None else {"force": found["hinge"].force, "moment": found["hinge"].moment}
    return PartLoads(tensions, balls, chassis, hinge)


def _add(forces, name, force):
    """Add a force at a point, where several parts may meet."""
    forces[name] = forces[name] + force if name in forces else force
