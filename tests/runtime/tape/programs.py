"""Programs that together have every operation of tapes, each with its arguments."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from .complex_programs import COMPLEX

RNG = np.random.default_rng(0)
X, Y = RNG.normal(size=(4, 5)), RNG.normal(size=(4, 5))
Z = RNG.normal(size=(2, 3, 4, 5))
A = RNG.normal(size=(3, 3))
S, B = A @ A.T + np.eye(3), RNG.normal(size=(3, 2))
STACK = RNG.normal(size=(4, 3, 3)) + 3.0 * np.eye(3)
SPECIAL = np.array([np.nan, -0.0, 0.0, 0.5, -0.5, 1.5, 2.5, np.inf, -np.inf, 1e-300, 1e308, -3.7, 4e9])
WHOLE = np.array([5, -7, 100_000, 0, 2**31 - 1, -(2**31)], np.int32)
PLACES, BEYOND = np.array([0, 3, 2, 1]), np.array([0, 3, -1, 7])

_SMOOTH = "sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh arctanh exp exp2 expm1 log1p cbrt square".split()
_ROUGH = "abs sign floor ceil round isfinite isnan signbit negative sqrt".split()


def each(names, module=jnp):
    return lambda x: [getattr(module, name)(x) for name in names]


def slopes(names):
    """First and second derivatives: JAX 0.12 writes some with operations of their own."""

    def second(function):
        slope = lambda x: jax.jvp(function, (x,), (jnp.ones_like(x),))[1]
        return lambda x: [slope(x), jax.vjp(slope, x)[1](jnp.ones_like(x))[0]]

    return lambda x: [second(getattr(jnp, name))(x) for name in names]


def loop(body, x, turns=4):
    return lax.fori_loop(0, turns, body, x)


def branches(x, k):
    ways = [lambda x: x, lambda x: x.at[0].set(0.0), lambda x: (x + 1.0).at[1].set(1.0)]
    return [lax.cond(k > 1, lambda x: x * 2, lambda x: x, x), lax.switch(k, ways, x), x]


def triangular(S, B):
    solve = functools.partial(lax.linalg.triangular_solve, S)
    flags = [(t, u) for t in (True, False) for u in (True, False)]
    return [
        solve(b, left_side=left, lower=lower, transpose_a=t, unit_diagonal=u)
        for left, b in ((True, B), (False, B.T))
        for lower in (True, False)
        for t, u in flags
    ]


#: Function and arguments of each.
PROGRAMS = {
    "smooth": (each(_SMOOTH), (0.4 * np.tanh(X),)),
    "slopes of smooth": (slopes(_SMOOTH), (0.4 * np.tanh(X),)),
    "slopes of complex": (slopes(["tanh", "arctanh", "sin", "exp", "log1p"]), (0.4 * np.tanh(X) + 0.2j,)),
    "rough": (each(_ROUGH), (SPECIAL,)),
    "more functions": (
        lambda x: [
            lax.rsqrt(x),
            jnp.log(x),
            jnp.arccosh(1 + x),
            lax.erf(x),
            lax.erfc(x),
            lax.lgamma(x),
            lax.logistic(x),
        ],
        (np.abs(X),),
    ),
    "powers": (lambda x: [jnp.abs(x) ** 2.3, x**3, x**-2, x**2, jnp.abs(x) ** x, lax.round(x)], (X,)),
    "comparisons": (
        lambda x, y: [
            x == y,
            x != y,
            x < y,
            x <= y,
            x > y,
            x >= y,
            (x > 0) & (y > 0),
            (x > 0) | (y > 0),
            (x > 0) ^ (y > 0),
            ~(x > 0),
        ],
        (SPECIAL, SPECIAL[::-1].copy()),
    ),
    "two operands": (
        lambda x, y: [
            x + y,
            x - y,
            x * y,
            x / y,
            jnp.maximum(x, y),
            jnp.minimum(x, y),
            jnp.arctan2(x, y),
            lax.rem(x, y),
            jnp.nextafter(x, y),
            jnp.clip(x, y, 1.0),
            jnp.where(x > y, x, y),
            jnp.where(x > y, 1.0, y),
        ],
        (SPECIAL, SPECIAL[::-1].copy()),
    ),  # fmt: skip
    "order of all numbers": (
        lambda x, y: [
            lax.eq_to_p.bind(x, y),
            jnp.searchsorted(jnp.sort(x), y),
            jnp.searchsorted(jnp.sort(x), y, "right"),
        ],
        (SPECIAL, SPECIAL[::-1].copy()),
    ),  # fmt: skip
    "axes of length one": (lambda x, y: [x[:, :1] * y[:1], x[:, None] * y[None], x + 1.0, lax.mul(x, y)], (X, Y)),
    "whole numbers": (
        lambda k: [
            k + 2147483647,
            k - 7,
            k * k * k,
            lax.div(k, jnp.int32(3)),
            lax.rem(k, jnp.int32(3)),
            k // 3,
            k & 6,
            k | 1,
            k ^ 5,
            ~k,
            k.astype(float) / 2,
            jnp.cumsum(k),
            jnp.sum(k),
            lax.div(k + 1, k),
            k.astype(bool),
        ],
        (WHOLE,),
    ),  # fmt: skip
    "conversions": (
        lambda x, k: [
            x.astype(jnp.int32),
            x.astype(jnp.int64),
            x.astype(jnp.uint32),
            (k - 8).astype(jnp.int32),
            k.astype(jnp.uint32) - 9,
        ],
        (SPECIAL, WHOLE.astype(np.int64) * 3),
    ),
    "shapes": (
        lambda x: [
            x[::-1, 1:3],
            x.T,
            jnp.concatenate([x, x]),
            jnp.stack([x, x], 1),
            jnp.pad(x, ((1, 2), (0, 1))),
            lax.pad(x, 7.0, ((-1, 2, 1), (0, -2, 0))),
            x.reshape(-1)[3:9],
            jnp.stack(x.T, axis=-1),
            lax.reshape(x, (x.size,), (1, 0))
            * lax.reshape(jnp.arange(1.0 * x.size).reshape(x.shape), (x.size,), (1, 0)),
            jnp.roll(x, 1),
            jnp.tile(x, (2, 1)),
            *jnp.split(x, 2),
            jnp.zeros((0, 3)),
            x[:0],
            jnp.broadcast_to(x[0, 0], (2, 3)),
            jnp.arange(4.0)[:, None] * x,
        ],
        (X,),
    ),  # fmt: skip
    "reductions": (
        lambda x: [
            x.sum(),
            x.sum(0),
            x.sum(1),
            x.prod(),
            x.max(0),
            x.min(1),
            jnp.all(x > 0),
            jnp.any(x > 0, 1),
            jnp.cumsum(x, 0),
            jnp.cumprod(x, 1),
            lax.cumsum(x, 0, reverse=True),
            lax.cummax(x, 1),
            lax.cummin(x, 0, reverse=True),
        ],
        (X,),
    ),  # fmt: skip
    "reductions with NaN": (
        lambda x: [
            x.max(),
            x.min(),
            jnp.argmax(x),
            jnp.argmin(x),
            jnp.sort(x),
            jnp.argsort(x),
            jnp.nanmax(x),
            lax.cummax(x),
        ],
        (SPECIAL,),
    ),
    "several axes": (
        lambda z: [
            z.sum((0, 2)),
            z.max((1, 3)),
            z.sum((1, 2)),
            jnp.argmax(z, 1),
            jnp.argmin(z, 3),
            jnp.sort(z, 1),
            jnp.argsort(z, 2),
            *lax.sort((jnp.round(z), z), dimension=1, num_keys=2),
        ],
        (Z,),
    ),  # fmt: skip
    "products": (
        lambda x, y, z: [
            x.T @ y,
            x @ y.T,
            jnp.outer(x[0], y[:, 0]),
            x[0] @ y[0],
            jnp.einsum("abcd,abed->ce", z, z),
            jnp.einsum("abcd,adbf->cf", z, z.transpose(0, 3, 1, 2)),
            jnp.einsum("abcd,cd->ba", z, x),
            jnp.eye(4) @ x,
        ],
        (X, Y, Z),
    ),  # fmt: skip
    "gathers": (
        lambda x, i: [
            x[i],
            x[:, i],
            x[i, i],
            jnp.take_along_axis(x, i[:, None], 1),
            jax.vmap(lambda r, k: r[k])(x, i),
            x[2],
            x[1:3, i],
        ],
        (X, PLACES),
    ),
    "gathers out of range": (
        lambda x, i: [
            x[i],
            x.at[i].get(mode="fill"),
            x.at[i].get(mode="fill", fill_value=2.0),
            x.at[i].get(mode="clip"),
            (x > 0).at[i].get(mode="fill"),
            x.astype(int).at[i].get(mode="fill"),
            x.at[jnp.array([0, 9])].get(mode="fill"),
        ],
        (X, BEYOND),
    ),  # fmt: skip
    "scatters": (
        lambda x, i: [
            x.at[i].add(1.0),
            x.at[i, i].set(2.0),
            x.at[:, i].max(0.3),
            x.at[i].min(x[::-1]),
            x.at[i].multiply(3.0),
            jax.vmap(lambda r, k: r.at[k].add(2.0))(x, i),
            x.at[jnp.array([1, 1])].add(x[:2]),
            x.at[0].set(x[1]),
            x,
        ],
        (X, PLACES),
    ),  # fmt: skip
    "scatters out of range": (lambda x, i: [x.at[i].add(1.0), x.at[i].set(9.0, mode="clip")], (X, BEYOND)),
    "slices at places": (
        lambda x, k: [
            lax.dynamic_slice(x, (k, 1), (2, 3)),
            lax.dynamic_update_slice(x, jnp.ones((2, 2)), (k, k)),
            x[k],
            lax.dynamic_update_slice(x, x[:2], (k, 0)),
            x,
        ],
        (X, 3),
    ),  # fmt: skip
    "linear algebra": (
        lambda S, b: [
            jnp.linalg.cholesky(S),
            jnp.linalg.solve(S, b),
            jnp.linalg.inv(S),
            jnp.linalg.det(S),
            jnp.linalg.eigvalsh(S),
            jnp.linalg.svd(b, compute_uv=False),
            jnp.linalg.cholesky(-S),
        ],
        (S, B),
    ),  # fmt: skip
    "projectors": (lambda S: [(lambda w, v: v @ jnp.diag(w) @ v.T)(*jnp.linalg.eigh(S)), jnp.linalg.pinv(S)], (S,)),
    "batches of matrices": (
        lambda S, b: [jnp.linalg.solve(S, b), jnp.linalg.cholesky(S @ S.mT), *lax.linalg.lu(S)],
        (STACK, STACK[:, :, :2]),
    ),
    "rectangular factors": (lambda b: lax.linalg.lu(b), (B,)),
    "triangular systems": (triangular, (S, B)),
    "while": (
        lambda x: lax.while_loop(lambda c: c[0] < 10, lambda c: (c[0] + 1, c[1] * 1.1 + c[2], c[1]), (0, x, x)),
        (X,),
    ),
    "lanes that stop apart": (
        jax.vmap(lambda x: lax.while_loop(lambda c: c[1][0] < 30.0, lambda c: (c[0] + 1, c[1] * 1.5 + 1.0), (0, x))),
        (jnp.abs(X) * jnp.array([[0.1], [9.0], [0.0], [1.0]]),),
    ),
    "lanes that stop by numbers of their own": (
        jax.vmap(lambda x, y, k: (loop(lambda _, c: c * y[0] + 1.0, x, k), loop(lambda _, c: 2.0 * c, y, 5 - k))),
        (X, 0.1 * X, jnp.array([3, 0, 1, 5])),
    ),
    "lanes of lanes": (
        jax.vmap(jax.vmap(lambda x: lax.while_loop(lambda c: jnp.abs(c) < 9.0, lambda c: 2.0 * c + 0.1, x))),
        (X,),
    ),
    "lanes in turns of a scan": (
        lambda x: lax.scan(
            lambda c, r: (
                jax.vmap(lambda a: lax.while_loop(lambda b: b < 5.0, lambda b: b + jnp.exp(a), a))(c + r),
                c[0],
            ),
            jnp.zeros(5),
            x,
        ),
        (X,),
    ),
    "lanes of complex numbers": (
        jax.vmap(lambda x: lax.while_loop(lambda z: jnp.abs(z) < 9.0, lambda z: z * (1.0 + 2.0j) + 0.3, x + 0.5j)),
        (X[0],),
    ),
    "loop in place": (lambda x: [loop(lambda k, c: c.at[k].set(c[k] * 2 + k), x), x], (X,)),
    "loops in a loop": (
        lambda x: loop(lambda j, c: loop(lambda k, c: c.at[k].add(c[(k + 1) % 4] * j), c), x, 3),
        (X,),
    ),
    "carried crosswise": (lambda x, y: loop(lambda k, c: (c[1], c[0] + 1, c[2], c[1]), (x, y, x, x), 5), (X, Y)),
    "loop of constants": (
        lambda x: loop(lambda k, c: (c[1], c[0] * x[0], jnp.zeros(5)), (jnp.ones(5), jnp.ones(5), x[0]), 3),
        (X,),
    ),
    "scan": (lambda x: lax.scan(lambda c, r: (c * 0.5 + r, (c, c.sum(), r[0], 1.0)), jnp.zeros(5), x), (X,)),
    "scan backwards": (
        lambda x: lax.scan(
            lambda c, r: ((c[1], c[0] + r), (c[0], c[1])), (jnp.zeros(5), jnp.ones(5)), x, reverse=True
        ),
        (X,),
    ),
    "scan that gives one number": (lambda x: lax.scan(lambda c, r: (c + r, jnp.full(900, 2.0)), x[0], x), (X,)),
    "scan of nothing": (lambda x: lax.scan(lambda c, r: (c + r, c), x[0], x[:0]), (X,)),
    "scan over a constant": (lambda x: lax.scan(lambda c, r: (c + r, c), x[0], jnp.ones((3, 5))), (X,)),
    "branches": (branches, (X, 2)),
    "constant branch": (lambda x: branches(x, jnp.asarray(1)), (X,)),
    "branches in a loop": (
        lambda x: loop(lambda k, c: lax.cond(k % 2 == 0, lambda c: c.at[k % 4].set(9.0 * k), lambda c: c, c), x, 6),
        (X,),
    ),
    "branch that keeps the old": (
        lambda x: loop(
            lambda k, c: lax.cond(k > 1, lambda a, b: (a.at[0].add(1.0), a), lambda a, b: (b, a), *c), (x, x + 1)
        ),
        (X,),
    ),
    "map": (lambda x: lax.map(lambda r: jnp.linalg.norm(r) * r, x), (X,)),
    "gradient of a scan": (jax.grad(lambda x: lax.scan(lambda c, r: (jnp.sin(c) + r @ x[0], None), 1.0, x)[0]), (X,)),
    "hessian": (jax.hessian(lambda v: jnp.sum(jnp.sin(S @ v) ** 2 / (1 + v**2))), (B[:, 0],)),
    "derivatives of a solution": (
        jax.jacfwd(jax.grad(lambda b: jnp.sum(jnp.linalg.solve(S + jnp.diag(b), b) ** 2))),
        (B[:, 0],),
    ),
    "constants alone": (lambda x: [jnp.eye(3) @ jnp.ones(3), jnp.arange(3) + 1, x], (X,)),
    "spacing": (jnp.spacing, (SPECIAL[3:6],)),
    "searchsorted": (lambda x, y: jnp.searchsorted(jnp.sort(x[0]), y), (X, Y)),
    "interp": (lambda x: jnp.interp(x, jnp.array([0.0, 1.0, 2.0]), jnp.array([1.0, 3.0, 2.0])), (X,)),
    **COMPLEX,
}
