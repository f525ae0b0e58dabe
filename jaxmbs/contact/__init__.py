"""Contact: pairs of surfaces between two frames, the force that holds them apart and the friction between them."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._closed_curve import ClosedCurve
    from ._contact import Contact
    from ._cylinders import CylinderOnPlane, JournalInBush
    from ._height_field import HeightField
    from ._hunt_crossley import HuntCrossley, hertz_stiffness
    from ._old_friction import BristleContact, ContactLuGre, DryFriction
    from ._pair import AbstractPair, Touch
    from ._roller_on_curve import RollerOnCurve
    from ._spheres import SphereInCylinder, SphereOnPlane, SphereOnSphere
    from ._wheel_on_road import WheelOnRoad

__all__ = [
    "AbstractPair",
    "BristleContact",
    "ClosedCurve",
    "Contact",
    "ContactLuGre",
    "CylinderOnPlane",
    "DryFriction",
    "HeightField",
    "HuntCrossley",
    "JournalInBush",
    "RollerOnCurve",
    "SphereInCylinder",
    "SphereOnPlane",
    "SphereOnSphere",
    "Touch",
    "WheelOnRoad",
    "hertz_stiffness",
]

import_when_asked(__name__, explain_arguments)
