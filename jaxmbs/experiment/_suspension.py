"""Check of the suspension of a structure that is measured as free."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..checks import is_concrete, negative
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..quantities import Quantity, numbered
from ..reports import Report, Reported
from ..runtime import as_dtype
from ..vibration._modes import natural_modes


class SuspensionCheck(Reported, eqx.Module):
    """Result of `check_suspension`; `str` of it is a sentence.

    Attributes:
        frequencies: (rigid,) [Hz] of the rigid-body modes on the suspension.
        elastic: () [Hz], first elastic frequency of the free structure.
        suspended: () [Hz], first elastic frequency on the suspension.
        ratio: (), the highest of `frequencies` over `elastic`.
        limit: the largest acceptable ratio.
    """

    frequencies: Float[Array, " rigid"]
    elastic: Float[Array, ""]
    suspended: Float[Array, ""]
    ratio: Float[Array, ""]
    limit: float = eqx.field(static=True)

    def report(self) -> Report:
        fault = "" if self.ok else "the suspension is too stiff"
        return Report(
            [
                Quantity(
                    "frequency on the suspension", self.frequencies, "Hz", (numbered("mode", len(self.frequencies)),)
                ),
                Quantity("first elastic frequency", self.elastic, "Hz"),
                Quantity("on the suspension", self.suspended, "Hz"),
                Quantity("shift of it", self.shift),
                Quantity("ratio", self.ratio),
                Quantity("largest ratio", self.limit),
            ],
            fault=fault,
        )

    @property
    def shift(self) -> Float[Array, ""]:
        """Relative error () of the first elastic frequency by the suspension."""
        return self.suspended / self.elastic - 1

    @property
    def ok(self) -> Bool[Array, ""]:
        """True if the ratio is within its limit."""
        return self.ratio <= self.limit

    def __str__(self):
        verdict = "soft enough" if self.ok else f"too stiff: more than {self.limit:g}"
        return (
            f"the highest frequency on the suspension is {float(self.ratio):.3g} of the first elastic frequency, "
            f"{float(self.elastic):.4g} Hz, which the suspension raises by {100 * float(self.shift):.2g} %: {verdict}"
        )


def check_suspension(
    free: LinearSystem, supports: Mapping, num_rigid: int = 6, limit: float = 0.1, throw: bool = False
) -> SuspensionCheck:
    """Compare the frequencies of a structure on a suspension with those of the free structure.

    Args:
        free: the structure without its suspension.
        supports: stiffness to the ground [N/m, N m/rad] by name of coordinate or node: one number, (k,) for a node's
            k coordinates, or (k, k).
        num_rigid: rigid motions of the free structure, six in space.
        limit: of the highest suspension frequency over the first elastic one.
        throw: raise an error if the ratio exceeds the limit, if concrete.

    Raises: UnknownNameError; ValueError for a structure without elastic mode, negative stiffness and an invalid
    limit; ModelError where `throw` is set and the suspension is too stiff.
    Source: S1 (41), section 5, Fig. 4.
    """
    free = free.to_dense()
    if not 0 < num_rigid < free.num_rows:
        raise ValueError(
            f"num_rigid = {num_rigid} must be less than the {free.num_rows} coordinates, "
            "so that there is an elastic mode"
        )
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
