"""Measured transfer functions: decoupling, virtual points, test rigs, sine sweeps, uncertainty; model updating."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._decoupling import decouple
    from ._rig import free_response, measured_stiffness, remove_stiffness
    from ._sine_sweep import nonlinearity, sweep_amplitudes, sweep_phase, sweep_variance
    from ._suspension import SuspensionCheck, check_suspension
    from ._uncertainty import (
        add_noise,
        coherence_variance,
        mean_of_repeats,
        noise_variance,
        propagate,
        propagate_scalar,
    )
    from ._update import MeasuredModes, ModelUpdate, update
    from ._virtual_point import VirtualPoint, flexible_channels, rigid_channels, virtual_point

__all__ = [
    "MeasuredModes",
    "ModelUpdate",
    "SuspensionCheck",
    "VirtualPoint",
    "add_noise",
    "check_suspension",
    "coherence_variance",
    "decouple",
    "flexible_channels",
    "free_response",
    "mean_of_repeats",
    "measured_stiffness",
    "noise_variance",
    "nonlinearity",
    "propagate",
    "propagate_scalar",
    "remove_stiffness",
    "rigid_channels",
    "sweep_amplitudes",
    "sweep_phase",
    "sweep_variance",
    "update",
    "virtual_point",
]

import_when_asked(__name__, explain_arguments)
