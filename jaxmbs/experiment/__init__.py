"""Measured transfer functions: coupling, decoupling, virtual points, test rigs, uncertainty."""

from ..coupling._transfer_functions import couple, interface_forces
from ..coupling._uncoupled_transfer import uncoupled
from ..linear._transfer import TransferFunctions
from ..math._regularised_inverse import regular_inverse
from ._decoupling import decouple
from ._rig import free_response, measured_stiffness, remove_stiffness
from ._sine_sweep import nonlinearity, sweep_phase, swept_amplitudes, swept_variance
from ._suspension import Suspension, check_suspension
from ._uncertainty import coherence_variance, mean_of_repeats, noise_variance, noisy, propagate, propagate_scalar
from ._virtual import VirtualPoint, flexible_channels, rigid_channels, virtual_point

__all__ = [
    "Suspension",
    "TransferFunctions",
    "VirtualPoint",
    "check_suspension",
    "coherence_variance",
    "couple",
    "decouple",
    "flexible_channels",
    "free_response",
    "interface_forces",
    "mean_of_repeats",
    "measured_stiffness",
    "noise_variance",
    "noisy",
    "nonlinearity",
    "propagate",
    "propagate_scalar",
    "regular_inverse",
    "remove_stiffness",
    "rigid_channels",
    "sweep_phase",
    "swept_amplitudes",
    "swept_variance",
    "uncoupled",
    "virtual_point",
]
