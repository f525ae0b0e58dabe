"""Motion of a structure in its modes, with derivatives that are right where frequencies repeat."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_concrete, not_positive
from ..linear._symmetric import check_mass, check_symmetric
from ..math._eigen import same
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike
from ._damping import is_coupling_modes
from ._modal_equations import ModalMotion, oscillations
from ._modes import Modes, natural_modes


def modal_response(
    *,
    K: AnyArray,
    M: AnyArray,
    load: AnyArray,
    step: ArrayLike,
    ratios: ArrayLike = 0.0,
    C: AnyArray | None = None,
    num: int | None = None,
    static_start: bool = False,
    diagonal: AnyArray | None = None,
) -> ModalMotion:
    """Displacement, velocity and acceleration (n, T) under a load (T, n) that is straight between samples, from rest.

    Exact at the samples for the modes that move.

    Args:
        step: between samples [s].
        ratios: damping of the modes, one number or one for each (n,), then equal in a group; rigid ones have none.
        C: damping (n, n) that does not couple the modes, in place of ratios.
        num: modes that move; those above follow the load statically.  It cuts no group (`eigenmodes.complete`).
        static_start: elastic modes start at rest in balance with the first load.
        diagonal: as of `natural_modes`.

    First derivatives are right where frequencies repeat, parted by a parameter or not, and at rigid modes without
    damping.

    Raises: ValueError as `natural_modes`, and for loads that do not fit; if concrete, for a damping that couples the
    modes and motions that are not finite; under tracing such a damping gives NaN.  Source: S1 (30)-(31), (42)-(43).
    """
    check_symmetric(stiffness=K, mass=M, damping=C)
    check_mass(M)
    n, dtype = len(K), K.dtype
    if load.ndim != 2 or load.shape[1] != n:
        raise ValueError(f"the load has shape {load.shape}, not (times, {n})")
    if num is not None and not 0 <= num <= n:
        raise ValueError(f"num = {num}: there are {n} modes")
    _check_uncoupled(K, M, C)
    z = jnp.broadcast_to(as_dtype(ratios, dtype), (n,))
    h = as_dtype(step, dtype)
    if not_positive(step):
        raise ValueError(f"step = {step}: the time between samples must be positive")
    found = _response(n if num is None else num, static_start, K, M, C, load.T, h, z, diagonal)
    _check_finite(found.displacement)
    return ModalMotion(*(part.T for part in found))


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
@partial(jax.jit, static_argnums=(0, 1))
def _response(num, static_start, K, M, C, load, step, ratios, diagonal):
    """Motion (n, T) under a load (n, T)."""
    modes = natural_modes(K=K, M=M, diagonal=diagonal)
    found = _modal(num, static_start, modes, load, step, ratios, modes.values, _own_rates(C, modes))
    return ModalMotion(*(modes.shapes @ q for q in found))


@_response.defjvp
def _response_jvp(num, static_start, primals, tangents):
    def parted(K, M, C, load, step, ratios, diagonal):
        modes = natural_modes(K=K, M=M, diagonal=diagonal)
        respond = partial(_modal, num, static_start, modes, load, step, ratios)
        at, one = (modes.values, _own_rates(C, modes)), jnp.ones_like(modes.values)
        found, slopes = jax.jvp(respond, at, (one, None if C is None else jnp.zeros_like(one)))
        R = _parting(K, M, modes, at[0])
        found = [q + R @ slope for q, slope in zip(found, slopes, strict=True)]
        if C is not None:
            R, slopes = _parting(C, M, modes, at[1]), jax.jvp(respond, at, (jnp.zeros_like(one), one))[1]
            found = [q + R @ slope for q, slope in zip(found, slopes, strict=True)]
        return ModalMotion(*(modes.shapes @ q for q in found))

    return jax.jvp(parted, primals, tangents)


def _modal(num, static_start, modes: Modes, load, step, ratios, values, rates):
    """Modal displacements, velocities and accelerations (n, T)."""
    rigid, forces = modes.is_rigid, modes.shapes.T @ load
    values = jnp.where(rigid, values - lax.stop_gradient(values), values)
    safe = jnp.where(rigid, 1.0, values)
    rates = jnp.where(rigid, 0.0, 2 * ratios * jnp.sqrt(safe)) if rates is None else rates
    static = jnp.where(rigid[:, None], 0.0, forces / safe[:, None])
    start = static[:num, 0] if static_start else None
    moved = oscillations(values[:num], rates[:num], forces[:num].T, step, start)
    rest = static[num:]
    others = (rest, jnp.zeros_like(rest), jnp.zeros_like(rest))
    return tuple(jnp.concatenate([q.T, other]) for q, other in zip(moved, others, strict=True))


def _own_rates(C, modes: Modes):
    """(n,) damping of each mode, NaN where it couples them."""
    if C is None:
        return None
    C = modes.shapes.T @ C @ modes.shapes
    return jnp.where(is_coupling_modes(lax.stop_gradient(C)), jnp.nan, jnp.diagonal(C))


def _parting(A, M, modes: Modes, diagonal):
    """Splitting of the modes of a group by a change of A (n, n): zero, with a derivative off the diagonal."""
    values, X, diagonal = lax.stop_gradient((modes.values, modes.shapes, diagonal))
    R = X.T @ A @ X - (X.T @ M @ X) * diagonal[None, :]
    R = jnp.where(same(values) & ~jnp.eye(len(values), dtype=bool), R, 0.0)
    return R - lax.stop_gradient(R)


def _check_uncoupled(K, M, C):
    """By whether `C M^-1 K` is symmetric."""
    if C is None or not is_concrete(K, M, C):
        return
    K, M, C = (np.asarray(A) for A in (K, M, C))
    product = C @ np.linalg.solve(M, K)
    if np.max(np.abs(product - product.T)) > np.finfo(C.dtype).eps ** 0.5 * np.max(np.abs(product), initial=1e-300):
        raise ValueError("the damping couples the modes: give ratios, or integrate (simulate without Modal)")


def _check_finite(x):
    if is_concrete(x) and not np.all(np.isfinite(np.asarray(x))):
        raise ValueError(
            "the motion is not finite: a mass that is not positive definite, negative stiffness, damping that "
            "couples modes of equal frequency, or the load"
        )
