"""Kinematics of mechanisms: states, constraints, influence coefficients and products with them, points."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ..math._tensor import left_product, plane_mix, quadratic, right_product
    from ._constraint_rows import constraint_jacobian, constraint_residual
    from ._instant import Instant
    from ._kic import Kic, internal_kic, kic
    from ._kic_second import (
        SecondKic,
        internal_kic_second,
        internal_kic_second_printed,
        kic_rate,
        kic_second,
        kic_second_vector,
        point_kic,
    )
    from ._mobility import count_mobility, with_mobility_at
    from ._points import angular_velocity, jacobian, position, rotation, velocity
    from ._signal_names import signals
    from ._state import State
    from ._state_sweep import branch, states_along

__all__ = [
    "Instant",
    "Kic",
    "SecondKic",
    "State",
    "angular_velocity",
    "branch",
    "constraint_jacobian",
    "constraint_residual",
    "count_mobility",
    "internal_kic",
    "internal_kic_second",
    "internal_kic_second_printed",
    "jacobian",
    "kic",
    "kic_rate",
    "kic_second",
    "kic_second_vector",
    "left_product",
    "plane_mix",
    "point_kic",
    "position",
    "quadratic",
    "right_product",
    "rotation",
    "signals",
    "states_along",
    "velocity",
    "with_mobility_at",
]

import_when_asked(__name__, explain_arguments)
