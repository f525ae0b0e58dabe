"""Block-diagonal transfer functions of several components before they are coupled."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..errors import ModelError
from ..linear._transfer import TransferFunctions


def uncoupled_transfer(parts: Mapping[str, TransferFunctions]) -> TransferFunctions:
    """Combine uncoupled components to block-diagonal transfer functions; channels are named "component channel".

    Raises: ModelError where numbers of frequencies or kinds differ.  Source: S1 (3), (40).
    """
    return block_diagonal(parts, " ")


def block_diagonal(parts: Mapping[str, TransferFunctions], mark: str) -> TransferFunctions:
    """Combine as `uncoupled_transfer`, with a given mark between the names of component and channel."""
    check_compatible(parts)
    first = next(iter(parts.values()))
    heights, widths = ([len(getattr(p, side)) for p in parts.values()] for side in ("outputs", "inputs"))
    values = jnp.zeros((len(first.omega), sum(heights), sum(widths)), first.values.dtype)
    row = column = 0
    for part, height, width in zip(parts.values(), heights, widths, strict=True):
        values = values.at[:, row : row + height, column : column + width].set(part.values)
        row, column = row + height, column + width
    outputs, inputs = (
        [f"{n}{mark}{c}" for n, p in parts.items() for c in getattr(p, side)] for side in ("outputs", "inputs")
    )
    return TransferFunctions(first.omega, values, outputs, inputs, first.kind)


def check_compatible(parts: Mapping[str, TransferFunctions]) -> None:
    """Refuse components at different frequencies or of different kinds.  Raises: ModelError."""
    if not parts:
        raise ModelError(["no component is given"])
    faults = []
    (name, first), *others = parts.items()
    for other, part in others:
        if part.kind != first.kind:
            faults.append(f"{other!r} is a {part.kind}, {name!r} a {first.kind}")
        if part.values.dtype != first.values.dtype:
            faults.append(f"{other!r} is {part.values.dtype}, {name!r} {first.values.dtype}")
        if len(part.omega) != len(first.omega):
            faults.append(f"{other!r} has {len(part.omega)} frequencies, {name!r} {len(first.omega)}")
        elif _frequencies_differ(part.omega, first.omega):
            faults.append(f"{other!r} and {name!r} are at different frequencies")
    if faults:
        raise ModelError(faults)


def _frequencies_differ(a, b):
    """True if concrete frequencies differ; traced ones are not compared."""
    if not is_concrete(a, b):
        return False
    return bool(np.any(np.abs(np.asarray(a) - np.asarray(b)) > 1e-6 * np.max(np.abs(a), initial=0.0)))
