"""Vehicles: tyres, roads, ride, suspensions and cars."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._axle_tyres import AxleTyres
    from ._car import CarAxle, CruiseControl, car
    from ._convention import CONVENTIONS, Convention
    from ._driveline import BrakeTorque, mount_differential, mount_steering
    from ._four_post import FourPost, four_post, post_heights
    from ._handling import (
        BrakeInTurn,
        SteerGain,
        StepResponse,
        brake_in_turn,
        sine_steer_response,
        slopes_over,
        step_steer_response,
    )
    from ._hardpoint_outputs import linearise_hardpoints
    from ._lane_change import Lane, LaneChange, ObstacleAvoidance, PathFollower
    from ._load_cases import LoadTable, load_cases
    from ._magic_formula import MagicFormula
    from ._mount_axle import mount_anti_roll_bar, mount_solid_axle, mount_twist_beam
    from ._mount_suspension import mount_suspension, mount_wheel
    from ._parts import MountedParts, hardpoint_loads
    from ._plain_tyres import BrushTyre, FialaTyre, LinearTyre
    from ._random_road import RandomRoad
    from ._ride import Ride, ride, wheel_inputs
    from ._rig import Compliance, PartLoads, Rig, kc_rig
    from ._rig_curves import RigCurves
    from ._road import AbstractRoad, FlatRoad
    from ._road_mix import RoadMixDamage, RoadRecord, RoadShare, road_mix_damage, road_records_damage
    from ._road_shapes import CleatRoad, SineRoad, SurfaceRoad, TandemCams
    from ._roll_curves import RollCurves, roll_curves
    from ._single_track import ForwardSpeed, SingleTrack
    from ._steady_turn import SteadyTurn
    from ._suspension import Arm, Strut, Suspension, SuspensionRod
    from ._suspensions import double_wishbone, five_link, mcpherson, trailing_arm
    from ._tir import TirFile, read_tir
    from ._tyre import Tyre
    from ._tyre_model import AbstractTyreModel, Compression, ContactForces, Slip, SlipSlopes
    from ._weighting import WEIGHTINGS, WeightingFilter, weighting

__all__ = [
    "AbstractRoad",
    "AbstractTyreModel",
    "Arm",
    "AxleTyres",
    "BrakeInTurn",
    "BrakeTorque",
    "BrushTyre",
    "CONVENTIONS",
    "CarAxle",
    "CleatRoad",
    "Compliance",
    "Compression",
    "ContactForces",
    "Convention",
    "CruiseControl",
    "FialaTyre",
    "FlatRoad",
    "ForwardSpeed",
    "FourPost",
    "Lane",
    "LaneChange",
    "LinearTyre",
    "LoadTable",
    "MagicFormula",
    "MountedParts",
    "ObstacleAvoidance",
    "PartLoads",
    "PathFollower",
    "RandomRoad",
    "Ride",
    "Rig",
    "RigCurves",
    "RoadMixDamage",
    "RoadRecord",
    "RoadShare",
    "RollCurves",
    "SineRoad",
    "SingleTrack",
    "Slip",
    "SlipSlopes",
    "SteadyTurn",
    "SteerGain",
    "StepResponse",
    "Strut",
    "SurfaceRoad",
    "Suspension",
    "SuspensionRod",
    "TandemCams",
    "TirFile",
    "Tyre",
    "WEIGHTINGS",
    "WeightingFilter",
    "brake_in_turn",
    "car",
    "double_wishbone",
    "five_link",
    "four_post",
    "hardpoint_loads",
    "kc_rig",
    "linearise_hardpoints",
    "load_cases",
    "mcpherson",
    "mount_anti_roll_bar",
    "mount_differential",
    "mount_solid_axle",
    "mount_steering",
    "mount_suspension",
    "mount_twist_beam",
    "mount_wheel",
    "post_heights",
    "read_tir",
    "ride",
    "road_mix_damage",
    "road_records_damage",
    "roll_curves",
    "sine_steer_response",
    "slopes_over",
    "step_steer_response",
    "trailing_arm",
    "weighting",
    "wheel_inputs",
]

import_when_asked(__name__, explain_arguments)
