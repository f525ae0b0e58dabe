"""Is a suspension soft enough to measure a free structure on it?"""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..checks import is_concrete, negative
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..runtime import as_dtype
from ..vibration._modes import natural_modes


class SuspensionCheck(eqx.Module):
    """What `check_suspension` found; `str` of it is a line.

    Attributes:
        frequencies: (rigid,) [Hz] of the structure that moves as a solid on its suspension.
        elastic: () [Hz] the first elastic frequency of the free structure.
        suspended: () [Hz] the same on the suspension.
        ratio: () the highest of `frequencies` over `elastic`.
        limit: of the ratio.
    """

    frequencies: Float[Array, " rigid"]
    elastic: Float[Array, ""]
    suspended: Float[Array, ""]
    ratio: Float[Array, ""]
    limit: float = eqx.field(static=True)

    @property
    def shift(self) -> Float[Array, ""]:
        """() by how much the suspension raises the first elastic frequency, relative: the error it makes there."""
        return self.suspended / self.elastic - 1

    @property
    def ok(self) -> Bool[Array, ""]:
        """Whether the ratio is within its limit."""
        return self.ratio <= self.limit

    def __str__(self):
        verdict = "soft enough" if self.ok else f"too stiff: more than {self.limit:g}"
        return (
            f"the suspension reaches {float(self.ratio):.3g} of the first elastic frequency, "
            f"{float(self.elastic):.4g} Hz, and raises it by {100 * float(self.shift):.2g} %: {verdict}"
        )


def check_suspension(
    free: LinearSystem, supports: Mapping, num_rigid: int = 6, limit: float = 0.1, throw: bool = False
) -> SuspensionCheck:
    """Compare what a free structure does on a suspension with what it would do without.

    Args:
        free: the structure without its suspension.
        supports: stiffness to the ground [N/m, N m/rad] by name of coordinate or node: one number, (k,) for a node's
            k coordinates, or (k, k).
        num_rigid: rigid motions of the free structure, six in space.
        limit: of the highest suspension frequency over the first elastic one.
        throw: raise where the ratio is above, if concrete.

    Raises: UnknownNameError; ValueError for a structure that has no elastic mode, negative stiffness and a limit that
    is none; ModelError where `throw`.
    Source: S1 (41), section 5, Fig. 4.
    """
    free = free.to_dense()
    if not 0 < num_rigid < free.num_rows:
        raise ValueError(f"num_rigid = {num_rigid}: {free.num_rows} coordinates must leave an elastic mode")
    if np.iscomplexobj(limit) or not (np.isfinite(limit) and limit > 0):
        raise ValueError(f"limit = {limit} must be positive and finite")
    K = free.stiffness
    wrong = [name for name, k in supports.items() if np.ndim(k) < 2 and negative(k)]
    if wrong:
        raise ValueError(f"supports with negative stiffness: {', '.join(map(str, wrong))}")
    for name, stiffness in supports.items():
        rows, _ = free.outputs(name)
        k = as_dtype(stiffness, K.dtype)
        K = K + rows.T @ (k @ rows if k.ndim == 2 else jnp.broadcast_to(k, len(rows))[:, None] * rows)
    alone = natural_modes(K=free.stiffness, M=free.mass, num=num_rigid + 1, num_rigid=num_rigid).frequencies
    held = natural_modes(K=K, M=free.mass, num=num_rigid + 1, num_rigid=0).frequencies
    found = SuspensionCheck(held[:num_rigid], alone[-1], held[-1], held[num_rigid - 1] / alone[-1], float(limit))
    if throw and is_concrete(found.ratio) and not np.asarray(found.ok):
        raise ModelError([str(found)])
    return found
