"""Component mode synthesis: reductions of components to interface and modal coordinates, and the expansion back."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._accuracy import force_errors, frequency_errors, num_modes_below
    from ._base import AbstractReduction, Reduced, Unreduced, reduce
    from ._characteristic import Characteristic, characteristic_modes
    from ._craig_bampton import CraigBampton, fixed_interface_modes
    from ._craig_chang import CraigChang
    from ._cyclic import Cyclic
    from ._guyan import Guyan
    from ._hurty import Hurty, determinate_coordinates, support_motions
    from ._macneal import MacNeal
    from ._mirror import Mirror
    from ._mixed import Mixed
    from ._placement import rotate
    from ._recovery import (
        element_loads,
        harmonic_amplitudes,
        interface_forces,
        mode_acceleration,
        mode_acceleration_free,
    )
    from ._rigid_interface import (
        averaged_motion,
        averaged_transformation,
        rigid_body_motions,
        rigid_node,
        rigid_transformation,
        transform_interface,
    )
    from ._rubin import Rubin
    from ._symmetry_subspace import SymmetrySubspace
    from ._virtual_work import VirtualMotions, virtual_work

__all__ = [
    "AbstractReduction",
    "Characteristic",
    "CraigBampton",
    "CraigChang",
    "Cyclic",
    "Guyan",
    "Hurty",
    "MacNeal",
    "Mirror",
    "Mixed",
    "Reduced",
    "Rubin",
    "SymmetrySubspace",
    "Unreduced",
    "VirtualMotions",
    "averaged_motion",
    "averaged_transformation",
    "characteristic_modes",
    "determinate_coordinates",
    "element_loads",
    "fixed_interface_modes",
    "force_errors",
    "frequency_errors",
    "harmonic_amplitudes",
    "interface_forces",
    "mode_acceleration",
    "mode_acceleration_free",
    "num_modes_below",
    "reduce",
    "rigid_body_motions",
    "rigid_node",
    "rigid_transformation",
    "rotate",
    "support_motions",
    "transform_interface",
    "virtual_work",
]

import_when_asked(__name__, explain_arguments)
