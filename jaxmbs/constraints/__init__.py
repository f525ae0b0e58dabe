"""Constraints of mechanisms: rows of loops, drives and couplers, their rank, the mobility and the influence
coefficients that they leave."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ..math._tensor import left_product, plane_mix, quadratic, right_product
    from ._constraint_rows import constraint_jacobian, constraint_residual
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

__all__ = [
    "Kic",
    "SecondKic",
    "constraint_jacobian",
    "constraint_residual",
    "count_mobility",
    "internal_kic",
    "internal_kic_second",
    "internal_kic_second_printed",
    "kic",
    "kic_rate",
    "kic_second",
    "kic_second_vector",
    "left_product",
    "plane_mix",
    "point_kic",
    "quadratic",
    "right_product",
    "with_mobility_at",
]

import_when_asked(__name__, explain_arguments)
