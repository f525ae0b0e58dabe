"""Dynamics of mechanisms: Hamiltonian equations and their fields, accelerations, energies, reactions."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._cable_states import CableResult, cable_states
    from ._contact_load import ContactLoad, contact_load
    from ._element_reports import ElementReports, element_reports
    from ._energy import kinetic_energy, potential_energy
    from ._friction_verdict import FrictionLoads, joint_friction
    from ._newton_euler import forward_dynamics, mass_matrix
    from ._points import acceleration, angular_acceleration
    from ._validity import Validity, validity
    from .paper import (
        compliance_effort,
        generalised_momentum,
        gravity_effort,
        gyristor_field,
        gyristor_field_direct,
        hamiltonian,
        hamiltonian_slopes,
        independent_rates,
        inertia_field,
        resistance_effort,
        resistance_field,
        source_effort,
        spring_displacement,
        spring_kic,
        spring_kic_second,
        spring_vector,
        state_equations,
        total_effort,
    )

__all__ = [
    "CableResult",
    "ContactLoad",
    "ElementReports",
    "FrictionLoads",
    "Validity",
    "acceleration",
    "angular_acceleration",
    "cable_states",
    "compliance_effort",
    "contact_load",
    "element_reports",
    "forward_dynamics",
    "generalised_momentum",
    "gravity_effort",
    "gyristor_field",
    "gyristor_field_direct",
    "hamiltonian",
    "hamiltonian_slopes",
    "independent_rates",
    "inertia_field",
    "joint_friction",
    "kinetic_energy",
    "mass_matrix",
    "potential_energy",
    "resistance_effort",
    "resistance_field",
    "source_effort",
    "spring_displacement",
    "spring_kic",
    "spring_kic_second",
    "spring_vector",
    "state_equations",
    "total_effort",
    "validity",
]

import_when_asked(__name__, explain_arguments)
