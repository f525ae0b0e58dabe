"""Reduced components of one shape for the block-sparse coupling of `interface.couple`."""

from collections.abc import Sequence

import jax.numpy as jnp

from ..linear.system import LinearSystem
from ..reductions.base import explicit
from .blocks import Components
from .dual import impedance


def stacked(
    components: Sequence[LinearSystem], nodes: Sequence[Sequence[int]], forces: Sequence, omega=None
) -> Components:
    """Components whose interfaces are whole nodes, as one group for `interface.couple`: many at the cost of few.

    Args:
        nodes: interface node of each place (components, k), -1 held; a component's interface coordinates are those of
            its places in turn.
        forces: on each component's own coordinates (n_c,), None for none.
        omega: angular frequency [rad/s]; None for statics.

    Source: S1 (1)-(3), (19), (41).
    """
    parts = [explicit(c) for c in components]
    if len({(c.num_interface, c.num_rows) for c in parts}) > 1:
        raise ValueError("components of one group have the same numbers of interface and inner coordinates")
    matrices = jnp.stack([impedance(c, omega) for c in parts])
    zero = jnp.zeros(matrices.shape[1], matrices.dtype)
    pairs = zip(parts, forces, strict=True)
    loads = [zero if f is None else (c.basis.T.astype(f.dtype) @ f).astype(matrices.dtype) for c, f in pairs]
    return Components(tuple(tuple(int(n) for n in row) for row in nodes), matrices, jnp.stack(loads))
