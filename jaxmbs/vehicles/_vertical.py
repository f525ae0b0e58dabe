"""Load of a compressed tyre by the Magic Formula's coefficients, and its radii.

Source: Besselink et al. (2010) (1)-(10); Pacejka (2012), appendix 3; MF 6.2 with camber after the manual of MF-Swift.
"""

from typing import Any

import jax.numpy as jnp

from ..forces._one_sided import one_sided
from ..typing import Scalar
from ._coefficients import Coefficients
from ._tyre_model import Compression, pressed

_RIM = 1e-3  # width over which the rim begins to carry [m]


def load_of_compression(p: Coefficients, at: Compression) -> Scalar:
    """Load [N] of a deflection."""
    R0, depth = p.UNLOADED_RADIUS, pressed(at)
    if "Q_CAM1" in p or "Q_CAM2" in p or "Q_CAM3" in p:
        depth = jnp.maximum(depth + _camber_deflection(p, at, depth), 0.0)
    x = jnp.where(at.deflection > 0.0, depth, 0.0) / R0
    linear = _linear_stiffness(p) + p.Q_FZ3 * at.camber**2
    load = (linear * x + p.Q_FZ2 * x * x) * p.FNOMIN * (1.0 + p.PFZ1 * _pressure(p, at.pressure)) * p.LCZ
    load = load * _factor(p, at, x)
    if "BOTTOM_STIFF" in p:
        free = R0 - p.RIM_RADIUS - p.BOTTOM_OFFST
        load = load + p.BOTTOM_STIFF * one_sided(at.deflection - free, _RIM)
    return load


def free_radius(p: Coefficients, spin: Any) -> Scalar:
    """Radius [m] without load; it grows with the speed of turning."""
    R0 = p.UNLOADED_RADIUS
    grown = p.Q_V1 * (spin * R0 / p.LONGVL) ** 2 if "Q_V1" in p else 0.0
    return R0 * (p.Q_RE0 + grown)


def rolling_radius(p: Coefficients, load: Any, spin: Any, pressure: Any) -> Scalar:
    """Effective rolling radius [m]; without coefficients of its own a third of the deflection is lost."""
    stiffness, x = vertical_stiffness(p, pressure), load / p.FNOMIN
    if "BREFF" in p or "DREFF" in p or "FREFF" in p:
        lost = p.DREFF * jnp.arctan(p.BREFF * x) + p.FREFF * x
    else:
        lost = x / 3.0
    return free_radius(p, spin) - p.FNOMIN / stiffness * lost


def vertical_stiffness(p: Coefficients, pressure: Any) -> Any:
    """Stiffness [N/m] at the nominal load."""
    if "VERTICAL_STIFFNESS" in p:
        stiffness = p.VERTICAL_STIFFNESS * p.LCZ
    else:
        stiffness = _linear_stiffness(p) * p.FNOMIN / p.UNLOADED_RADIUS * p.LCZ
    return stiffness * (1.0 + p.PFZ1 * _pressure(p, pressure))


def _linear_stiffness(p):
    """Q_FZ1, such that the slope at the nominal load is VERTICAL_STIFFNESS where it is not given."""
    if "Q_FZ1" in p:
        return p.Q_FZ1
    whole = p.VERTICAL_STIFFNESS * p.UNLOADED_RADIUS / p.FNOMIN
    return jnp.sqrt(whole**2 - 4.0 * p.Q_FZ2) if "Q_FZ2" in p else whole


def _pressure(p, pressure):
    return 0.0 if pressure is None or "NOMPRES" not in p else pressure / p.NOMPRES - 1.0


def _factor(p, at, x):
    """Stiffening by speed, softening by the forces at the contact."""
    R0 = p.UNLOADED_RADIUS
    factor = 1.0 + (p.Q_V2 * R0 / p.LONGVL * jnp.abs(at.spin) if "Q_V2" in p else 0.0)
    if "Q_FCX" in p:
        factor = factor - (p.Q_FCX * at.fx / p.FNOMIN) ** 2
    if "Q_FCY" in p:
        side = p.Q_FCY * (at.fy - _camber_force(p, at)) / p.FNOMIN
        weight = jnp.where(x > 0.0, jnp.where(x > 0.0, x, 1.0) ** p.Q_FCY2, 0.0) if "Q_FCY2" in p else 1.0
        factor = factor - (weight * side) ** 2
    return factor


def _camber_force(p, at):
    """Side force that leaves the deflection as it is, of MF 6.2."""
    if not ("Q_FYS1" in p or "Q_FYS2" in p or "Q_FYS3" in p):
        return 0.0
    free = free_radius(p, at.spin)
    ratio = (free - at.deflection) / free
    return (p.Q_FYS1 + p.Q_FYS2 * ratio + p.Q_FYS3 * ratio**2) * jnp.arcsin(at.camber)


def _camber_deflection(p, at, depth):
    """Deflection by camber, of MF 6.2 [m]."""
    free, size = free_radius(p, at.spin), jnp.abs(jnp.arcsin(at.camber))
    loaded = free - at.deflection
    width = (1.075 - 0.5 * p.ASPECT_RATIO) * p.WIDTH
    if "Q_CAM1" in p or "Q_CAM2" in p:
        grown = (p.Q_CAM1 * loaded + p.Q_CAM2 * loaded**2) / (p.Q_CAM1 * free + p.Q_CAM2 * free**2)
    else:
        grown = 0.0
    return grown**2 * width / 8.0 * jnp.tan(size) - p.Q_CAM3 * depth * size
