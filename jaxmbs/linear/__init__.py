"""Linear systems of matrices: modes, damping, response in frequency and time, statics, checks."""

from .base_driven import ResonanceGains, resonance_gains
from .block_modes import lowest_modes
from .condensation import constraint_modes, interface_basis, partition
from .damping import (
    complex_modes,
    coupled,
    damped_frequency,
    modal,
    proportional,
    proportional_from_ratios,
    structural,
)
from .dynamic_stiffness import dense_response, direct_response
from .eigenmodes import Modes, natural_modes
from .from_scipy import block_matrices
from .gains import (
    accelerance,
    acceleration_gain,
    gain_from_mobility,
    generalised_stiffness,
    mobility,
    mobility_from_gain,
    superpose,
)
from .harmonic import HarmonicResponse, harmonic_response
from .integrate import simulate
from .laplace import modal_transfer_matrix, transfer_matrix
from .mode_shapes import effective_masses, mac, mode_ratios, participation, track
from .motion import LinearMotion, Link, Modal
from .oscillators import ModalMotion, base_load, modal_motion, oscillations
from .questions import equilibrium, frequency_response, modes
from .receptances import modal_receptance, receptance, transmissibility, viscous_receptance
from .report import Check
from .response_in_modes import modal_response
from .rest import StaticResponse, static_response
from .rigid import rigid_motions
from .soundness import check
from .system import LinearSystem
from .transfer import TransferFunctions

__all__ = [
    "Check",
    "HarmonicResponse",
    "LinearMotion",
    "LinearSystem",
    "Link",
    "Modal",
    "ModalMotion",
    "Modes",
    "ResonanceGains",
    "StaticResponse",
    "TransferFunctions",
    "accelerance",
    "acceleration_gain",
    "base_load",
    "block_matrices",
    "check",
    "complex_modes",
    "constraint_modes",
    "coupled",
    "damped_frequency",
    "dense_response",
    "direct_response",
    "effective_masses",
    "equilibrium",
    "frequency_response",
    "gain_from_mobility",
    "generalised_stiffness",
    "harmonic_response",
    "interface_basis",
    "lowest_modes",
    "mac",
    "mobility",
    "mobility_from_gain",
    "modal",
    "modal_motion",
    "modal_receptance",
    "modal_response",
    "modal_transfer_matrix",
    "mode_ratios",
    "modes",
    "natural_modes",
    "oscillations",
    "participation",
    "partition",
    "proportional",
    "proportional_from_ratios",
    "receptance",
    "resonance_gains",
    "rigid_motions",
    "simulate",
    "static_response",
    "structural",
    "superpose",
    "track",
    "transfer_matrix",
    "transmissibility",
    "viscous_receptance",
]
