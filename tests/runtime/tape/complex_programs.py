"""Programs of complex numbers, of decompositions by LAPACK and of special functions, each with its arguments."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

R = np.random.default_rng(0)
Z = R.normal(size=(3, 4)) + 1j * R.normal(size=(3, 4))
W = R.normal(size=(3, 4)) + 1j * R.normal(size=(3, 4))
A = R.normal(size=(4, 4))
C = A + 1j * R.normal(size=(4, 4))
H = C @ C.conj().T + np.eye(4)
b = R.normal(size=(4, 2)) + 1j * R.normal(size=(4, 2))
X = R.normal(size=(3, 8))
S = R.normal(size=(5, 4, 4)) + 1j * R.normal(size=(5, 4, 4))
SP = np.array([0, -0.0, 1, -1, 1e300, -3]) + 1j * np.array([0.0, 2, 0, 0, 1e300, -4])


#: Function and arguments of each.
COMPLEX = {
    "complex arithmetic": (
        lambda z, w: [
            z + w,
            z - w,
            z * w,
            z / w,
            -z,
            jnp.conj(z),
            z.real,
            z.imag,
            jnp.abs(z),
            jnp.angle(z),
            jnp.sign(z),
            z * 2.0,
            1j * z,
            z / 2.0,
            1 / z,
            z == w,
            z != w,
            z**2,
            z**3,
            z**-2,
            jnp.square(z),
        ],
        (Z, W),
    ),
    "complex functions": (
        lambda z: [
            jnp.exp(z),
            jnp.log(z),
            jnp.sqrt(z),
            lax.rsqrt(z),
            jnp.sin(z),
            jnp.cos(z),
            jnp.sinh(z),
            jnp.cosh(z),
            z**0.3,
            z**z,
        ],
        (Z,),
    ),
    "more complex functions": (
        lambda z: [
            jnp.tan(z),
            jnp.tanh(z),
            jnp.tanh(100 * z),
            jnp.expm1(z),
            jnp.log1p(z),
            jnp.arcsin(z),
            jnp.arccos(z),
            jnp.arcsinh(z),
            jnp.arccosh(z),
            jnp.arctan(z),
            jnp.arctanh(z),
            lax.logistic(z),
            jnp.prod(z),
            jnp.prod(z, 0),
        ],
        (Z,),
    ),
    "special complex numbers": (
        lambda z: [jnp.abs(z), jnp.sqrt(z), jnp.exp(-z / 1e300), jnp.angle(z), z * (1 + 1j), 1 / (z + 3.5)],
        (SP,),
    ),
    "complex shapes": (
        lambda z: [
            z.T,
            z.reshape(-1),
            z[::-1, 1:3],
            jnp.concatenate([z, z]),
            jnp.stack([z, z], 1),
            jnp.pad(z, 1),
            z.sum(),
            z.sum(0),
            jnp.cumsum(z, 1),
            jnp.where(z.real > 0, z, 2j),
            z[jnp.array([0, 2])],
            z.at[1].set(0.5j),
            z.at[jnp.array([1, 1])].add(1j),
            jnp.broadcast_to(z[0], (2, 4)),
            jnp.zeros_like(z),
            jnp.sort(z.reshape(-1)),
            z.astype(complex),
            z.real.astype(complex),
        ],
        (Z,),
    ),
    "complex products": (
        lambda C, b: [
            C @ b,
            C.T @ b,
            jnp.einsum("ij,ik->jk", C, b.conj()),
            jnp.vdot(b[:, 0], b[:, 1]),
            C.real @ b.real + 0j,
        ],
        (C, b),
    ),
    "complex systems": (
        lambda C, b: [jnp.linalg.solve(C, b), jnp.linalg.inv(C), jnp.linalg.det(C), *lax.linalg.lu(C)],
        (C, b),
    ),
    "batches of complex matrices": (
        lambda S, b: [jax.vmap(lambda s: jnp.linalg.solve(s, b))(S), jnp.linalg.inv(S)],
        (S, b),
    ),
    "Hermitian matrices": (
        lambda H: [jnp.linalg.eigvalsh(H), jnp.linalg.cholesky(H), jnp.linalg.svd(H, compute_uv=False)],
        (H,),
    ),
    "Hermitian projectors": (
        lambda H: [
            (lambda w, v: v @ jnp.diag(w + 0j) @ v.conj().T)(*jnp.linalg.eigh(H)),
            (lambda u, s, v: (u * s) @ v)(*jnp.linalg.svd(H)),
        ],
        (H,),
    ),
    "eigenvalues": (lambda A: [*jnp.linalg.eig(A), *jnp.linalg.eig(A + 1j * A.T), jnp.linalg.eigvals(A)], (A,)),
    "batches of eigenvalues": (
        lambda A: [jnp.linalg.eigvals(jnp.stack([A, 2 * A])), *lax.linalg.eig(A, compute_left_eigenvectors=True)],
        (A,),
    ),
    "qr": (
        lambda A, C: [
            *jnp.linalg.qr(A),
            *jnp.linalg.qr(A[:, :2]),
            *jnp.linalg.qr(A[:, :2], mode="complete"),
            *jnp.linalg.qr(C),
        ],
        (A, C),
    ),
    "schur": (lambda A, C: [*jax.scipy.linalg.schur(A), *jax.scipy.linalg.schur(C)], (A, C)),
    "fft": (
        lambda x: [
            jnp.fft.fft(x),
            jnp.fft.rfft(x),
            jnp.fft.irfft(jnp.fft.rfft(x)),
            jnp.fft.ifft(x + 1j),
            jnp.fft.fft2(x),
            jnp.fft.irfft(jnp.fft.rfft(x[:, :7]), 7),
        ],
        (X,),
    ),
    "roots": (lambda x: jnp.roots(x, strip_zeros=False), (np.array([1.0, -6, 11, -6]),)),
    "exponential of a matrix": (lambda A: jax.scipy.linalg.expm(A), (A,)),
    "loops of complex numbers": (
        lambda z: [
            lax.fori_loop(0, 4, lambda k, c: c * z + 1j, z),
            *lax.scan(lambda c, r: (c + r, (c * r, r.real)), z[0], z),
            lax.cond(z.real[0, 0] > 0, lambda z: z * 1j, lambda z: z, z),
            lax.map(lambda r: r.conj() @ r, z),
        ],
        (Z,),
    ),
    "gradient through complex numbers": (
        lambda z: [
            jax.grad(lambda x: jnp.abs(jnp.linalg.solve(jnp.eye(4) * (2 + 1j) + x * 1j, jnp.ones(4) + 0j)).sum())(z)
        ],
        (A,),
    ),
    "complex triangular systems": (
        lambda C, b: [
            functools.partial(lax.linalg.triangular_solve, C)(
                x, left_side=l, lower=lo, transpose_a=t, conjugate_a=c, unit_diagonal=u
            )
            for l, x in ((True, b), (False, b.T))
            for lo in (True, False)
            for t, c in ((False, False), (True, False), (True, True))
            for u in (True, False)
        ],
        (C, b),
    ),
    "special functions": (
        lambda x: [
            lax.erf_inv(jnp.tanh(x)),
            lax.digamma(jnp.abs(x) + 0.2),
            lax.igamma(jnp.abs(x) + 0.3, jnp.abs(x) + 0.1),
            lax.igammac(jnp.abs(x) + 0.3, jnp.abs(x) + 0.1),
            lax.bessel_i0e(x),
            lax.bessel_i1e(x),
            lax.betainc(jnp.abs(x), jnp.abs(x) + 0.5, jax.nn.sigmoid(x)),
            jax.scipy.special.zeta(jnp.abs(x) + 1.5, jnp.abs(x) + 1.0),
            jax.scipy.special.gammainc(2.0, jnp.abs(x)),
            jax.scipy.special.polygamma(1, jnp.abs(x) + 1.0),
        ],
        (X,),
    ),
    "random numbers": (
        lambda x: [
            jax.random.normal(jax.random.key(0), (3, 8)) + x,
            jax.random.uniform(jax.random.key(3), (2,)) + x[0, :2],
        ],
        (X,),
    ),
    "powers of whole numbers": (
        lambda k: [
            jnp.square(k),
            k**3,
            jnp.zeros(4, jnp.int32).at[jnp.array([1, 1, 2])].add(k[:3]),
            lax.select_n(jnp.array([0, 1, 2, 2], jnp.int32), k, k * 2, k * 3),
        ],
        (np.array([3, -4, 70000, 2**31 - 1], np.int32),),
    ),
    "differences by scatter": (
        lambda x: [
            lax.scatter_sub(
                x,
                jnp.array([[1], [1]]),
                x[:2],
                lax.ScatterDimensionNumbers((1,), (0,), (0,)),
            ),
            jax.device_put(x),
        ],
        (X,),
    ),  # fmt: skip
    "complex constants": (lambda x: [jnp.array([1j, 2]) * x[0, 0], jnp.ones((2, 2), complex)], (X,)),
    "householder": (lambda A: lax.linalg.householder_product(A, jnp.full(4, 0.3)), (A,)),
    "decompositions of no numbers": (
        lambda C: [jnp.linalg.eigvals(C * jnp.nan), jnp.linalg.cholesky(-C @ C.conj().T)],
        (C,),
    ),
}
