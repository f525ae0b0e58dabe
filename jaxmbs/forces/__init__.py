"""Force laws: one law per file, each a port from motion to effort."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._actuator import PD, Actuator
    from ._air_spring import AirSpring
    from ._applied import Force, Torque, Wrench
    from ._base import (
        AbstractBodyLaw,
        AbstractLaw,
        AbstractPathLaw,
        AbstractPoseLaw,
        AbstractScalarLaw,
        AbstractSystemLaw,
        PathKinematics,
    )
    from ._beam_element import BeamElement
    from ._beam_section import BeamSection
    from ._bevel_gear import BevelGear
    from ._bump_stop import BumpStop
    from ._bushing import Bushing
    from ._cable import Cable
    from ._cable_elements import Attachment, Eyelet, Sheave, Winch, WrapCylinder, WrapSphere
    from ._elasto_plastic import ElastoPlastic
    from ._element_bonds import ElementBond
    from ._friction_force import FrictionForce
    from ._gear_pair import GearPair
    from ._generalised import GeneralisedEffort
    from ._hydraulic_cylinder import HydraulicCylinder
    from ._inextensible_cable import InextensibleCable
    from ._internal_state import InternalState
    from ._maxwell import Maxwell
    from ._motor import Motor
    from ._old_friction import (
        AbstractJointFriction,
        BearingFriction,
        BristleForce,
        BrownMcPhee,
        CoulombFriction,
        JointLuGre,
        LuGre,
        SmoothCoulomb,
    )
    from ._path_force import PathForce
    from ._polynomial_spring import PolynomialSpring
    from ._profiles import CamRise, Chirp, Multisine, Trapezoid
    from ._prony import Prony, PronyBushing
    from ._readings import Arrows, PointLoads, Reading
    from ._signals import AbstractSignal, Constant, Harmonic, Polynomial, Ramp, Spline, Step
    from ._spring_damper import SpringDamper
    from ._table import Table
    from ._validity import Margin
    from ._worm_gear import WormGear
    from ._zener import Zener

__all__ = [
    "AbstractBodyLaw",
    "AbstractLaw",
    "AbstractPathLaw",
    "AbstractPoseLaw",
    "AbstractScalarLaw",
    "AbstractSignal",
    "AbstractSystemLaw",
    "AbstractJointFriction",
    "Actuator",
    "AirSpring",
    "Arrows",
    "Attachment",
    "BeamElement",
    "BeamSection",
    "BearingFriction",
    "BevelGear",
    "BristleForce",
    "BrownMcPhee",
    "BumpStop",
    "Bushing",
    "Cable",
    "CamRise",
    "Chirp",
    "Constant",
    "CoulombFriction",
    "ElastoPlastic",
    "ElementBond",
    "Eyelet",
    "Force",
    "FrictionForce",
    "GearPair",
    "GeneralisedEffort",
    "Harmonic",
    "HydraulicCylinder",
    "InextensibleCable",
    "InternalState",
    "JointLuGre",
    "LuGre",
    "Margin",
    "Maxwell",
    "Motor",
    "Multisine",
    "PD",
    "PathForce",
    "PathKinematics",
    "PointLoads",
    "Polynomial",
    "PolynomialSpring",
    "Prony",
    "PronyBushing",
    "Ramp",
    "Reading",
    "Sheave",
    "SmoothCoulomb",
    "Spline",
    "SpringDamper",
    "Step",
    "Table",
    "Torque",
    "Trapezoid",
    "Winch",
    "WormGear",
    "WrapCylinder",
    "WrapSphere",
    "Wrench",
    "Zener",
]

import_when_asked(__name__, explain_arguments)
