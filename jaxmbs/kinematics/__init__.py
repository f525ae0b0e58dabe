"""Kinematics of mechanisms: passes over the tree, configurations, positions and velocities of frames."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._points import angular_velocity, jacobian, position, rotation, velocity

__all__ = [
    "angular_velocity",
    "jacobian",
    "position",
    "rotation",
    "velocity",
]

_MOVED = {  # names that were here, for one release
    "jaxmbs.assembly": "State branch states_along",
    "jaxmbs.constraints": """
        Kic SecondKic constraint_jacobian constraint_residual count_mobility internal_kic internal_kic_second
        internal_kic_second_printed kic kic_rate kic_second kic_second_vector left_product plane_mix point_kic
        quadratic right_product with_mobility_at
    """,
    "jaxmbs.signal_flow": "Instant signals",
}

import_when_asked(
    __name__, explain_arguments, {name: room for room, names in _MOVED.items() for name in names.split()}
)
