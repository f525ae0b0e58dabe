"""Conventions: where programs that evaluate the Magic Formula differ."""

from typing import NamedTuple

from ..checks import no_such


class Convention(NamedTuple):
    """Choices that the published equations leave open, or that a program makes its own way.

    Attributes:
        slip: what the formulas take as the slip angle, its "tangent" or the "angle" itself [rad].
        camber: the "sine" of the inclination angle or the "angle" itself.
        cosine: the trail's `cos(alpha)` is of the "angle", or of what the formulas take as "slip".
        trail_camber: in the peak of the trail QDZ3 multiplies the "size" of the camber, or is "signed".
        equivalent_slip: of the combined moment, from slips as they are ("plain") or from their "tangent".
        trail_force: force at the trail: the side force at zero camber ("upright"), or "less shift" the side force
            without the part that slip along the wheel induces.
        relaxation_sign: of PTX3 in its exponential.
        slope_offset: added to `C D` below the stiffness in `B` [N].
        slope_limit: size at which `B x` ends; none for infinity.
        grip_camber_sign: of PDY3.
    """

    slip: str = "tangent"
    camber: str = "sine"
    cosine: str = "angle"
    trail_camber: str = "size"
    equivalent_slip: str = "plain"
    trail_force: str = "upright"
    relaxation_sign: float = -1.0
    slope_offset: float = 0.0
    slope_limit: float | None = None
    grip_camber_sign: float = -1.0


_OLD = Convention(cosine="slip", trail_camber="signed", trail_force="less shift")  # of MF 5.2
_ANGLES = Convention("angle", "angle", "angle", "signed", "tangent", "upright")
#: By name and kind of file: of PAC2002 (MF 5.2), of MF 6.1 and 6.2.
CONVENTIONS = {
    "pacejka": (_OLD, Convention()),
    "opentire": (_OLD._replace(equivalent_slip="tangent"), None),
    "mfeval": (_ANGLES._replace(trail_force="less shift"), _ANGLES),
    "chrono": (
        _OLD._replace(
            slip="angle",
            camber="angle",
            equivalent_slip="tangent",
            relaxation_sign=1.0,
            slope_offset=0.1,
            slope_limit=1.5607963267948966,  # pi / 2 - 0.01
            grip_camber_sign=1.0,
        ),
        None,
    ),
}


def convention_of(name: str, fit: str) -> Convention:
    """The convention of a program by name, for a kind of formula.  Raises: ValueError."""
    if name not in CONVENTIONS:
        raise ValueError(no_such("convention", name, CONVENTIONS))
    found = CONVENTIONS[name][fit != "5.2"]
    if found is None:
        known = [other for other, pair in CONVENTIONS.items() if pair[1] is not None]
        raise ValueError(f"{name!r} evaluates no MF {fit}: choose from {known}")
    return found
