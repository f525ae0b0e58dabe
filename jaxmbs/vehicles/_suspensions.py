"""Kinds of suspensions by their hardpoints, for one wheel; axes x forwards, y outwards, z up."""

from collections.abc import Mapping
from typing import Any

from ..typing import ScalarLike
from ._suspension import Arm, Strut, Suspension, SuspensionRod

_TIE = SuspensionRod("tie_rod", "TI", "TO")


def double_wishbone(
    hardpoints: Mapping[str, Any], radius: ScalarLike, arms: bool = True, strut_on: str = "lower"
) -> Suspension:
    """A double wishbone.

    Args:
        hardpoints: [m]: lower arm LF, LR on the chassis (front, rear), LO its ball on the upright; upper arm UF, UR,
            UO; tie rod TI (rack), TO; axle AI, AO (wheel centre); strut S (top) and D (foot).
        radius: of the wheel under load [m].
        arms: rigid arms, whose pick-ups share the force along their line by least compliance; False: two rods each,
            and the strut's foot at LO.
        strut_on: "lower" or "upper" arm that carries the strut's foot, or "upright".
    """
    if not arms:
        links = {"lower_front": "LF LO", "lower_rear": "LR LO", "upper_front": "UF UO", "upper_rear": "UR UO"}
        rods = [SuspensionRod(name, *points.split()) for name, points in links.items()]
        points = {name: x for name, x in hardpoints.items() if name != "D"}
        return Suspension(points, radius, Strut("S", "LO"), (*rods, _TIE), rack=("TI",))
    parts = Arm("lower", ("LF", "LR"), "LO"), Arm("upper", ("UF", "UR"), "UO")
    return Suspension(hardpoints, radius, Strut("S", "D", strut_on), (_TIE,), parts, rack=("TI",))


def mcpherson(hardpoints: Mapping[str, Any], radius: ScalarLike) -> Suspension:
    """A McPherson strut: the upright slides along the strut, whose top turns in the chassis.

    Args:
        hardpoints: [m]: lower arm LF, LR, LO as of a double wishbone; tie rod TI, TO; axle AI, AO; strut S (top) and
            D, a point of its axis on the upright.
        radius: of the wheel under load [m].
    """
    rods = SuspensionRod("lower_front", "LF", "LO"), SuspensionRod("lower_rear", "LR", "LO"), _TIE
    strut = Strut("S", "D", "upright", guides=True)
    return Suspension(hardpoints, radius, strut, rods, kingpin=("LO", "S"), rack=("TI",))


def five_link(hardpoints: Mapping[str, Any], radius: ScalarLike) -> Suspension:
    """Five rods between chassis and upright.

    Args:
        hardpoints: [m]: of rod k from 1 to 5 I1 ... I5 on the chassis, O1 ... O5 on the upright; the fifth is the tie
            rod, whose I5 moves with the rack; axle AI, AO; strut S (top) and D (foot, on the upright).
        radius: of the wheel under load [m].
    """
    rods = tuple(SuspensionRod(f"link_{k}", f"I{k}", f"O{k}") for k in range(1, 6))
    return Suspension(hardpoints, radius, Strut("S", "D"), rods, kingpin=None, rack=("I5",))


def trailing_arm(hardpoints: Mapping[str, Any], radius: ScalarLike) -> Suspension:
    """A trailing or semi-trailing arm, which turns about a line on the chassis; it does not steer.

    Args:
        hardpoints: [m]: the line through P and Q; axle AI, AO; strut S (top) and D (foot).
        radius: of the wheel under load [m].
    """
    return Suspension(hardpoints, radius, Strut("S", "D"), hinge=("P", "Q"), kingpin=None)
