"""Dynamics of mechanisms: Hamiltonian equations and their fields, accelerations, energies, reactions."""

from .actuation import Actuation, inverse_dynamics
from .energy import kinetic_energy, potential_energy
from .fields import (
    generalised_momentum,
    gyristor_field,
    gyristor_field_direct,
    independent_rates,
    inertia_field,
    state_equations,
)
from .joint_reactions import DriveLoad, JointReaction, LawForce, Reactions, RowLoad
from .newton_euler import forward_dynamics, mass_matrix
from .phase_space import hamiltonian, hamiltonian_slopes
from .points import acceleration, angular_acceleration
from .ports import compliance_effort, gravity_effort, resistance_effort, resistance_field, source_effort, total_effort
from .reaction_solve import reactions
from .springs import spring_displacement, spring_kic, spring_kic_second, spring_vector
from .system_bonds import reaction_bonds

__all__ = [
    "Actuation",
    "DriveLoad",
    "JointReaction",
    "LawForce",
    "Reactions",
    "RowLoad",
    "acceleration",
    "angular_acceleration",
    "compliance_effort",
    "forward_dynamics",
    "generalised_momentum",
    "gravity_effort",
    "gyristor_field",
    "gyristor_field_direct",
    "hamiltonian",
    "hamiltonian_slopes",
    "independent_rates",
    "inertia_field",
    "inverse_dynamics",
    "kinetic_energy",
    "mass_matrix",
    "potential_energy",
    "reaction_bonds",
    "reactions",
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
