"""Modes of a linear system with its base held, and rows of outputs in them."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix
from ..checks import is_concrete, may_be_nonzero
from ..errors import ModelError, warn
from ..linear._condensation import partition
from ..linear._massless import condense_massless
from ..linear._symmetric import check_mass, require_symmetric
from ..linear._system import LinearSystem
from ..math._eigen import eigh, spectral
from ..typing import ArrayLike
from ..vibration._damping import is_coupling_modes, modal_damping, modal_lag
from ._excitation import excitation_of, input_faults, loads_of
from ._inputs import BaseAcceleration, RandomForce
from ._modal_transfer import ModalModel
from ._outputs import Output, Terms, output_rows


def modal_model(
    system: LinearSystem,
    inputs: Mapping[str, BaseAcceleration | RandomForce],
    outputs: Mapping[str, Output],
    ratios: ArrayLike | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
) -> ModalModel:
    """Transfer functions of a linear system in its modes, those with the base fixed.

    Args: as of `random_response`.

    Raises: ModelError with every fault.
    """
    faults = input_faults(system, inputs, ratios, loss)
    if faults:
        raise ModelError(faults, "the question")
    system = system.to_dense() if isinstance(system.stiffness, BlockMatrix) else system
    excitation = excitation_of(system, inputs)
    inner, outer = partition(system.num_rows, excitation.base)
    names = [system.coordinates[k] for k in inner]
    place = {int(k): i for i, k in enumerate(inner)}
    cut = lambda A: None if A is None else A[np.ix_(inner, inner)]
    own = LinearSystem(
        mass=cut(system.mass),
        stiffness=cut(system.stiffness),
        damping=cut(system.damping),
        coordinates=names,
        massless=[place[k] for k in system.massless if k in place],
    )
    whole = condense_massless(own)
    first, second = loads_of(system, excitation, inner)
    K, M = require_symmetric(stiffness=whole.system.stiffness, mass=whole.system.mass)
    check_mass(M)
    C = whole.system.damping if ratios is None else modal_damping(K=K, M=M, ratios=ratios)
    matrices, X, coupled = _modal_matrices(K, M, C, num, ratios is not None)
    _warn_of_free_motions(matrices, excitation)
    expand = lambda x: _embed(whole.expand(x.T), inner, system.num_rows)
    whole_load = lambda P: whole.load(P.T).T
    light = _embed(whole.expand(jnp.zeros((first.shape[1], len(K)), K.dtype), first.T), inner, system.num_rows)
    lag = None if ratios is None else expand(modal_lag(K=K, M=M, ratios=ratios, velocity=X.T).T)
    is_lossy = may_be_nonzero(loss)  # of the number as given: an array made while tracing is not known
    loss = jnp.asarray(loss, K.dtype)
    rows, labels, units = _rows(system, outputs, excitation, expand(X), light, lag, loss if is_lossy else None)
    return ModalModel(
        **matrices,
        loss=loss,
        loads=(X.T @ whole_load(first), None if second is None else X.T @ whole_load(second)),
        **rows,
        names=labels,
        units=units,
        inputs=tuple(inputs),
        is_coupled=coupled,
        num=len(K) if num is None else num,
    )


def _warn_of_free_motions(matrices, excitation):
    """Warn of a structure that a moving ground does not hold in some direction: bolts may have been forgotten."""
    K, M = matrices["stiffness"], matrices["mass"]
    if excitation.base or not is_concrete((K, M, excitation.ground)) or not np.any(excitation.ground):
        return
    stiffness, mass = np.diag(np.asarray(K)), np.diag(np.asarray(M))
    squares = np.abs(stiffness / np.where(mass > 0, mass, 1.0))
    free = int(np.sum((squares <= 1e-9 * np.max(squares)) & (mass > 0)))
    if free:
        warn(f"the moving ground does not hold {free} motions of the structure: mbs.check has more of them")


def _embed(x, inner, n):
    """Columns (n, k) of rows (k, inner); zero on the base."""
    return jnp.zeros((n, len(x)), x.dtype).at[inner].set(x.T)


def _modal_matrices(K, M, C, num, is_modal):
    """Matrices in the modes, the modes (n, n), and whether damping couples them."""
    values, X = lax.stop_gradient(eigh(K, M))
    if num is not None:
        if not 0 < num <= len(K):
            raise ModelError([f"num = {num}: there are {len(K)} modes"], "the question")
        flags = (jnp.arange(len(K)) < num).astype(K.dtype)
        P = spectral(_projector, K, M, flags) @ M
        M, C = (None if A is None else P.T @ A @ P for A in (M, C))
    K, M, C = (None if A is None else X.T @ A @ X for A in (K, M, C))
    coupled = C is not None and not is_modal
    if coupled and is_concrete(C):
        coupled = bool(is_coupling_modes(C))
    return {"stiffness": K, "mass": M, "damping": C}, X, coupled


def _projector(values, flag):
    return flag * jnp.ones_like(values)


def _rows(system, outputs, excitation, shapes, light, lag, loss):
    """Rows of outputs by modes, static parts and inputs, from their values for unit motions of each."""
    sets = [shapes.T, light.T, excitation.carried.T]
    sizes = [len(part) for part in sets]
    count, n, i = 3 * sum(sizes) + sizes[-1], system.num_rows, sizes[-1]
    zero = jnp.zeros((count, n), shapes.dtype)
    still = jnp.zeros((count, 3), shapes.dtype)
    at = np.cumsum([0, *np.repeat(sizes, 3), i])
    relative, carried, ground = [], [], []
    for power in range(3):
        x = zero.at[at[power] : at[power + 1]].set(sets[0]).at[at[3 + power] : at[4 + power]].set(sets[1])
        relative.append(x)
        carried.append(zero.at[at[6 + power] : at[7 + power]].set(sets[2]))
        ground.append(still.at[at[6 + power] : at[7 + power]].set(excitation.ground.T))
    forces = zero.at[at[9] :].set(excitation.forces.T)
    moved = tuple(relative), tuple(carried), tuple(ground)
    terms = Terms(*moved, excitation.elastic, zero, forces, (), excitation.base)
    terms = terms._replace(given=_given_forces(excitation.given, at[9], count))
    late = zero if lag is None else zero.at[at[1] : at[2]].set(lag.T)
    if loss is not None:
        late = lax.complex(late, loss * terms.strained(0))
    values, names, units = output_rows(outputs, system, terms._replace(lag=late))
    parts = [values[a:b].T for a, b in zip(at[:-1], at[1:], strict=True)]
    direct = jnp.stack([parts[8] + parts[9], parts[7], parts[6]])
    return {"rows": jnp.stack(parts[:3]), "static": jnp.stack(parts[3:6]), "direct": direct}, names, units


def _given_forces(given, start, count):
    """Forces by name for all cases: those of input k in the case start + k."""
    found: list[Any] = []
    for k, pattern in enumerate(given):
        if isinstance(pattern, dict):
            case = jnp.zeros(count).at[start + k].set(1.0)
            found.append({name: jnp.multiply.outer(case, jnp.asarray(f)) for name, f in pattern.items()})
    return tuple(found)
