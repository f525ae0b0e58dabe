"""Questions to linear systems: modes, frequency response, rest."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix, factor
from ..errors import ModelError
from ..linear._labels import format_label
from ..linear._massless import condense_massless
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..typing import ArrayLike, CoordinateLike
from ._damping import complex_modes
from ._direct_response import dense_response, direct_response
from ._lanczos import lowest_modes
from ._modes import Modes, natural_modes
from ._receptance import receptance


def modes(system: LinearSystem, num: int | None = None, damped: bool | None = None) -> Modes:
    """The lowest modes of a linear system: natural ones, or complex ones where it is damped.

    Args:
        num: how many, of complex ones how many pairs; default all.  It should cut no group of equal frequencies.
        damped: False: natural modes, whatever the damping; default: complex modes of a system that has damping.

    Rows without mass, known to be `massless` or of zeros, are condensed first, which is exact: there are as many
    modes as rows with mass.  Block matrices must be held, and need `num`.

    Raises: as `natural_modes` and `complex_modes`; ValueError for what block matrices cannot answer.
    Source: S1 (33)-(37), (39).
    """
    damped = system.damping is not None if damped is None else damped
    if num is not None and not 0 <= num <= system.num_rows:
        raise ValueError(f"num = {num}: there are {system.num_rows} modes")
    names = tuple(map(format_label, system.coordinates))
    if isinstance(system.stiffness, BlockMatrix):
        if damped or num is None:
            raise ValueError("block matrices have natural modes, as many as asked: modes(system, num, damped=False)")
        found = lowest_modes(factor(system.stiffness), system.mass, num)
        return dataclasses.replace(found, coordinates=names)
    whole = condense_massless(system.to_dense(), damped=damped)
    K, M, C = whole.system.stiffness, whole.system.mass, whole.system.damping
    if damped and C is not None:
        found = complex_modes(K=K, C=C, M=M).select(slice(0, None if num is None else 2 * num))
    else:
        found = natural_modes(K=K, M=M, num=num)
    if whole.light:
        left = None if found.left is None else whole.expand(found.left)
        found = dataclasses.replace(found, shapes=whole.expand(found.shapes.T).T, left=left)
    return dataclasses.replace(found, coordinates=names)


def frequency_response(
    system: LinearSystem,
    omega: ArrayLike,
    into: Iterable[CoordinateLike],
    out: Iterable[CoordinateLike],
    method: str = "direct",
    loss: ArrayLike = 0.0,
    **options: Any,
) -> TransferFunctions:
    """Displacements at names for unit forces at names: transfer functions with these labels.

    Args:
        omega: (frequencies,) angular frequencies [rad/s].
        into, out: as `LinearSystem.outputs` takes them: "tip z", ("tip", "z"), or a node for all of its coordinates,
            those that were reduced included; "stage.top z" of a network.
        method: "direct" (a solve per frequency, any damping) or "modal" (`receptance`, much cheaper at many
            frequencies; damping that does not couple the modes; rows without mass are condensed and put back).
        loss: loss factor of the whole stiffness.
        options: `chunk`, and `num`, `residual` of the modal method.

    Raises: UnknownNameError for coordinates that are not there; ModelError for an unknown method.
    Source: S1 (40)-(41).
    """
    if method not in ("direct", "modal"):
        raise ModelError([f"method {method!r} is neither direct nor modal"])
    (out, outputs), (into, inputs) = system.outputs(*out), system.outputs(*into)
    if isinstance(system.stiffness, BlockMatrix):
        return TransferFunctions(
            omega, _block_frequency_response(system, omega, into, out, loss, options), outputs, inputs
        )
    system = system.to_dense()
    matrices = {"K": system.stiffness, "M": system.mass, "C": system.damping, "loss": loss, "omega": omega}
    if method == "modal":
        values = _modal_frequency_response(system, matrices, out, into.T, options)
    else:
        values = dense_response(**matrices, out=out, load=into.T, **options)
    return TransferFunctions(omega, values, outputs, inputs)


def _modal_frequency_response(system, matrices, out, load, options):
    """Receptances by the modes of the rows with mass, and what the loads of the others do there directly."""
    whole = condense_massless(system)
    if whole.basis is None or whole.stiffness is None:
        return receptance(**matrices, out=out, into=load, **options)
    own, T, light = whole.system, whole.basis, np.array(whole.light)
    on_heavy = matrices | {"K": own.stiffness, "M": own.mass, "C": own.damping}
    values = receptance(**on_heavy, out=out @ T.astype(out.dtype), into=T.T.astype(load.dtype) @ load, **options)
    at, on = out[:, light], load[light]
    if options.get("num") is not None and not options.get("residual", True):
        return values  # they follow statically: as the modes that are left out
    zero = {"M": jnp.zeros_like(whole.stiffness), "K": whole.stiffness}
    C = None if system.damping is None else system.damping[light][:, light]
    return values + dense_response(**matrices | zero | {"C": C}, out=at, load=on)


def _block_frequency_response(system, omega, into, out, loss, options):
    K, loss = system.stiffness, jnp.asarray(loss, system.dtype)
    complex_type = np.result_type(system.dtype, np.complex64)
    K = K.astype(complex_type) * lax.complex(jnp.ones_like(loss), loss)
    load = into.T.reshape(*K.pattern.shape, -1)
    rows = out.astype(complex_type)

    def select(x):
        return rows @ x.reshape(rows.shape[1], -1)

    return direct_response(K=K, M=system.mass, C=system.damping, load=load, omega=omega, select=select, **options)
