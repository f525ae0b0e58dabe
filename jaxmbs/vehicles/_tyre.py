"""A tyre between a road and a wheel."""

import os
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..checks import faults_if, flag, is_concrete, negative, not_positive
from ..drawings import Drawing, Wheel
from ..forces._base import AbstractPoseLaw
from ..forces._fields import number, optional_number
from ..forces._internal_state import InternalState, States
from ..forces._readings import Arrows, Reading
from ..forces._validity import Margin
from ..typing import Convertible, Matrix3, Scalar, ScalarLike, Vector3, WordedError
from ._magic_formula import MagicFormula
from ._relaxation import deflection_rates, passing_slips, steady_deflections
from ._road import AbstractRoad, FlatRoad
from ._tir import read_tir
from ._tyre_model import AbstractTyreModel, Compression, ContactForces, Slip
from ._wheel_contact import WheelContact, rolling_direction, wheel_contact

_ROUNDS = 3  # in which load and forces at the contact agree, where they depend on each other


class Rolling(NamedTuple):
    """A tyre at an instant.

    Attributes: contact: where it touches; slip: of which the forces are; forces: at the contact, without the load;
    radius: effective rolling radius [m]; sliding: velocities (2,) of the tread over the road [m/s].
    """

    contact: WheelContact
    slip: Slip
    forces: ContactForces
    radius: Any
    sliding: tuple[Any, Any]


