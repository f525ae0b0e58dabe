"""Response over frequency."""

from .coupling import couple, interface_forces
from .decoupling import decouple
from .direct import dense_response, direct_response
from .gains import (
    accelerance,
    acceleration_gain,
    gain_from_mobility,
    generalised_stiffness,
    mobility,
    mobility_from_gain,
    superpose,
)
from .inverse import regular_inverse
from .modal import modal_receptance, receptance, transmissibility, viscous_receptance
from .sine_sweep import nonlinearity, sweep_phase, swept_amplitudes, swept_variance
from .test_rig import free_response, measured_stiffness, remove_stiffness
from .transfer import TransferFunctions, uncoupled
from .uncertainty import coherence_variance, mean_of_repeats, noise_variance, noisy, propagate, propagate_scalar
from .virtual_point import flexible_channels, rigid_channels, virtual_point
