"""Components in few coordinates: reductions to their interfaces, and the way back."""

from .accuracy import force_errors, frequency_errors, num_modes_up_to
from .base import AbstractReduction, Physical, Reduced, reduce
from .characteristic import Characteristic, characteristic_modes
from .craig_bampton import CraigBampton, fixed_interface_modes
from .craig_chang import CraigChang
from .cyclic import Cyclic
from .family import Family
from .guyan import Guyan
from .hurty import Hurty, determinate_coordinates, support_motions
from .macneal import MacNeal
from .mirror import Mirror
from .mixed import Mixed
from .placement import turned
from .recovery import element_loads, harmonic, interface_forces, mode_acceleration, mode_acceleration_free
from .rigid_interface import (
    averaged_motion,
    averaged_transformation,
    on_interface,
    rigid_body_motions,
    rigid_node,
    rigid_transformation,
)
from .rubin import Rubin
from .work import Motions, virtual_work

__all__ = [
    "AbstractReduction",
    "Characteristic",
    "CraigBampton",
    "CraigChang",
    "Cyclic",
    "Family",
    "Guyan",
    "Hurty",
    "MacNeal",
    "Mirror",
    "Mixed",
    "Motions",
    "Physical",
    "Reduced",
    "Rubin",
    "averaged_motion",
    "averaged_transformation",
    "characteristic_modes",
    "determinate_coordinates",
    "element_loads",
    "fixed_interface_modes",
    "force_errors",
    "frequency_errors",
    "harmonic",
    "interface_forces",
    "mode_acceleration",
    "mode_acceleration_free",
    "num_modes_up_to",
    "on_interface",
    "reduce",
    "rigid_body_motions",
    "rigid_node",
    "rigid_transformation",
    "support_motions",
    "turned",
    "virtual_work",
]
