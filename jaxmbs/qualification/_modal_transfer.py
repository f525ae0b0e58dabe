"""Transfer functions of a linear system from inputs to outputs in its modes, with the derivatives of the inverse."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from ..runtime import lapack, tuning
from ..typing import ArrayLike
from ..vibration import _refined_solve as refined_solve


class ModalModel(eqx.Module):
    """Equations of a system in its modes, and rows of outputs.

    The modes are constants; at them the matrices are diagonal, or damping couples them.  Derivatives appear off the
    diagonals, so that they are right where frequencies repeat.

    Attributes:
        stiffness, mass, damping: (m, m); of modes that are left out only the stiffness remains.
        loss: () loss factor of the stiffness.
        loads: (m, inputs) for a unit of each input and, second, of its integral over time, or None.
        rows: (3, outputs, m) of displacement, velocity and acceleration of the modes.
        direct: (3, outputs, inputs) of the input, its integral and its second integral.
        static: (3, outputs, inputs) of the static displacement, its rate and acceleration: rows without mass.
        names, inputs: of outputs and inputs; units: of the outputs (static).
        is_coupled: True if damping couples the modes.
        num: modes that move.
    """

    stiffness: Array
    mass: Array
    damping: Array | None
    loss: Array
    loads: tuple[Array, Array | None]
    rows: Array
    direct: Array
    static: Array
    names: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    is_coupled: bool = eqx.field(static=True)
    num: int = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True, default=())

    def poles(self) -> tuple[Array, Array]:
        """Resonances and halfwidths [Hz] of the modes that move; constants."""
        K = lax.stop_gradient(self.stiffness)
        C = None if self.damping is None else lax.stop_gradient(self.damping)
        k = jnp.diagonal(K)[: self.num]
        if self.is_coupled and C is not None:
            M = lax.stop_gradient(self.mass)[: self.num, : self.num]
            K, C = (jnp.linalg.solve(M, A[: self.num, : self.num]) for A in (K, C))
            eye = jnp.eye(self.num, dtype=K.dtype)
            roots = lapack.eig(jnp.block([[jnp.zeros_like(K), eye], [-K, -C]]))[0]
            return jnp.abs(roots.imag) / (2 * jnp.pi), jnp.abs(roots.real) / (2 * jnp.pi)
        half = jnp.zeros_like(k) if C is None else jnp.diagonal(C)[: self.num] / 2
        elastic = lax.complex(k - half**2, k * lax.stop_gradient(self.loss))
        root = jnp.sqrt(elastic)
        width = jnp.abs(half) + jnp.abs(root.imag)
        return jnp.abs(root.real) / (2 * jnp.pi), width / (2 * jnp.pi)

    def amplitudes(self, frequencies: ArrayLike) -> Array:
        """Displacements (frequencies, m, inputs) of the modes for unit inputs."""
        s = imaginary_rates(frequencies, self.rows.real.dtype)
        load = jnp.broadcast_to(self.loads[0].astype(s.dtype), (len(s), *self.loads[0].shape))
        if self.loads[1] is not None:
            load = load + self.loads[1].astype(s.dtype)[None] / s[:, None, None]
        return _solve(self, s, load)

    def transfer(self, frequencies: ArrayLike) -> Array:
        """Outputs (frequencies, outputs, inputs) for unit inputs at frequencies [Hz]."""
        s = imaginary_rates(frequencies, self.rows.real.dtype)
        q, rate = self.amplitudes(frequencies), s[:, None, None]
        terms = jnp.concatenate([q, rate * q, rate**2 * q], axis=1)
        return _recovered(jnp.concatenate(list(self.rows), axis=1), terms) + self._direct_part(s.imag)

    def _direct_part(self, w):
        """Part (frequencies, outputs, inputs) that no mode has, at angular frequencies w [rad/s]."""
        one, first, second = self.direct.astype(self.static.dtype)
        a, b, c = self.static  # complex with a loss factor
        even = _by_powers([jnp.ones_like(w), -1.0 / w**2, -(w**2)], [one + a, second, c])
        odd = _by_powers([-1.0 / w, w], [first, b])
        return even + 1j * odd if jnp.iscomplexobj(odd) else lax.complex(even, odd)

    def modal_rows(self, s: Array) -> Array:
        """Rows (frequencies, outputs, m) of the displacements of the modes at rates s = i w."""
        a, b, c = (part.astype(s.dtype)[None] for part in self.rows)
        s = s[:, None, None]
        return a + s * (b + s * c)

    def unbounded_parts(self) -> tuple:
        """Parts that must be zero under white noise: integrals of inputs, rows without mass, a loss factor."""
        return tuple(A for A in (self.loads[1], self.direct[1:], self.static, self.loss) if A is not None)

    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """Matrices A, B, C, D of all modes, without the `unbounded_parts`."""
        K, C = self.stiffness, self.damping
        C = jnp.zeros_like(K) if C is None else C
        K, C, P = (jnp.linalg.solve(self.mass, part) for part in (K, C, self.loads[0]))
        eye, zero = jnp.eye(len(K), dtype=K.dtype), jnp.zeros_like(K)
        A = jnp.block([[zero, eye], [-K, -C]])
        B = jnp.concatenate([jnp.zeros_like(P), P])
        x, v, a = self.rows
        return A, B, jnp.concatenate([x - a @ K, v - a @ C], axis=1), a @ P + self.direct[0]


def imaginary_rates(frequencies: ArrayLike, dtype: Any) -> Array:
    """Rates i w (frequencies,) at frequencies [Hz]."""
    w = 2 * jnp.pi * jnp.asarray(frequencies, dtype)
    return lax.complex(jnp.zeros_like(w), w)


def _solve(model, s, load):
    """Solutions (frequencies, m, inputs) of `(K (1 + i loss) + s C + s^2 M) q = load`."""
    K, M, C = (None if A is None else A.astype(s.dtype) for A in (model.stiffness, model.mass, model.damping))
    one = lax.complex(jnp.ones_like(model.loss), model.loss).astype(s.dtype)
    if model.is_coupled:
        Z = one * K[None] + s[:, None, None] * C[None] + (s**2)[:, None, None] * M[None]
        return jax.vmap(refined_solve.refined_solve)(Z, load)
    own = [jnp.zeros((1, len(K)), s.dtype) if A is None else jnp.diagonal(A)[None] for A in (K, C, M)]
    z = lax.stop_gradient(one * own[0] + s[:, None] * own[1] + (s**2)[:, None] * own[2])

    def product(q):
        found = one * _times(K, q) + (s**2)[:, None, None] * _times(M, q)
        return found if C is None else found + s[:, None, None] * _times(C, q)

    return lax.custom_linear_solve(product, load, lambda _, r: r / z[:, :, None], symmetric=True)


def _by_powers(powers, parts):
    """Sum (frequencies, outputs, inputs) of powers (frequencies,) times parts (outputs, inputs)."""
    stacked = jnp.stack(parts)
    found = jnp.stack(powers, axis=1).astype(stacked.dtype) @ stacked.reshape(len(parts), -1)
    return found.reshape(-1, *stacked.shape[1:])


def _recovered(rows, q):
    """Products (frequencies, outputs, inputs) of rows (outputs, m) and q (frequencies, m, inputs).

    One product of matrices for all frequencies, of real ones where the rows are real, and many.
    """
    columns = jnp.swapaxes(q, 0, 1).reshape(q.shape[1], -1)
    if jnp.iscomplexobj(rows) or len(rows) < tuning.RECOVERED_ROWS:
        found = rows.astype(columns.dtype) @ columns
    else:
        real, imag = jnp.split(rows @ jnp.concatenate([columns.real, columns.imag], axis=1), 2, axis=1)
        found = lax.complex(real, imag)
    return jnp.swapaxes(found.reshape(len(rows), len(q), -1), 0, 1)


def _times(A, q):
    return jnp.einsum("ij,wjk->wik", A, q)
