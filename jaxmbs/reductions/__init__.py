"""Components in few coordinates: reductions to their interfaces, and the way back."""

from .accuracy import force_errors, frequency_errors, num_modes_up_to
from .base import Reduced, physical, reduce
from .characteristic import characteristic, characteristic_modes
from .craig_bampton import craig_bampton, fixed_interface_modes
from .craig_bampton_blocks import large_craig_bampton
from .craig_bampton_scipy import craig_bampton_sparse
from .craig_chang import craig_chang
from .guyan import guyan
from .hurty import determinate_coordinates, hurty, support_motions
from .macneal import macneal
from .mixed import mixed
from .recovery import (
    element_loads,
    harmonic,
    interface_forces,
    mode_acceleration,
    mode_acceleration_free,
    mode_displacement,
)
from .rigid_interface import (
    averaged_motion,
    averaged_transformation,
    on_interface,
    rigid_body_motions,
    rigid_node,
    rigid_transformation,
)
from .rubin import rubin

__all__ = [
    "Reduced",
    "averaged_motion",
    "averaged_transformation",
    "characteristic",
    "characteristic_modes",
    "craig_bampton",
    "craig_bampton_sparse",
    "craig_chang",
    "determinate_coordinates",
    "element_loads",
    "fixed_interface_modes",
    "force_errors",
    "frequency_errors",
    "guyan",
    "harmonic",
    "hurty",
    "interface_forces",
    "large_craig_bampton",
    "macneal",
    "mixed",
    "mode_acceleration",
    "mode_acceleration_free",
    "mode_displacement",
    "num_modes_up_to",
    "on_interface",
    "physical",
    "reduce",
    "rigid_body_motions",
    "rigid_node",
    "rigid_transformation",
    "rubin",
    "support_motions",
]
