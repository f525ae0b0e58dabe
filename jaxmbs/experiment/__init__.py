"""Measured transfer functions: coupling, decoupling, virtual points, test rigs, uncertainty."""

from .coupling import couple as couple
from .coupling import interface_forces as interface_forces
from .decoupling import decouple as decouple
from .inverse import regular_inverse as regular_inverse
from .rig import free_response as free_response
from .rig import measured_stiffness as measured_stiffness
from .rig import remove_stiffness as remove_stiffness
from .sine_sweep import nonlinearity as nonlinearity
from .sine_sweep import sweep_phase as sweep_phase
from .sine_sweep import swept_amplitudes as swept_amplitudes
from .sine_sweep import swept_variance as swept_variance
from .transfer import TransferFunctions as TransferFunctions
from .transfer import uncoupled as uncoupled
from .uncertainty import coherence_variance as coherence_variance
from .uncertainty import mean_of_repeats as mean_of_repeats
from .uncertainty import noise_variance as noise_variance
from .uncertainty import noisy as noisy
from .uncertainty import propagate as propagate
from .uncertainty import propagate_scalar as propagate_scalar
from .virtual_point import VirtualPoint as VirtualPoint
from .virtual_point import flexible_channels as flexible_channels
from .virtual_point import rigid_channels as rigid_channels
from .virtual_point import virtual_point as virtual_point
