"""Receptances by modal superposition, with the derivatives of the inverse dynamic stiffness."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex

from ..checks import is_concrete, require_numbers, require_reals
from ..elements._base import as_real
from ..linear._condensation import interface_basis, partition
from ..linear._symmetric import check_mass, require_symmetric
from ..math import _square as square
from ..math._eigen import eig, eigh, spectral
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike, RowsLike
from ._gains import harmonic_rate
from ._refined_solve import checked_solve


def receptance(
    *,
    K: AnyArray,
    M: AnyArray,
    omega: ArrayLike,
    out: ArrayLike | Sequence[int],
    into: ArrayLike | Sequence[int],
    C: AnyArray | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
    residual: bool = True,
    chunk: int = 64,
) -> Complex[Array, "frequencies outputs inputs"]:
    """Receptances `B_ij(w)` of `(K (1 + i loss) + i w C - w^2 M)^-1` by natural modes.

    Args:
        K, M: stiffness and mass (n, n).
        omega: (frequencies,) angular frequencies [rad/s].
        out: output coordinates, or an output matrix (outputs, n).
        into: input coordinates, or load columns (n, inputs).
        C: damping (n, n) that does not couple the modes (`rayleigh_damping`, `modal_damping`).
        loss: loss factor of the whole stiffness.
        num: number of modes kept, default all; a group of equal frequencies must not be cut.
        residual: add the static contribution of the other modes.
        chunk: frequencies computed together: memory grows with this.

    Derivatives are those of the inverse, also at repeated frequencies: of all orders with all modes, of first order
    with some.  The residual of the equation is checked at each frequency, which is solved directly where the residual
    is more than rounding.

    Returns: (frequencies, outputs, inputs) complex [m/N, rad/(N m)].

    Raises: ValueError for damping, if concrete, that couples the modes, and for unsymmetric matrices: for both use
    `viscous_receptance`.  Under tracing such damping costs a direct solution at each frequency, and unsymmetric
    matrices give NaN.
    Source: S1 (40), (41).
    """
    require_numbers(omega=omega, loss=loss)
    stiffness, mass = require_symmetric(stiffness=K, mass=M)
    check_mass(M)
    K, M, C, values, X = _modal_matrices(stiffness, mass, C, num)
    outputs, loads = _unit_rows(out, K), _unit_rows(into, K, True)
    rows, right = outputs @ X, X.T @ loads
    rate = jnp.zeros_like(values) if C is None else lax.stop_gradient(jnp.diagonal(C))
    inertia = lax.stop_gradient(jnp.diagonal(M))
    loss = jnp.asarray(loss, K.dtype)
    dtype = np.result_type(K.dtype, np.complex64)
    rows, right = rows.astype(dtype), right.astype(dtype)
    one, matrices = lax.complex(jnp.ones_like(loss), loss), (K, M) if C is None else (K, M, C)

    @jax.checkpoint
    def at(w):
        z = lax.stop_gradient(lax.complex(values - w**2 * inertia, values * loss + w * rate))
        i_w = lax.complex(jnp.zeros_like(w), w)
        factors = (one, i_w**2, i_w)[: len(matrices)]
        return rows @ checked_solve(matrices, factors, right, lambda r: r / z[:, None])

    found = lax.map(at, jnp.asarray(omega, K.dtype), batch_size=chunk)
    if num is None or residual:
        return found
    static = spectral(_residual_flexibility, stiffness, mass, _retained_flags(stiffness, num))
    return found - (outputs @ static @ loads).astype(dtype)[None] / lax.complex(jnp.ones_like(loss), loss)


def _unit_rows(places, like, columns=False):
    """Unit rows (k, n), or columns (n, k), of coordinates; matrices are returned unchanged.  Raises: ValueError."""
    if np.ndim(places) == 2:
        return jnp.asarray(places, like.dtype)
    places, n = np.asarray(places, int).reshape(-1), len(like)
    if np.any((places < -n) | (places >= n)):
        raise ValueError(f"coordinates {places.tolist()} must be among 0 ... {n - 1}")
    rows = jnp.eye(n, dtype=like.dtype)[places]
    return rows.T if columns else rows


def _modal_matrices(stiffness, mass, damping, num):
    """K, M, C in the modes; the shapes are constants, so that derivatives appear in the off-diagonal terms."""
    values, X = lax.stop_gradient(eigh(stiffness, mass))
    if num is not None:
        P = spectral(_retained_projector, stiffness, mass, _retained_flags(stiffness, num)) @ mass
        mass, damping = (None if A is None else P.T @ A @ P for A in (mass, damping))
    K, M, C = (None if A is None else X.T @ A @ X for A in (stiffness, mass, damping))
    _check_uncoupled(C)
    return K, M, C, values, X


def _retained_flags(stiffness, num):
    """Flags (n,): 1 for the lowest `num` modes, 0 for the others."""
    return (jnp.arange(len(stiffness)) < num).astype(stiffness.dtype)


def _retained_projector(values, flag):
    return flag * jnp.ones_like(values)


def _residual_flexibility(values, flag):
    return (1.0 - flag) / (flag + (1.0 - flag) * values)


def _check_uncoupled(C):
    if C is None or not is_concrete(C):
        return
    C = np.asarray(C)
    own, rounding = np.abs(np.diagonal(C)), np.sqrt(np.finfo(C.dtype).eps)
    size = np.sqrt(np.outer(own, own)) + rounding * np.max(own, initial=1e-30)
    coupled = np.max(np.abs(C - np.diag(np.diagonal(C))) / size, initial=0.0)
    if coupled > 1e3 * rounding:
        raise ValueError(
            f"the damping couples the modes (by {coupled:.1g} of their own damping): use viscous_receptance"
        )


def viscous_receptance(
    *,
    K: AnyArray,
    M: AnyArray,
    C: AnyArray,
    omega: ArrayLike,
    out: ArrayLike | Sequence[int],
    into: ArrayLike | Sequence[int],
    chunk: int = 64,
) -> Complex[Array, "frequencies outputs inputs"]:
    """Receptances with any viscous damping by complex modes, on the CPU; matrices may be unsymmetric.

    Arguments are those of `receptance`, omega in [rad/s].  At a frequency where the modes do not solve the equation
    (the vectors of critical damping are parallel) it is solved directly.

    Returns: (frequencies, outputs, inputs) complex.  Source: S1 (39), (40).
    """
    require_numbers(omega=omega)
    check_mass(M)
    loads, outputs = _unit_rows(into, K, True), _unit_rows(out, K)
    matrices = K, M, C
    roots, shapes, left = _complex_modes(*lax.stop_gradient((K, C, M)))
    right, outputs = loads.astype(roots.dtype), outputs.astype(roots.dtype)

    @jax.checkpoint
    def at(w):
        i_w = lax.complex(jnp.zeros_like(w), w)
        z = (i_w - roots)[:, None]
        factors = jnp.ones_like(i_w), i_w**2, i_w
        straight, turned = ((lambda r, X=X, Y=Y: X @ ((Y @ r) / z)) for X, Y in ((shapes, left), (left.T, shapes.T)))
        return outputs @ checked_solve(matrices, factors, right, straight, turned)

    return lax.map(at, jnp.asarray(omega, K.dtype), batch_size=chunk)


def _complex_modes(K, C, M):
    """Roots (2 n,), shapes (n, 2 n) and left (2 n, n) with `sum_j shapes_j left_j / (s - root_j)` the receptance."""
    n = len(K)
    solved = square.solve(M, jnp.concatenate([K, C, jnp.eye(n, dtype=K.dtype)], axis=1))
    by_x, by_v, by_force = (solved[:, k * n : (k + 1) * n] for k in range(3))
    roots, X, Y = eig(jnp.block([[jnp.zeros_like(K), jnp.eye(n, dtype=K.dtype)], [-by_x, -by_v]]))
    return roots, X[:n], Y[:, n:] @ by_force.astype(Y.dtype)


def modal_receptance(
    natural: AnyArray,
    at_out: AnyArray,
    at_into: AnyArray,
    omega: AnyArray,
    ratios: ArrayLike,
    modal_masses: ArrayLike = 1.0,
) -> Complex[Array, "frequencies outputs inputs"]:
    """Receptances `B_ij = sum_k V_ik V_jk / (m_k [(w_k^2 - w^2) + 2 i eta_k w_k w])` from a given set of modes.

    For measured or selected modes.  Derivatives through the shapes of repeated frequencies are wrong here: for them
    use `receptance`.

    Args:
        natural: w_k (m,) [rad/s].
        at_out, at_into: V (outputs, m), (inputs, m).
        omega: (frequencies,) [rad/s].
        ratios: eta (m,), or (frequencies, m) where it depends on frequency.
        modal_masses: m_k (m,), for shapes that are not mass-normalised.

    Returns: (frequencies, outputs, inputs).  Source: S1 (40), (43).
    """
    natural, omega = as_real(natural), as_real(omega)
    w, wk = omega[:, None], natural[None, :]
    eta = jnp.broadcast_to(as_dtype(ratios, natural.dtype), (len(omega), len(natural)))
    m = jnp.broadcast_to(as_dtype(modal_masses, natural.dtype), natural.shape)[None]
    z = lax.complex(m * (wk**2 - w**2), m * (2 * eta * wk * w))
    V = at_out.astype(z.dtype)
    return jnp.einsum("ik,wk,jk->wij", V, 1 / z, at_into.astype(z.dtype))


def transmissibility(
    *,
    K: AnyArray,
    M: AnyArray,
    omega: ArrayLike,
    base: RowsLike,
    out: RowsLike,
    C: AnyArray | None = None,
    loss: ArrayLike = 0.0,
    chunk: int = 64,
) -> Complex[Array, "frequencies outputs base"]:
    """Transmissibilities: motion of output coordinates per motion of the base, at omega (frequencies,) [rad/s].

    The structure moves statically with the base and, relative to that, under its own inertia.

    Args: base: coordinates that are moved; out: coordinates outside the base; others as in `receptance`.

    Returns: (frequencies, outputs, base coordinates) complex, of displacements and of accelerations alike.

    Raises: ValueError for outputs on the base.  Source: S1 (5), (40), (44)-(45).
    """
    require_reals(omega)
    inner, outer = partition(len(K), base)
    if not set(out) <= set(inner.tolist()):
        raise ValueError(f"outputs {list(out)} must be coordinates outside the base, 0 ... {len(K) - 1}")
    T = interface_basis(K, base)
    loads = [(M @ T)[inner]] + ([] if C is None else [(C @ T)[inner]])
    place = {int(c): k for k, c in enumerate(inner)}
    rows = [place[int(c)] for c in out]
    cut = lambda A: A[inner][:, inner]
    inside: dict[str, Any] = {"K": cut(K), "M": cut(M), "C": None if C is None else cut(C)}
    into = jnp.concatenate(loads, axis=1)
    H = receptance(**inside, omega=omega, out=rows, into=into, loss=loss, chunk=chunk)
    b, rate = len(outer), harmonic_rate(omega, H)
    relative = -(rate**2) * H[:, :, :b]
    if C is not None:
        relative = relative - rate * H[:, :, b:]
    return T[np.asarray(out)].astype(H.dtype)[None] + relative
