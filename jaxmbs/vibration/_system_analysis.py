"""Modes and frequency response of a `LinearSystem`, by coordinate names."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix
from ..checks import as_flag, distinct_names, require_numbers
from ..errors import ModelError
from ..linear._block_rows import from_blocks, to_blocks
from ..linear._labels import format_label
from ..linear._massless import condense_massless
from ..linear._storage import dtype_of
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..runtime import jit
from ..typing import ArrayLike, CoordinateLike
from ._damping import complex_modes
from ._direct_response import dense_response, direct_response
from ._lanczos import block_modes, has_range
from ._modes import Modes, natural_modes
from ._receptance import receptance


def modes(system: LinearSystem, num: int | None = None, damped: bool | None = None) -> Modes:
    """Lowest modes of a linear system: natural ones, or complex ones if it is damped.

    Args:
        num: number of modes, or of conjugate pairs of complex ones; default all.  It should not cut a group of equal
            frequencies.
        damped: False for natural modes whatever the damping; by default complex modes of a system with damping.

    Motions without mass are condensed first, which is exact: rows declared `massless` or zero, and turns about a mass
    beside its node.  There are as many modes as the rank of the mass matrix.  Of block matrices the lowest natural
    modes are found by `lowest_modes`, of free systems too; for complex modes, all modes, or nearly all, a network
    becomes dense.

    Raises: as `natural_modes` and `complex_modes`; ValueError for such modes of other block matrices.
    Source: S1 (33)-(37), (39).
    """
    damped = system.damping is not None if damped is None else as_flag("damped", damped)
    if num is not None and not 0 <= num <= system.num_rows:
        raise ValueError(f"num = {num}: there are {system.num_rows} modes")
    names = tuple(map(format_label, system.coordinates))
    if isinstance(system.stiffness, BlockMatrix) and not _becomes_dense(system, num, damped):
        assert num is not None
        found = block_modes(system.stiffness, system.mass, num)
        shapes = found.shapes.reshape(*system.stiffness.pattern.shape, -1)
        return dataclasses.replace(found, shapes=from_blocks(shapes, system.block_rows), coordinates=names)
    whole = condense_massless(system.to_dense(), damped=damped)
    K, M, C = whole.system.stiffness, whole.system.mass, whole.system.damping
    if num is not None and num > len(whole.heavy):
        raise ValueError(f"num = {num}: there are {len(whole.heavy)} modes, as many as the rank of the mass matrix")
    if damped and C is not None:
        found = complex_modes(K=K, C=C, M=M, diagonal=whole.diagonal).select(
            slice(0, None if num is None else 2 * num)
        )
    else:
        found = natural_modes(K=K, M=M, num=num, diagonal=whole.diagonal)
    if whole.light:
        left = None if found.left is None else whole.expand(found.left)
        found = dataclasses.replace(found, shapes=whole.expand(found.shapes.T).T, left=left)
    return dataclasses.replace(found, coordinates=names)


def _becomes_dense(system, num, damped):
    """True if these modes of a system in blocks are found from dense matrices.

    Raises: ValueError where blocks are padded by rows of the system, so that dense matrices would be singular.
    """
    few = num is not None and not damped and has_range(system.mass, num)
    if not few and system.block_rows is None:
        if num is None or damped:
            raise ValueError(
                "of block matrices only a given number of natural modes is found: modes(system, num, damped=False)"
            )
        return False
    return not few


def frequency_response(
    system: LinearSystem,
    omega: ArrayLike,
    into: Iterable[CoordinateLike],
    out: Iterable[CoordinateLike],
    method: str = "direct",
    loss: ArrayLike = 0.0,
    **options: Any,
) -> TransferFunctions:
    """Receptances: displacements at named outputs for unit forces at named inputs.

    Args:
        omega: (frequencies,) angular frequencies [rad/s].
        into, out: inputs and outputs as in `LinearSystem.outputs`: "tip z", ("tip", "z"), or a node for all of its
            coordinates, also reduced ones; "stage.top z" of a network.
        method: "direct" (one solution per frequency, any damping) or "modal" (`receptance`, much cheaper at many
            frequencies; for damping that does not couple the modes; rows without mass are condensed).  Block matrices
            are always solved directly.
        loss: loss factor of the whole stiffness.
        options: `chunk`, and `num`, `residual` of the modal method.

    Raises: UnknownNameError for unknown coordinates; ModelError for an unknown method.
    Source: S1 (40)-(41).
    """
    if method not in ("direct", "modal"):
        raise ModelError([f"unknown method {method!r}: the methods are 'direct' and 'modal'"])
    require_numbers(omega=omega, loss=loss)
    out, into = distinct_names("out", out), distinct_names("into", into)
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
    """Receptances by the modes of the rows with mass, plus the static response of motions without mass."""
    whole = condense_massless(system)
    if whole.basis is None or whole.stiffness is None:
        return receptance(**matrices, out=out, into=load, **options)
    own, T = whole.system, whole.basis
    on_heavy = matrices | {"K": own.stiffness, "M": own.mass, "C": own.damping}
    values = receptance(**on_heavy, out=out @ T.astype(out.dtype), into=T.T.astype(load.dtype) @ load, **options)
    at, on = whole.light_load(out), whole.light_load(load.T).T
    if options.get("num") is not None and not options.get("residual", True):
        return values  # they follow statically: as the modes that are left out
    zero = {"M": jnp.zeros_like(whole.stiffness), "K": whole.stiffness}
    C = None if system.damping is None else whole.in_light(system.damping)
    return values + dense_response(**matrices | zero | {"C": C}, out=at, load=on)


def _block_frequency_response(system, omega, into, out, loss, options):
    options = {name: value for name, value in options.items() if name not in ("num", "residual")}
    matrices = system.stiffness, system.damping, system.mass
    omega, loss = (jnp.asarray(value, system.dtype) for value in (omega, loss))
    return _block_receptances(*matrices, system.block_rows, omega, into, out, loss, options)


@jit
def _block_receptances(K, C, M, rows, omega, into, out, loss, options):
    complex_type = np.result_type(dtype_of(K), np.complex64)
    K = K.astype(complex_type) * lax.complex(jnp.ones_like(loss), loss)
    load, out = to_blocks(into.T, K.pattern, rows), out.astype(complex_type)
    select = lambda x: out @ from_blocks(x, rows)
    return direct_response(K=K, M=M, C=C, load=load, omega=omega, select=select, **options)
