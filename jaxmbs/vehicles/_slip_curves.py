"""Forces of the Magic Formula along and across the wheel, in pure and in combined slip.

Source: Pacejka (2012), (4.E1)-(4.E67); Pacejka (2002) for MF 5.2; Besselink et al. (2010) for the pressure.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from ._coefficients import Coefficients
from ._convention import Convention
from ._tyre_model import Slip


class Inputs(NamedTuple):
    """Inputs of the formulas: slip numbers of a convention, and changes of load and pressure.

    Attributes: load [N]; kappa; alpha, gamma: numbers of slip and camber; cosine: of the slip angle; dfz, dpi:
    relative changes of load and pressure; direction: of rolling; rolling: 1, fading where the wheel stands; grip:
    factor of friction by the sliding speed; speed [m/s].
    """

    load: Any
    kappa: Any
    alpha: Any
    gamma: Any
    cosine: Any
    dfz: Any
    dpi: Any
    direction: Any
    rolling: Any
    grip: Any
    speed: Any


class PureForce(NamedTuple):
    """A curve at a slip: force [N], slip stiffness [N], friction, shifts of slip and force [N], and B C."""

    force: Any
    stiffness: Any
    friction: Any
    slip_shift: Any
    shift: Any
    slope: Any


class LateralForce(NamedTuple):
    """Lateral force in combined slip, its part by the slip along the wheel, and the weight of the pure force [N]."""

    force: Any
    induced: Any
    weight: Any


def inputs_of(p: Coefficients, convention: Convention, slip: Slip) -> Inputs:
    """Inputs of the formulas at a slip."""
    rated = p.LFZO * p.FNOMIN
    tangent, camber = slip.tangent, slip.camber
    alpha = jnp.arctan(tangent) if convention.slip == "angle" else tangent
    gamma = jnp.arcsin(camber) if convention.camber == "angle" else camber
    cosine = jnp.cos(alpha) if convention.cosine == "slip" else 1.0 / jnp.sqrt(1.0 + tangent * tangent)
    dpi = 0.0
    if slip.pressure is not None and "NOMPRES" in p:
        dpi = slip.pressure / p.NOMPRES - 1.0
    grip = 1.0
    if "LMUV" in p:
        sliding = jnp.abs(slip.speed) * jnp.sqrt(slip.kappa**2 + tangent**2 + 1e-12)
        grip = 1.0 / (1.0 + p.LMUV * sliding / p.LONGVL)
    rolling = slip.direction * slip.direction
    return Inputs(
        slip.load,
        slip.kappa,
        alpha,
        gamma,
        cosine,
        (slip.load - rated) / rated,
        dpi,
        slip.direction,
        rolling,
        grip,
        slip.speed,
    )


class Slope(NamedTuple):
    """Slip stiffness [N] and friction of a direction."""

    stiffness: Any
    friction: Any


def slope_along(p: Coefficients, at: Inputs) -> Slope:
    """Slip stiffness and friction along the wheel.  Source: Pacejka (2012) (4.E13), (4.E15)."""
    dfz, dpi = at.dfz, at.dpi
    friction = (p.PDX1 + p.PDX2 * dfz) * (1.0 + p.PPX3 * dpi + p.PPX4 * dpi**2) * p.LMUX * at.grip
    pressed = 1.0 + p.PPX1 * dpi + p.PPX2 * dpi**2
    K = at.load * (p.PKX1 + p.PKX2 * dfz) * jnp.exp(p.PKX3 * dfz) * pressed * p.LKX
    return Slope(K, friction * (1.0 - p.PDX3 * (at.gamma * p.LGAX) ** 2))


def slope_across(p: Coefficients, convention: Convention, at: Inputs) -> Slope:
    """Slip stiffness and friction across the wheel.  Source: Pacejka (2012) (4.E23), (4.E25)."""
    dfz, dpi, rated, gamma = at.dfz, at.dpi, p.LFZO * p.FNOMIN, at.gamma * p.LGAY
    leaning = 1.0 + convention.grip_camber_sign * p.PDY3 * gamma**2
    friction = (p.PDY1 + p.PDY2 * dfz) * (1.0 + p.PPY3 * dpi + p.PPY4 * dpi**2) * leaning * p.LMUY * at.grip
    softened = (p.PKY2 + p.PKY5 * gamma**2) * (1.0 + p.PPY2 * dpi)
    rise = jnp.sin(p.PKY4 * jnp.arctan(at.load / (rated * softened)))
    return Slope(p.PKY1 * rated * (1.0 + p.PPY1 * dpi) * (1.0 - p.PKY3 * jnp.abs(gamma)) * rise * p.LKY, friction)


def longitudinal(p: Coefficients, convention: Convention, at: Inputs) -> PureForce:
    """Force along the wheel without side slip.  Source: Pacejka (2012) (4.E9)-(4.E18)."""
    dfz = at.dfz
    K, friction = slope_along(p, at)
    C, D = p.PCX1 * p.LCX, friction * at.load
    slip_shift = (p.PHX1 + p.PHX2 * dfz) * p.LHX * at.rolling
    shift = at.load * (p.PVX1 + p.PVX2 * dfz) * p.LVX * p.LMUX * at.rolling
    x = at.kappa + slip_shift
    E = (p.PEX1 + p.PEX2 * dfz + p.PEX3 * dfz**2) * (1.0 - p.PEX4 * _sign(x)) * p.LEX
    B = K / (C * D + convention.slope_offset)
    force = D * jnp.sin(C * _bend(B * x, E, convention)) + shift
    return PureForce(force, K, friction, slip_shift, shift, B * C)


def lateral(p: Coefficients, convention: Convention, at: Inputs, is_old: bool) -> PureForce:
    """Force across the wheel without slip along it.  Source: Pacejka (2012) (4.E19)-(4.E30)."""
    dfz, gamma = at.dfz, at.gamma * p.LGAY
    K, friction = slope_across(p, convention, at)
    C, D = p.PCY1 * p.LCY, friction * at.load
    by_camber = at.load * (p.PVY3 + p.PVY4 * dfz) * gamma * p.LKYC * p.LMUY
    if is_old:
        leaned = p.PHY3 * gamma * p.LKYC
    else:
        camber_stiffness = at.load * (p.PKY6 + p.PKY7 * dfz) * (1.0 + p.PPY5 * at.dpi) * p.LKYC
        leaned = (camber_stiffness * gamma - by_camber) / K
    slip_shift = ((p.PHY1 + p.PHY2 * dfz) * p.LHY + leaned) * at.rolling
    shift = (at.load * (p.PVY1 + p.PVY2 * dfz) * p.LVY * p.LMUY + by_camber) * at.rolling
    x = at.alpha + slip_shift
    E = (p.PEY1 + p.PEY2 * dfz) * (1.0 + p.PEY5 * gamma**2 - (p.PEY3 + p.PEY4 * gamma) * _sign(x)) * p.LEY
    B = K / (C * D + convention.slope_offset)
    force = D * jnp.sin(C * _bend(B * x, E, convention)) + shift
    return PureForce(force, K, friction, slip_shift, shift, B * C)


def combined_longitudinal(p: Coefficients, at: Inputs, pure: PureForce) -> Any:
    """Force along the wheel with side slip.  Source: Pacejka (2012) (4.E50)-(4.E57)."""
    B = (p.RBX1 + p.RBX3 * at.gamma**2) * jnp.cos(jnp.arctan(p.RBX2 * at.kappa)) * p.LXAL
    return pure.force * _weight(B, p.RCX1, p.REX1 + p.REX2 * at.dfz, at.alpha, p.RHX1)


def combined_lateral(p: Coefficients, at: Inputs, pure: PureForce) -> LateralForce:
    """Force across the wheel with slip along it.  Source: Pacejka (2012) (4.E58)-(4.E67)."""
    B = (p.RBY1 + p.RBY4 * at.gamma**2) * jnp.cos(jnp.arctan(p.RBY2 * (at.alpha - p.RBY3))) * p.LYKA
    weight = _weight(B, p.RCY1, p.REY1 + p.REY2 * at.dfz, at.kappa, p.RHY1 + p.RHY2 * at.dfz)
    size = pure.friction * at.load * (p.RVY1 + p.RVY2 * at.dfz + p.RVY3 * at.gamma)
    fading = jnp.cos(jnp.arctan(p.RVY4 * at.alpha)) * p.LVYKA * at.rolling
    induced = size * fading * jnp.sin(p.RVY5 * jnp.arctan(p.RVY6 * at.kappa))
    return LateralForce(weight * pure.force + induced, induced, weight)


def cosine_curve(B: Any, C: Any, E: Any, x: Any) -> Any:
    """`cos(C atan(B x - E (B x - atan(B x))))`, E at most 1."""
    return jnp.cos(C * _bend(B * x, E))


def _weight(B, C, E, x, shift):
    """Weight of combined slip, one at x = 0."""
    return cosine_curve(B, C, E, x + shift) / cosine_curve(B, C, E, shift)


def _bend(x, E, convention=None):
    limit = None if convention is None else convention.slope_limit
    x = x if limit is None else jnp.clip(x, -limit, limit)
    E = jnp.minimum(E, 1.0)
    return jnp.arctan(x - E * (x - jnp.arctan(x)))


def _sign(x):
    return jnp.where(x < 0.0, -1.0, 1.0)
