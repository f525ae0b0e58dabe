"""The fields of the bond graph paper in independent coordinates: inertia, gyristor, ports, springs."""

from typing import TYPE_CHECKING

from ...arguments import explain_arguments
from ...lazy import import_when_asked

if TYPE_CHECKING:
    from ._fields import (
        generalised_momentum,
        gyristor_field,
        gyristor_field_direct,
        independent_rates,
        inertia_field,
        state_equations,
    )
    from ._phase_space import hamiltonian, hamiltonian_slopes
    from ._ports import (
        compliance_effort,
        gravity_effort,
        resistance_effort,
        resistance_field,
        source_effort,
        total_effort,
    )
    from ._springs import spring_displacement, spring_kic, spring_kic_second, spring_vector

__all__ = [
    "compliance_effort",
    "generalised_momentum",
    "gravity_effort",
    "gyristor_field",
    "gyristor_field_direct",
    "hamiltonian",
    "hamiltonian_slopes",
    "independent_rates",
    "inertia_field",
    "resistance_effort",
    "resistance_field",
    "source_effort",
    "spring_displacement",
    "spring_kic",
    "spring_kic_second",
    "spring_vector",
    "state_equations",
    "total_effort",
]

import_when_asked(__name__, explain_arguments)
