"""Vibration of linear systems: modes, damping, receptances, response in frequency and time."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._base_excitation import ResonanceGains, resonance_gains
    from ._damping import (
        complex_modes,
        damped_frequency,
        is_coupling_modes,
        modal_damping,
        rayleigh_damping,
        rayleigh_from_ratios,
        structural_damping,
    )
    from ._direct_response import dense_response, direct_response
    from ._gains import (
        accelerance,
        acceleration_gain,
        gain_from_mobility,
        generalised_stiffness,
        mobility,
        mobility_from_gain,
        superpose,
    )
    from ._harmonic_response import HarmonicResponse, harmonic_response
    from ._lanczos import lowest_modes
    from ._linear_motion import CoordinateLaw, LinearMotion, LinearState, ModalSuperposition
    from ._modal_equations import ModalMotion, base_load, modal_motion, oscillations
    from ._modal_response import modal_response
    from ._mode_shapes import effective_masses, mac, mode_ratios, participation, track_modes
    from ._modes import Modes, natural_modes
    from ._receptance import modal_receptance, receptance, transmissibility, viscous_receptance
    from ._system_analysis import frequency_response, modes
    from ._transfer_matrix import modal_transfer_matrix, transfer_matrix
    from ._transient import simulate

__all__ = [
    "CoordinateLaw",
    "HarmonicResponse",
    "LinearMotion",
    "LinearState",
    "ModalMotion",
    "ModalSuperposition",
    "Modes",
    "ResonanceGains",
    "accelerance",
    "acceleration_gain",
    "base_load",
    "complex_modes",
    "damped_frequency",
    "dense_response",
    "direct_response",
    "effective_masses",
    "frequency_response",
    "gain_from_mobility",
    "generalised_stiffness",
    "harmonic_response",
    "is_coupling_modes",
    "lowest_modes",
    "mac",
    "mobility",
    "mobility_from_gain",
    "modal_damping",
    "modal_motion",
    "modal_receptance",
    "modal_response",
    "modal_transfer_matrix",
    "mode_ratios",
    "modes",
    "natural_modes",
    "oscillations",
    "participation",
    "rayleigh_damping",
    "rayleigh_from_ratios",
    "receptance",
    "resonance_gains",
    "simulate",
    "structural_damping",
    "superpose",
    "track_modes",
    "transfer_matrix",
    "transmissibility",
    "viscous_receptance",
]

import_when_asked(__name__, explain_arguments)
