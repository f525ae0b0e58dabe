"""Elastic bodies in mechanisms: substructures in a floating frame, and the recovery of their loads."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ..model._elastic import ElasticBody, GeometricStiffening
    from ._carried_loads import carried_loads, mass_properties
    from ._floating_frame import FloatingFrame, floating_frame
    from ._recovery import deformations, displacements, interface_loads
    from ._section_forces import section_forces
    from ._section_stresses import section_stresses
    from ._stiffening import stiffening
    from ._stresses import StressEnvelope, Stresses, stresses

__all__ = [
    "ElasticBody",
    "FloatingFrame",
    "GeometricStiffening",
    "StressEnvelope",
    "Stresses",
    "carried_loads",
    "deformations",
    "displacements",
    "floating_frame",
    "interface_loads",
    "mass_properties",
    "section_forces",
    "section_stresses",
    "stiffening",
    "stresses",
]

import_when_asked(__name__, explain_arguments)
