"""Moments of the Magic Formula: aligning, overturning and of rolling resistance.

Source: Pacejka (2012), (4.E31)-(4.E49), (4.E68)-(4.E78); Besselink et al. (2010); Pacejka (2002) for MF 5.2.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ._coefficients import Coefficients
from ._convention import Convention
from ._slip_curves import Inputs, LateralForce, PureForce, cosine_curve


class Forces(NamedTuple):
    """Forces in combined slip, and the pure ones that they were made of."""

    fx: Any
    fy: LateralForce
    along: PureForce
    across: PureForce
    upright: PureForce


class TrailCurve(NamedTuple):
    """Coefficients B, C, D, E of the trail, and its shift of slip."""

    B: Any
    C: Any
    D: Any
    E: Any
    shift: Any

    def at(self, x: Any, cosine: Any) -> Any:
        """Trail [m]."""
        return self.D * cosine_curve(self.B, self.C, self.E, x) * cosine


def aligning(p: Coefficients, convention: Convention, at: Inputs, forces: Forces) -> Any:
    """Aligning moment [N m] in combined slip.  Source: Pacejka (2012) (4.E71)-(4.E78)."""
    curve, across = trail_curve(p, convention, at), forces.across
    ratio = forces.along.stiffness / across.stiffness * at.kappa
    trail = curve.at(_equivalent(at.alpha + curve.shift, ratio, convention), at.cosine)
    residual = _residual(p, at, across, lambda x: _equivalent(x, ratio, convention))
    upright = forces.fy.weight * forces.upright.force
    at_trail = upright if convention.trail_force == "upright" else forces.fy.force - forces.fy.induced
    camber_arm = (p.SSZ3 + p.SSZ4 * at.dfz) * at.gamma
    arm = p.UNLOADED_RADIUS * (p.SSZ1 + p.SSZ2 * forces.fy.force / p.FNOMIN + camber_arm) * p.LS
    return -trail * at_trail + residual + arm * forces.fx


def pure_aligning(p: Coefficients, convention: Convention, at: Inputs, across: PureForce, upright: PureForce) -> Any:
    """Aligning moment [N m] in pure side slip.  Source: Pacejka (2012) (4.E31)-(4.E49)."""
    curve = trail_curve(p, convention, at)
    force = upright.force if convention.trail_force == "upright" else across.force
    trail = curve.at(at.alpha + curve.shift, at.cosine)
    return -trail * force + _residual(p, at, across, lambda x: x)


def trail_curve(p: Coefficients, convention: Convention, at: Inputs) -> TrailCurve:
    """The curve of the trail.  Source: Pacejka (2012) (4.E33)-(4.E35), (4.E40)-(4.E44)."""
    dfz, gamma = at.dfz, at.gamma * p.LGAZ
    size = jnp.abs(gamma)
    shift = (p.QHZ1 + p.QHZ2 * dfz + (p.QHZ3 + p.QHZ4 * dfz) * gamma) * at.rolling
    B = (p.QBZ1 + p.QBZ2 * dfz + p.QBZ3 * dfz**2) * p.LKY / (p.LMUY * at.grip)
    B = B * (1.0 + p.QBZ4 * gamma + p.QBZ5 * size + p.QBZ6 * gamma**2)
    leaning = p.QDZ3 * (size if convention.trail_camber == "size" else gamma) + p.QDZ4 * gamma**2
    D = at.load * (p.QDZ1 + p.QDZ2 * dfz) * (1.0 - p.PPZ1 * at.dpi) * (1.0 + leaning) * p.LTR * at.direction
    D = D * p.UNLOADED_RADIUS / (p.LFZO * p.FNOMIN)
    turn = 2.0 / np.pi * jnp.arctan(B * p.QCZ1 * (at.alpha + shift))
    E = (p.QEZ1 + p.QEZ2 * dfz + p.QEZ3 * dfz**2) * (1.0 + (p.QEZ4 + p.QEZ5 * gamma) * turn)
    return TrailCurve(B, p.QCZ1, D, E, shift)


def overturning(p: Coefficients, at: Inputs, fy: Any, is_old: bool) -> Any:
    """Overturning moment [N m].  Source: Pacejka (2012) (4.E69)."""
    gamma, side, load = at.gamma, fy / p.FNOMIN, at.load / p.FNOMIN
    first = p.QSX1 * p.LVMX
    rest = -p.QSX2 * gamma * (1.0 + p.PPMX1 * at.dpi) + p.QSX3 * side
    if is_old:
        return p.UNLOADED_RADIUS * at.load * (first + rest * p.LMX)
    turning = jnp.sin(p.QSX7 * gamma + p.QSX8 * jnp.arctan(p.QSX9 * side))
    rest = rest + p.QSX4 * jnp.cos(p.QSX5 * jnp.arctan((p.QSX6 * load) ** 2)) * turning
    rest = rest + (p.QSX10 * jnp.arctan(p.QSX11 * load) - p.QSX12 * jnp.abs(gamma)) * gamma
    by_side = fy * (p.QSX13 + p.QSX14 * jnp.abs(gamma))
    return p.UNLOADED_RADIUS * p.LMX * (at.load * (first + rest) + by_side)


def rolling_resistance(p: Coefficients, at: Inputs, fx: Any) -> Any:
    """Moment of rolling resistance [N m], against the rolling.  Source: Besselink et al. (2010) (A48)."""
    speed, load = jnp.abs(at.speed) / p.LONGVL, at.load / p.FNOMIN
    factor = p.QSY1 + p.QSY2 * fx / p.FNOMIN + p.QSY3 * speed + p.QSY4 * speed**4
    factor = factor + (p.QSY5 + p.QSY6 * load) * at.gamma**2
    return (
        -at.direction
        * p.UNLOADED_RADIUS
        * p.FNOMIN
        * p.LMY
        * factor
        * _power(load, p.QSY7)
        * _power(1.0 + at.dpi, p.QSY8)
    )


def _power(x, exponent):
    return 1.0 if isinstance(exponent, float) and exponent == 0.0 else x**exponent


def _residual(p, at, across, equivalent):
    """Residual moment.  Source: Pacejka (2012) (4.E36)-(4.E38), (4.E45)-(4.E47)."""
    dfz, gamma = at.dfz, at.gamma * p.LGAZ
    B = p.QBZ9 * p.LKY / (p.LMUY * at.grip) + p.QBZ10 * across.slope
    straight = (p.QDZ6 + p.QDZ7 * dfz) * p.LRES
    leaned = (p.QDZ8 + p.QDZ9 * dfz) * (1.0 + p.PPZ2 * at.dpi) + (p.QDZ10 + p.QDZ11 * dfz) * jnp.abs(gamma)
    D = at.load * p.UNLOADED_RADIUS * (straight + leaned * gamma * p.LKZC) * p.LMUY * at.grip
    x = at.alpha + across.slip_shift + across.shift / across.stiffness
    return D * jnp.cos(jnp.arctan(B * equivalent(x))) * at.direction * at.cosine


def _equivalent(x, ratio, convention):
    """Slip of the same size in combined slip, with the sign of x.  Source: Pacejka (2012) (4.E77)-(4.E78)."""
    is_tangent = convention.equivalent_slip == "tangent"
    x2 = (jnp.tan(x) if is_tangent else x) ** 2 + ratio**2
    positive = x2 > 0.0
    size = jnp.where(positive, jnp.sqrt(jnp.where(positive, x2, 1.0)), 0.0)
    size = jnp.where(x < 0.0, -size, size)
    return jnp.arctan(size) if is_tangent else size
