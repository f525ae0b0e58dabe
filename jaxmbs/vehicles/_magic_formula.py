"""The Magic Formula: MF 5.2 (PAC2002), 6.1 and 6.2."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, is_concrete, may_be_nonzero, no_such, not_positive
from ..forces._fields import number
from ..forces._validity import Margin
from ..math._extremes import least
from ..typing import Scalar
from ._coefficients import KNOWN, NEEDED, Coefficients
from ._convention import Convention, convention_of
from ._slip_curves import (
    combined_lateral,
    combined_longitudinal,
    inputs_of,
    lateral,
    longitudinal,
    slope_across,
    slope_along,
)
from ._slip_moments import Forces, aligning, overturning, pure_aligning, rolling_resistance
from ._tyre_model import AbstractTyreModel, Compression, ContactForces, Slip, SlipSlopes
from ._vertical import free_radius, load_of_compression, rolling_radius

FITS = ("5.2", "6.1", "6.2")
_LEAST_LOAD = 1e-3  # of the nominal one: below it forces are proportional to the load


class MagicFormula(AbstractTyreModel):
    """Pacejka's Magic Formula without turn slip, from coefficients by the names of `.tir` files.

    Attributes:
        coefficients: numbers by name, "PKY1"; in SI units.  Those that are left out are zero, scale factors one.
        fit: "5.2" (PAC2002), "6.1" or "6.2" (static).
        convention: the program that is followed where programs differ (static), see `CONVENTIONS`.
        mirrored: the tyre is mounted on the other side than measured (static).

    Raises: ValueError for an unknown fit or convention, and names that no formula has.
    Source: Pacejka (2012), chapter 4.3; Besselink et al. (2010); Pacejka (2002).
    """

    coefficients: dict[str, Scalar]
    fit: str = eqx.field(static=True)
    convention: Convention = eqx.field(static=True)
    mirrored: bool = eqx.field(static=True)

    def __init__(
        self, coefficients: dict, fit: str = "6.1", convention: str | Convention = "pacejka", mirrored: bool = False
    ) -> None:
        if fit not in FITS:
            raise ValueError(no_such("fit", fit, FITS))
        unknown = [name for name in coefficients if name not in KNOWN]
        if unknown:
            raise ValueError("; ".join(no_such("coefficient", name, KNOWN) for name in unknown[:5]))
        self.coefficients = {name: number(value) for name, value in coefficients.items()}
        self.fit = fit
        self.convention = convention if isinstance(convention, Convention) else convention_of(convention, fit)
        self.mirrored = bool(mirrored)

    def forces(self, slip: Slip) -> ContactForces:
        p, at, share = self._prepared(slip)
        forces = self._forces(p, at)
        fx, fy = forces.fx, forces.fy.force
        mz = aligning(p, self.convention, at, forces)
        found = (fx, fy, overturning(p, at, fy, self._is_old), rolling_resistance(p, at, fx), mz)
        return self._mirror(ContactForces(*(share * x for x in found)))

    def pure_forces(self, slip: Slip) -> ContactForces:
        """Forces of slip along the wheel alone, and of side slip alone: fx, fy and mz, no other moments."""
        p, at, share = self._prepared(slip)
        along, across, upright = self._pure(p, at)
        mz = pure_aligning(p, self.convention, at, across, upright)
        none = jnp.zeros_like(mz)
        return self._mirror(ContactForces(share * along.force, share * across.force, none, none, share * mz))

    def slopes(self, slip: Slip) -> SlipSlopes:
        p, at, share = self._prepared(slip)
        along, across = slope_along(p, at), slope_across(p, self.convention, at)
        return SlipSlopes(share * along.stiffness, share * jnp.abs(across.stiffness), along.friction, across.friction)

    def relaxation_lengths(self, slip: Slip) -> tuple[Any, Any]:
        """Source: Pacejka (2002) (A3.15) for MF 5.2; Besselink et al. (2010) (17)-(19)."""
        p, at, _ = self._prepared(slip)
        if self._is_old:
            rated, R0 = p.LFZO * p.FNOMIN, p.UNLOADED_RADIUS
            grown = jnp.exp(self.convention.relaxation_sign * p.PTX3 * at.dfz)
            along = at.load * (p.PTX1 + p.PTX2 * at.dfz) * grown * R0 / rated * p.LSGKP
            rise = jnp.sin(2.0 * jnp.arctan(at.load / (p.PTY2 * rated)))
            upright = 1.0 - p.PKY3 * jnp.abs(at.gamma * p.LGAY)
            return along, p.PTY1 * rise * upright * R0 * p.LFZO * p.LSGAL
        along, across = slope_along(p, at), slope_across(p, self.convention, at)
        stiff_x = p.LONGITUDINAL_STIFFNESS * (1.0 + p.PCFX1 * at.dfz + p.PCFX2 * at.dfz**2) * (1.0 + p.PCFX3 * at.dpi)
        stiff_y = p.LATERAL_STIFFNESS * (1.0 + p.PCFY1 * at.dfz + p.PCFY2 * at.dfz**2) * (1.0 + p.PCFY3 * at.dpi)
        return jnp.abs(along.stiffness / stiff_x), jnp.abs(across.stiffness / stiff_y)

    def load(self, at: Compression) -> Scalar:
        return load_of_compression(Coefficients(self.coefficients), at)

    def damping(self, at: Compression) -> Scalar:
        return number(Coefficients(self.coefficients).VERTICAL_DAMPING)

    def free_radius(self, spin: Any) -> Scalar:
        return free_radius(Coefficients(self.coefficients), spin)

    def rolling_radius(self, load: Any, spin: Any, pressure: Any = None) -> Scalar:
        return rolling_radius(Coefficients(self.coefficients), load, spin, pressure)

    @property
    def load_follows_forces(self) -> bool:
        p = Coefficients(self.coefficients)
        return any(name in p and may_be_nonzero(getattr(p, name)) for name in ("Q_FCX", "Q_FCY"))

    @property
    def usual_load(self) -> Any:
        return Coefficients(self.coefficients).FNOMIN

    @property
    def standstill_speed(self) -> Any:
        return Coefficients(self.coefficients).VXLOW

    def validity(self, slip: Slip) -> dict[str, Margin]:
        """Margins to the ranges of the file: of load, slip, slip angle, inclination and pressure."""
        p = Coefficients(self.coefficients)
        pressure = p.NOMPRES if slip.pressure is None else slip.pressure
        ranges = {
            "load": (slip.load, None, "FZMAX", "N"),
            "slip": (slip.kappa, "KPUMIN", "KPUMAX", ""),
            "slip angle": (jnp.arctan(slip.tangent), "ALPMIN", "ALPMAX", "rad"),
            "inclination": (jnp.arcsin(slip.camber), "CAMMIN", "CAMMAX", "rad"),
            "pressure": (number(pressure), "PRESMIN", "PRESMAX", "Pa"),
        }
        found = {}
        for name, (x, low, high, unit) in ranges.items():
            left = [getattr(p, high) - x] if high in p else []
            left += [x - getattr(p, low)] if low is not None and low in p else []
            if left:
                found[name] = Margin(least(jnp.stack(left)), unit, f"is beyond its measured range of {name}")
        return found

    def faults(self) -> list[str]:
        """Missing coefficients, and those that must be positive."""
        found = super().faults()
        missing = [name for name in NEEDED if name not in self.coefficients]
        if missing:
            return [*found, f"coefficients are missing: {', '.join(missing)}"]
        for name in ("FNOMIN", "UNLOADED_RADIUS", "NOMPRES", "VERTICAL_STIFFNESS", "LONGVL", "VXLOW"):
            value = self.coefficients.get(name)
            found += faults_if((value is not None and not_positive(value), f"{name} must be positive"))
        if is_concrete(self.coefficients):
            odd = [name for name, value in self.coefficients.items() if value.shape != ()]
            found += faults_if((bool(odd), f"each coefficient is one number: {', '.join(odd)}"))
        return found

    @property
    def _is_old(self) -> bool:
        return self.fit == "5.2"

    def _prepared(self, slip):
        """Coefficients, what the formulas take, and the factor of all forces at the smallest loads."""
        p = Coefficients(self.coefficients)
        floor = _LEAST_LOAD * p.FNOMIN
        load = jnp.maximum(slip.load, floor)
        share = jnp.where(slip.load < floor, jnp.maximum(slip.load, 0.0) / floor, 1.0)
        if self.mirrored:
            slip = slip._replace(tangent=-slip.tangent, camber=-slip.camber)
        return p, inputs_of(p, self.convention, slip._replace(load=load)), share

    def _mirror(self, forces):
        if not self.mirrored:
            return forces
        return forces._replace(fy=-forces.fy, mx=-forces.mx, mz=-forces.mz)

    def _pure(self, p, at):
        """Pure forces along and across, and across of the upright wheel where the trail takes that."""
        across = lateral(p, self.convention, at, self._is_old)
        upright = across
        if self.convention.trail_force == "upright":
            upright = lateral(p, self.convention, at._replace(gamma=0.0), self._is_old)
        return longitudinal(p, self.convention, at), across, upright

    def _forces(self, p, at):
        along, across, upright = self._pure(p, at)
        fx, fy = combined_longitudinal(p, at, along), combined_lateral(p, at, across)
        return Forces(fx, fy, along, across, upright)