class Tyre(AbstractPoseLaw):
    """A tyre that rolls on a road, frame A with z up, at a wheel, frame B, that turns about its axis y.

    `b.force("tyre", Tyre.from_tir("front.tir"), between=("ground", "wheel"))`.  The wheel's axis points to the left,
    so that rolling forward is a positive turn.  Forces act at the lowest point of the wheel's plane.

    With relaxation the tread's deflections along and across [m] are internal states: forces build up over the
    relaxation lengths, and the tyre stands, starts, and rolls back; slips are those of the deflections.  Without it
    forces are those of steady rolling, and a car on a slope does not stay where it is.

    Attributes:
        model: forces over slip: `MagicFormula`, `LinearTyre`, `FialaTyre`, `BrushTyre`.
        road: heights over the frame A; flat by default.
        pressure: of inflation [Pa]; None for the nominal one of the model.
        has_relaxation: whether deflections are states (static).
        tread_damping: time [s]: at standstill a sliding speed gives the force of the deflection that it makes in it.

    Source: Pacejka (2012), chapters 4.3 and 7.2 for the deflections.
    """

    model: WordedError[AbstractTyreModel]
    road: WordedError[AbstractRoad] = eqx.field(default_factory=FlatRoad)
    pressure: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    has_relaxation: bool = eqx.field(static=True, converter=flag("has_relaxation"), default=True)
    tread_damping: Convertible[Scalar] = eqx.field(converter=number, default=0.02)
    is_source: ClassVar[bool] = False

    def __check_init__(self):
        kinds = {"model": AbstractTyreModel, "road": AbstractRoad}
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise TypeError(f"{name} must be an {kind.__name__}, got {type(getattr(self, name)).__name__}")

    @classmethod
    def from_tir(
        cls,
        path: str | os.PathLike,
        side: str | None = None,
        convention: str = "pacejka",
        road: AbstractRoad | None = None,
        has_relaxation: bool = True,
    ) -> "Tyre":
        """A tyre from a property file: PAC2002 (MF 5.2), MF 6.1, MF 6.2.

        Args:
            path: of the `.tir` file.
            side: "left" or "right" of the car where it is mounted: mirrored where it was measured on the other one
                (TYRESIDE).  None: as it was measured.
            convention: the program that is followed where programs differ: "pacejka", "opentire", "mfeval", "chrono".

        Raises: ModelFileError with every fault and its line; ValueError for an unknown side or convention.
        """
        if side not in (None, "left", "right"):
            raise ValueError(f"side must be 'left' or 'right', got {side!r}")
        file = read_tir(path)
        mirrored = side is not None and file.side != "symmetric" and side != file.side
        model = MagicFormula(file.coefficients, file.fit, convention, mirrored)
        pressure = file.coefficients.get("INFLPRES", file.coefficients.get("NOMPRES"))
        return cls(model, FlatRoad() if road is None else road, pressure, has_relaxation)

    def forces(
        self,
        load: ScalarLike,
        kappa: ScalarLike = 0.0,
        alpha: ScalarLike = 0.0,
        gamma: ScalarLike = 0.0,
        speed: ScalarLike | None = None,
        pressure: ScalarLike | None = None,
        axes: str = "ISO",
    ) -> ContactForces:
        """Forces and moments at the contact in steady rolling.

        Args:
            load: [N].
            kappa: slip along the wheel, positive driving, -1 of a locked wheel.
            alpha: slip angle [rad], below a right angle.
            gamma: inclination angle [rad].
            speed: forward [m/s]; None: so that no moment depends on it.
            pressure: of inflation [Pa]; None: that of the tyre.
            axes: "ISO" (z up, a positive alpha gives a negative fy), "SAE" (z down), or "adapted SAE" (z down, a
                positive alpha gives a positive fy).

        Raises: ValueError for unknown axes.
        """
        sign = _side_slip_sign(axes)
        slip = self.slip(load, kappa, sign * number(alpha), gamma, speed, pressure)
        return _in_axes(self.model.forces(slip), axes)

    def slip(
        self,
        load: ScalarLike,
        kappa: ScalarLike = 0.0,
        alpha: ScalarLike = 0.0,
        gamma: ScalarLike = 0.0,
        speed: ScalarLike | None = None,
        pressure: ScalarLike | None = None,
    ) -> Slip:
        """Input of the model; arguments as of `forces`, in ISO axes."""
        pressure = self.pressure if pressure is None else number(pressure)
        forward = number(0.0 if speed is None else speed)
        tangent, camber = jnp.tan(number(alpha)), jnp.sin(number(gamma))
        direction = 1.0 if speed is None else rolling_direction(forward, self.model.standstill_speed)
        return Slip(number(load), number(kappa), tangent, camber, forward, pressure, direction)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """Deflections of the tread along and across the wheel [m]."""
        if not self.has_relaxation:
            return {}
        return {name: InternalState((), "m", 0.01, np.inf) for name in ("along", "across")}

    @property
    def holds(self) -> tuple[str, ...]:
        """The deflections, at standstill."""
        return tuple(self.internal_states)

    def start(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> States:
        """Deflections of steady rolling."""
        if not self.has_relaxation:
            return {}
        contact, slip, sliding = self._sliding(rotation, displacement, angular_velocity, velocity)[:3]
        found = steady_deflections(self.model, slip, sliding)
        return dict(zip(("along", "across"), found, strict=True))

    def rate(  # type: ignore[override]
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> States:
        """Rates of the deflections."""
        if not self.has_relaxation:
            return {}
        _, slip, sliding = self._sliding(rotation, displacement, angular_velocity, velocity)[:3]
        found = deflection_rates(self.model, slip, sliding, (s["along"], s["across"]))
        return dict(zip(("along", "across"), found, strict=True))

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, *s_and_t: Any
    ) -> tuple[Vector3, Vector3]:
        """Force of the road on the wheel, and moment about its centre; with relaxation s is before t."""
        at = self.rolling(rotation, displacement, angular_velocity, velocity, *s_and_t)
        contact, forces = at.contact, at.forces
        force = forces.fx * contact.forward + forces.fy * contact.left + at.slip.load * contact.normal
        moment = forces.mx * contact.forward + forces.my * contact.left + forces.mz * contact.normal
        return force, moment + jnp.cross(contact.point - displacement, force)

    def potential(self, rotation: Matrix3, displacement: Vector3, *_: Any) -> Scalar:
        """Energy [J] of the upright wheel's deflection: its load integrated by four Gauss points.

        Forces at the contact, speed and camber change the load, not this energy.
        """
        contact = self._contact(rotation, displacement, jnp.zeros_like(displacement), jnp.zeros_like(displacement))
        deflection = jnp.maximum(self.model.free_radius(0.0) - contact.radius, 0.0)
        nodes, weights = np.polynomial.legendre.leggauss(4)
        loads = [self.model.load(Compression(deflection * x, pressure=self.pressure)) for x in 0.5 + 0.5 * nodes]
        return deflection * sum(0.5 * w * load for w, load in zip(weights, loads, strict=True))

    def rolling(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, *s_and_t: Any
    ) -> Rolling:
        """The tyre at an instant; arguments as of `wrench`."""
        contact, slip, sliding, compression = self._sliding(rotation, displacement, angular_velocity, velocity)
        states = self._states(s_and_t)
        load = slip.load

        def at_load(load):
            now = passing_slips(self.model, slip._replace(load=load), sliding, states, self.tread_damping)
            return now, self.model.forces(now)

        slip, forces = at_load(load)
        if self.model.load_follows_forces:
            for _ in range(_ROUNDS):
                load = self._load(compression._replace(fx=forces.fx, fy=forces.fy))
                slip, forces = at_load(load)
        radius = self.model.rolling_radius(slip.load, contact.spin, self.pressure)
        return Rolling(contact, slip, forces, radius, sliding)

    def _states(self, s_and_t):
        return (s_and_t[0]["along"], s_and_t[0]["across"]) if self.has_relaxation else None

    def _contact(self, *motion):
        return wheel_contact(self.road, *motion)

    def _load(self, compression):
        """Load with damping, which sets in over a thousandth of the radius and never pulls."""
        load, depth = self.model.load(compression), compression.deflection
        begin = jnp.clip(depth / (1e-3 * self.model.free_radius(0.0)), 0.0, 1.0)
        damping = self.model.damping(compression) * compression.rate * begin * begin * (3.0 - 2.0 * begin)
        return jnp.maximum(load + damping, 0.0)

    def _sliding(self, *motion):
        """Contact, slip with the load and without slips, velocities of the tread over the road, compression."""
        contact = self._contact(*motion)
        deflection = self.model.free_radius(contact.spin) - contact.radius
        compression = Compression(deflection, -contact.radius_rate, contact.spin, contact.camber, self.pressure)
        load = self._load(compression)
        direction = rolling_direction(contact.speed, self.model.standstill_speed)
        zero = jnp.zeros_like(load)
        slip = Slip(load, zero, zero, contact.camber, contact.speed, self.pressure, direction)
        radius = self.model.rolling_radius(load, contact.spin, self.pressure)
        return contact, slip, (contact.speed - contact.spin * radius, contact.side_speed), compression

    def drawing(self) -> Drawing:
        """The road and the wheel."""
        radius = float(np.asarray(self.model.free_radius(0.0)))
        return *self.road.drawing(), Wheel(radius, 0.6 * radius, 1, (0.0, 1.0, 0.0))

    def report(self, *args: Any) -> dict[str, Reading]:
        """Load, forces, moments, slips and radii."""
        at = self.rolling(*args)
        forces, slip = at.forces, at.slip
        return {
            "load": Reading(slip.load, "N"),
            "force along": Reading(forces.fx, "N"),
            "force across": Reading(forces.fy, "N"),
            "overturning moment": Reading(forces.mx, "N m"),
            "rolling resistance": Reading(forces.my, "N m"),
            "aligning moment": Reading(forces.mz, "N m"),
            "slip": Reading(slip.kappa),
            "slip angle": Reading(jnp.arctan(slip.tangent), "rad"),
            "inclination angle": Reading(jnp.arcsin(slip.camber), "rad"),
            "loaded radius": Reading(at.contact.radius, "m"),
            "rolling radius": Reading(at.radius, "m"),
        }

    def arrows(self, *args: Any) -> Arrows:
        """The force at the contact."""
        at = self.rolling(*args)
        c = at.contact
        force = at.forces.fx * c.forward + at.forces.fy * c.left + at.slip.load * c.normal
        return Arrows(c.point[None], force[None])

    def validity(self, *args: Any) -> dict[str, Margin]:
        """Half of the radius that is left to the deflection [m]; what road and model say of their ranges."""
        contact, slip, sliding = self._sliding(*args[:4])[:3]
        left = contact.radius - 0.5 * self.model.free_radius(0.0)
        loaded, states = slip.load > 0.0, self._states(args[4:])
        now = passing_slips(self.model, slip, sliding, states, self.tread_damping)
        slip = slip._replace(kappa=jnp.where(loaded, now.kappa, 0.0), tangent=jnp.where(loaded, now.tangent, 0.0))
        rim = {"rim": Margin(left, "m", "is pressed in by half of its radius")}
        return rim | self.road.validity(contact.point[:2]) | self.model.validity(slip)

    def faults(self) -> list[str]:
        """Those of its parts too; relaxation needs lengths."""
        found = super().faults() + faults_if(
            (self.pressure is not None and not_positive(self.pressure), "pressure must be positive"),
            (negative(self.tread_damping), "tread_damping must not be negative"),
            (self.tread_damping.shape != (), "tread_damping must be one number"),
            (self.pressure is not None and self.pressure.shape != (), "pressure must be one number"),
        )
        if found or not self.has_relaxation:
            return found
        slip = self.slip(self.model.usual_load)
        lengths = self.model.relaxation_lengths(slip)
        return faults_if(
            (
                any(not_positive(length) or not np.all(np.isfinite(length)) for length in map(_host_value, lengths)),
                "the model has no relaxation lengths, of PTX1 and PTY1 (MF 5.2), LONGITUDINAL_STIFFNESS and "
                "LATERAL_STIFFNESS (MF 6.1, 6.2): give them, or has_relaxation=False",
            )
        )


def _host_value(value):
    return np.asarray(value) if is_concrete(value) else np.ones(())


def _side_slip_sign(axes):
    signs = {"ISO": 1.0, "SAE": -1.0, "adapted SAE": 1.0}
    if axes not in signs:
        raise ValueError(f"axes must be one of {', '.join(map(repr, signs))}, got {axes!r}")
    return signs[axes]


def _in_axes(forces, axes):
    """Forces in axes with y to the right and z down, or as they are."""
    if axes == "ISO":
        return forces
    return forces._replace(fy=-forces.fy, my=-forces.my, mz=-forces.mz)
