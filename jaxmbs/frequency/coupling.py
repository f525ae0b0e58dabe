"""Coupling by transfer functions: interface forces as multipliers of the compatibility."""

from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex

from ..errors import ModelError
from ..math import square
from .inverse import regular_inverse
from .transfer import TransferFunctions, uncoupled

#: Two channels that move together, or one and None: held.
Pair = tuple[str, str | None]


def signed_interface(names: Sequence[str], pairs: Sequence[Pair]) -> np.ndarray:
    """Signed Boolean matrix (pairs, channels): +1 at the first channel of a pair, -1 at the second one.

    Raises: ModelError with the names that are not there and the pairs of a channel with itself.
    Source: S1 (1).
    """
    faults = [f"there is no channel {n!r}" for pair in pairs for n in pair if n is not None and n not in names]
    faults += [f"channel {a!r} is joined to itself" for a, b in pairs if a == b]
    if faults:
        raise ModelError([f"{fault}; there are {', '.join(names)}" for fault in faults])
    B = np.zeros((len(pairs), len(names)))
    for row, (a, b) in enumerate(pairs):
        B[row, names.index(a)] = 1.0
        if b is not None:
            B[row, names.index(b)] = -1.0
    return B


def couple(
    parts: TransferFunctions | Mapping[str, TransferFunctions],
    pairs: Sequence[Pair],
    compliance=None,
    **regular,
) -> TransferFunctions:
    """Components joined: `Y - Y B^T (B Y B^T + S)^-1 B Y`.

    Args:
        parts: components by name (their channels are then named "component channel"), or what `uncoupled` or an
            earlier coupling gave.
        pairs: channels that move together; both are outputs and inputs.  (name, None) holds a channel.
        compliance: S of elastic bonds, (pairs, pairs) or (frequencies, pairs, pairs): relative motion (displacement,
            velocity, acceleration as the kind says) per force; None is rigid.
        regular: `rank`, `rcond`, `noise`, `weights` of `regular_inverse`, for measured interfaces.

    Source: S1 (1)-(3), (40)-(41); D. de Klerk, D. Rixen, S. Voormeeren, AIAA J. 46 (2008) 1169.
    """
    Y = parts if isinstance(parts, TransferFunctions) else uncoupled(parts)
    Bu, Bf = _interface(Y, pairs)
    return Y.replace(Y.values - (Y.values @ Bf.T) @ _multipliers(Y, Bu, Bf, compliance, regular))


def interface_forces(
    parts: TransferFunctions | Mapping[str, TransferFunctions], pairs: Sequence[Pair], compliance=None, **regular
) -> Complex[Array, "frequencies pairs inputs"]:
    """Forces that the bonds exert on the first channel of each pair, for unit forces at the inputs.

    The second channel gets the opposite.  Arguments as of `couple`.  Source: S1 (2), (25).
    """
    Y = parts if isinstance(parts, TransferFunctions) else uncoupled(parts)
    return -_multipliers(Y, *_interface(Y, pairs), compliance, regular)


def _interface(Y, pairs):
    matrices = (signed_interface(names, pairs) for names in (Y.outputs, Y.inputs))
    return tuple(jnp.asarray(B, Y.values.dtype) for B in matrices)


def _multipliers(Y, Bu, Bf, compliance, regular):
    gap = Bu @ Y.values
    flexibility = gap @ Bf.T
    if compliance is not None:
        S = jnp.asarray(compliance, Y.values.dtype)
        flexibility = flexibility + (S if S.ndim == 3 else S[None])
    if regular:
        return regular_inverse(flexibility, **regular) @ gap
    return jax.vmap(square.solve)(flexibility, gap)
