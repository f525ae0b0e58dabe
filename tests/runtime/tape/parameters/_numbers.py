"""Primitives that work number by number."""

import itertools

import jax.numpy as jnp
import numpy as np
from jax import lax

from ._data import K32, K64, SPECIAL, U32, A, B, W, X, Y, Z, of, of_pairs, pairs_of, varied

_OF_BOTH = (
    "acos acosh asin asinh atan atanh cos cosh exp log log1p sin sinh sqrt tan tanh rsqrt logistic expm1".split()
)
_OF_REAL = "cbrt ceil erf erfc exp2 floor is_finite lgamma".split()
_TYPES = (np.float64, np.int32, np.int64, np.uint32, np.bool_)
_ENDS = np.array([0.0, 0.5, 1.0, 3.0, -1.0, 2.0, np.nan, np.inf])
_INSIDE = np.array([0.25, 0.5, 0.8])
_BETAS = np.array([1.0, 0.5, 2.0] * 3)

NUMBERS = {
    **{name: of(getattr(lax, name), SPECIAL) for name in _OF_REAL},
    **{name: of(getattr(lax, name), SPECIAL, Z) for name in _OF_BOTH},
    **{name: of(getattr(lax, name), SPECIAL, K32, K64, U32, Z) for name in ("neg", "sign", "square")},
    "abs": of(lax.abs, SPECIAL, K32, K64, Z),
    "not": of(lax.bitwise_not, K32, K64, U32, B),
    **{
        name: of_pairs(getattr(lax, name), SPECIAL, K32, K64, U32, Z[0]) for name in ("add", "sub", "div", "eq", "ne")
    },
    **{name: of_pairs(getattr(lax, name), SPECIAL, K32, K64, U32) for name in "rem max min lt le gt ge".split()},
    "mul": [
        *of_pairs(lax.mul, SPECIAL, K32, K64, U32, Z[0]),
        (lambda x, y: lax.mul(x, y, out_dtype=np.int64), pairs_of(K32)),
        (lambda x: lax.mul(x, np.full(9, 100_000, np.int32), out_dtype=np.float64), (K32,)),
    ],
    **{name: of_pairs(getattr(lax, f"{name}_p").bind, SPECIAL, K32, B) for name in ("eq_to", "lt_to", "le_to")},
    **{name: of_pairs(getattr(lax, f"{name}_p").bind, K32, K64, U32, B) for name in ("and", "or", "xor")},
    **{name: of_pairs(getattr(lax, name), SPECIAL) for name in ("atan2", "nextafter")},
    "pow": [
        *of_pairs(lax.pow, SPECIAL),
        (lax.pow, (SPECIAL, np.full(len(SPECIAL), 3, np.int32))),
        (lax.pow, (Z, W)),
        (lax.pow, (Z, np.int32([[0, 1, 2, -3]] * 3))),
    ],
    "integer_pow": [
        *varied(lax.integer_pow, (SPECIAL, Z), y=(0, 1, 2, 3, 4, 7, -1, -2, -3)),
        *varied(lax.integer_pow, (K32, K64, U32), y=(0, 1, 2, 3, 7)),
    ],
    "round": varied(lax.round, (SPECIAL,), rounding_method=map(lax.RoundingMethod, (0, 1))),
    "signbit": of(jnp.signbit, SPECIAL),
    "reduce_precision": [
        (lambda x, bits=bits: lax.reduce_precision(x, *bits), (X,)) for bits in ((11, 52), (11, 20), (5, 52), (8, 23))
    ],
    "convert_element_type": [
        *varied(lax.convert_element_type, (SPECIAL, K32, K64, U32, B, np.clip(SPECIAL, -5, 5)), new_dtype=_TYPES),
        *varied(lax.convert_element_type, (Z, X, K32), new_dtype=(np.complex128, np.float64)),
        *varied(lax.convert_element_type, (X,), new_dtype=(np.float32,)),
        (lambda x: 1.0 / lax.convert_element_type(lax.convert_element_type(x, np.int32), np.float64), (SPECIAL,)),
        (lambda k: 1.0 / lax.convert_element_type(-k, np.float64), (K32,)),
        (lambda x: lax.convert_element_type(x, np.int64) - 1, (SPECIAL,)),
        (lambda x: lax.convert_element_type(x, np.int64) & 7, (SPECIAL,)),
        (lambda k: jnp.where(k > 0, np.iinfo(np.int64).max, k), (K64,)),
    ],
    "clamp": [
        *[(lax.clamp, (x, y, x[::-1].copy())) for x, y in map(pairs_of, (SPECIAL, K32, U32, K64))],
        *[(lax.clamp, (low, X, high)) for low, high in itertools.product(np.array([-0.5, 0.5, np.nan]), repeat=2)],
    ],
    "select_n": [
        *[(lax.select_n, (which, x, y)) for which in (X > 0, np.bool_(True)) for x, y in ((X, Y), (Z, W))],
        (lax.select_n, (np.int32([[0, 1, 2, 3]] * 3), X, Y, 2 * X, 3 * Y)),
        (lax.select_n, (np.int32([[0, 1, 2, 1]] * 3), Z, W, 2 * Z)),
        *[(lax.select_n, (np.int32(k), X, Y, X + Y)) for k in range(3)],
        (lax.select_n, (np.int32([0, 1, 1, 0]), X[0], Y[0])),
        (lax.select_n, (np.zeros((3, 4), np.int32), X)),
        (lax.select_n, (np.array([True, False]), K64[8:], K64[:2])),
    ],
    "complex": [(lax.complex, (X, Y))],
    "conj": of(lax.conj, Z, X),
    "real": of(lax.real, Z),
    "imag": of(lax.imag, Z),
    # at the ends of their domains they are the compiler's
    **{name: of(getattr(lax, name), SPECIAL, np.tanh(A)) for name in ("digamma", "bessel_i0e", "bessel_i1e")},
    "digamma": of(lax.digamma, SPECIAL, np.exp(A)),
    "erf_inv": of(lax.erf_inv, SPECIAL, np.tanh(A), np.array([-0.0, 0.0])),
    **{name: of_pairs(getattr(lax, name), _ENDS, np.exp(A[0])) for name in ("igamma", "igammac", "polygamma")},
    "polygamma": [*of_pairs(lax.polygamma, _ENDS), (lax.polygamma, (np.arange(4.0), np.exp(A[0])))],
    "zeta": of_pairs(lax.zeta, _ENDS, 1.0 + np.exp(A[0])),
    "regularized_incomplete_beta": [
        *[(lax.betainc, (*pairs_of(numbers), 0.5 * pairs_of(_INSIDE)[0][:9])) for numbers in (np.exp(A[0, :3]),)],
        (lax.betainc, (_BETAS, _BETAS[::-1].copy(), np.array([0.0, 1.0, 2.0, -1.0, 0.5, np.nan, 0.1, 0.2, np.inf]))),
    ],
}
