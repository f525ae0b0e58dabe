"""Small batched products as sums: the same numbers, wherever in a program they stand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from jax.extend.core import jaxpr_as_fun

from jaxmbs.math._linalg import saddle_solve, small_matmul
from jaxmbs.runtime._jaxpr import equations
from jaxmbs.runtime._small_call import MARKING, small_call
from jaxmbs.runtime._small_products import expand_small_products

RANDOM = np.random.default_rng(4)
M = RANDOM.normal(size=(5, 3, 3))


def products(jaxpr):
    return [equation for equation in equations(jaxpr) if equation.primitive.name == "dot_general"]


def both(function, *args):
    """(values, values with sums, products that are left)."""
    program = jax.make_jaxpr(function)(*args)
    changed = expand_small_products(program)
    assert products(program)
    return jaxpr_as_fun(program)(*args), jax.jit(jaxpr_as_fun(changed))(*args), products(changed)


@pytest.mark.parametrize(
    ("subscripts", "shapes"),
    [
        ("bij,bjk->bik", ((5, 2, 3), (5, 3, 4))),
        ("bij,bkj->bik", ((5, 2, 3), (5, 4, 3))),
        ("bji,jbk->bik", ((5, 3, 2), (3, 5, 4))),
        ("bj,bj->b", ((5, 3), (5, 3))),
        ("b,bkl->bkl", ((5,), (5, 2, 3))),
        ("bcijm,cbkmj->bcik", ((5, 2, 3, 2, 4), (2, 5, 2, 4, 2))),
    ],
)
@pytest.mark.parametrize("dtype", [float, complex, np.float32])
def test_every_arrangement(subscripts, shapes, dtype):
    args = [jnp.asarray(RANDOM.normal(size=shape), dtype) for shape in shapes]
    (found,), (summed,), left = both(lambda A, B: jnp.einsum(subscripts, A, B), *args)
    assert not left and summed.dtype == found.dtype
    rounding = 20.0 * np.finfo(dtype).eps
    np.testing.assert_allclose(summed, found, rtol=rounding, atol=rounding)


def in_loops(A):
    """Products in a scan, a loop by a condition, a branch, a call, a rule and a solve."""
    x = lax.scan(lambda x, _: (A @ x, None), A, None, 3)[0]
    x = lax.while_loop(lambda c: c[0] < 3, lambda c: (c[0] + 1, A @ c[1]), (0, x))[1]
    x = lax.cond(jnp.sum(x) > 0.0, lambda x: A @ x, lambda x: x @ A, x)
    x = jax.checkpoint(jax.jit(lambda x: x @ A))(x)
    H = A @ A.T + np.eye(3)
    return small_matmul(x, A), *saddle_solve(H, A[:1], x[0], x[1, :1])


@pytest.mark.long
@pytest.mark.parametrize("function", [in_loops, lambda A: jax.jvp(in_loops, (A,), (A.T,))[1]])
def test_inside_of_loops_and_calls(function):
    A = jnp.asarray(M) / 3.0
    found, summed, left = both(jax.vmap(function), A)
    assert not [p for p in left if p.params["dimension_numbers"][1][0]]
    for a, b in zip(found, summed, strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-11, atol=1e-13)


def test_a_marked_loop_keeps_its_products():
    def loop(A):
        return small_call(lambda x: lax.fori_loop(0, 3, lambda _, x: A @ x, x))(A)

    with MARKING(True):
        _, _, left = both(jax.vmap(loop), jnp.asarray(M))
    assert len(left) == 1
    assert not both(jax.vmap(loop), jnp.asarray(M))[2]


@pytest.mark.parametrize(
    ("function", "args"),
    [
        (lambda A, B: A @ B, (M[0], M[1])),  # one product
        (lambda A, B: A @ B, (np.ones((3, 9, 8)), np.ones((3, 8, 9)))),  # large ones
        (lambda A, B: A @ B, (np.ones((3, 2, 2), int), np.ones((3, 2, 2), int))),
    ],
)
def test_others_stay(function, args):
    (found,), (same,), left = both(function, *args)
    assert len(left) == 1
    np.testing.assert_array_equal(same, found)
