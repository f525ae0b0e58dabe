"""Decoupling: the remaining structure when a known component is removed from an assembled one."""

from collections.abc import Sequence

import jax

from ..checks import repeated
from ..coupling._regularised_inverse import regularised_inverse
from ..coupling._uncoupled_transfer import check_compatible
from ..errors import ModelError
from ..linear._transfer import TransferFunctions
from ..math import _square as square
from ..typing import ArrayLike

#: A channel of both, or its name in the assembled structure and in the component.
Shared = str | tuple[str, str]


def decouple(
    assembled: TransferFunctions,
    known: TransferFunctions,
    compatibility: Sequence[Shared],
    equilibrium: Sequence[Shared] | None = None,
    rank: int | None = None,
    rcond: ArrayLike = 0.0,
    noise: ArrayLike = 0.0,
    weights: ArrayLike | None = None,
) -> TransferFunctions:
    """Remove the component `known` from `assembled`: it is coupled once more, with the opposite sign.

    `Y - Y E^T (C Y E^T)^+ C Y` with `Y = diag(Y_assembled, -Y_known)`.

    Args:
        compatibility: channels where the motions of both agree: the interface alone (standard), or also points inside
            the known component (extended), which makes the matrix singular by as many: then give `rank`.
        equilibrium: channels where forces remove the component; None for the same channels (collocated).
        rank: number of interface coordinates kept, for an extended interface.
        rcond, noise, weights: of `regularised_inverse`, against noise: truncation of small singular values, Tikhonov
            damping, rows weighted by one over their standard deviation.

    Returns: the assembled structure's channels; those inside the removed component no longer mean anything.

    Raises: ModelError for unknown or repeated channels, and fewer conditions than forces.
    Source: S1 (1)-(2), (41); S. Voormeeren, D. Rixen, Mech. Syst. Signal Process. 27 (2012) 379.
    """
    check_compatible({"assembled": assembled, "known": known})
    motion, force = _split_names(compatibility), _split_names(compatibility if equilibrium is None else equilibrium)
    twice = [c for side in (*motion, *force) for c in repeated(side)]
    if twice:
        raise ModelError([f"channels named twice: {', '.join(dict.fromkeys(twice))}"])
    if len(motion[0]) < len(force[0]):
        raise ModelError(
            [f"compatibility has {len(motion[0])} channels, fewer than the {len(force[0])} of equilibrium"]
        )
    rows, columns = assembled.rows(motion[0]), assembled.columns(force[0])
    known_rows, known_columns = known.rows(motion[1]), known.columns(force[1])
    Y = assembled.values
    difference = Y[:, rows][:, :, columns] - known.values[:, known_rows][:, :, known_columns]
    if rank is None and rcond == 0.0 and weights is None and _is_zero(noise) and len(rows) == len(columns):
        return assembled.with_values(Y - Y[:, :, columns] @ jax.vmap(square.solve)(difference, Y[:, rows]))
    inverse = regularised_inverse(difference, rank, rcond, noise, weights)
    return assembled.with_values(Y - Y[:, :, columns] @ (inverse @ Y[:, rows]))


def _split_names(shared):
    pairs = [(item, item) if isinstance(item, str) else tuple(item) for item in shared]
    return [a for a, _ in pairs], [b for _, b in pairs]


def _is_zero(noise):
    return isinstance(noise, int | float) and noise == 0
