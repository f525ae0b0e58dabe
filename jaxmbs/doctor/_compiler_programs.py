"""Small programs as users write them, beside the same in NumPy: what a compiler must not get wrong.

Each is a function that makes its input from a random generator, one of arrays in JAX, and one of arrays in NumPy.
Lanes are as many as a batch of designs has: faults of XLA have begun at 16 384 of them.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..runtime import small_call

LANES = 20_000
MATRIX = np.arange(9.0).reshape(3, 3) - 4.0
FORCE = np.array([3.0, -1.0, 2.0])


class CompilerProgram(NamedTuple):
    """A program in JAX and in NumPy, both functions of an array; its shape; in JAX of one row, if it has rows."""

    shape: tuple[int, ...]
    jax: Callable
    numpy: Callable
    row: Callable | None = None


def _of_rows(shape: tuple[int, ...], row: Callable, numpy: Callable) -> CompilerProgram:
    return CompilerProgram(shape, jax.vmap(row), numpy, row)


def _turn(module, angles):
    """Matrices (..., 3, 3) of rotations about z by angles (...)."""
    c, s, zero = module.cos(angles), module.sin(angles), 0.0 * angles
    rows = [[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]]
    return module.stack([module.stack(row, axis=-1) for row in rows], axis=-2)


def _square_of_constant_product(row):
    return jnp.sum((jnp.asarray(MATRIX) @ row) ** 2)


def _square_of_turned(angle):
    return jnp.sum((_turn(jnp, angle) @ jnp.asarray(FORCE) * angle) ** 2)


def _gradient_of_product(row):
    return jax.grad(lambda row: jnp.sin(jnp.sum(_turn(jnp, row[0]) @ row)))(row)


def _gradient_in_numpy(x):
    c, s = np.cos(x[:, 0]), np.sin(x[:, 0])
    value = c * x[:, 0] - s * x[:, 1] + s * x[:, 0] + c * x[:, 1] + x[:, 2]
    by_turn = (c - s) * x[:, 0] - (c + s) * x[:, 1]
    return np.cos(value)[:, None] * np.stack((by_turn + c + s, c - s, 1 + 0 * s), axis=1)


def _of_seven_axes(x):
    y = x.reshape(5, 4, 1, 5, 1, 4, 5) * jnp.arange(3.0)[:, None, None, None, None] + jnp.arange(2.0)[:, None, None]
    return jnp.sum(jnp.tanh(y).transpose(6, 0, 4, 2, 1, 5, 3), axis=(1, 3, 5)) ** 2


def _of_seven_axes_in_numpy(x):
    y = x.reshape(5, 4, 1, 5, 1, 4, 5) * np.arange(3.0)[:, None, None, None, None] + np.arange(2.0)[:, None, None]
    return np.sum(np.tanh(y).transpose(6, 0, 4, 2, 1, 5, 3), axis=(1, 3, 5)) ** 2


def _scan(x):
    def step(carried, row):
        carried = 0.9 * carried + row
        return carried, jnp.max(carried) - carried

    last, steps = lax.scan(step, jnp.zeros(x.shape[1]), x)
    return steps + last


def _scan_in_numpy(x):
    carried, steps = np.zeros(x.shape[1]), []
    for row in x:
        carried = 0.9 * carried + row
        steps.append(np.max(carried) - carried)
    return np.array(steps) + carried


def _places(size):
    return (np.arange(size) * 7919) % (size // 3)


def _scattered(x):
    places = jnp.asarray(_places(len(x)))
    return jnp.zeros(x.shape).at[places].add(x)[places] - x[places]


def _scattered_in_numpy(x):
    places, found = _places(len(x)), np.zeros(x.shape)
    np.add.at(found, places, x)
    return found[places] - x[places]


def _loop(x):
    """Thirty steps of a pendulum in each lane, as one kernel where the library asks for it."""
    start = (jnp.zeros((), jnp.int32), x, 0.0 * x)

    def step(carried):
        k, angle, speed = carried
        speed = speed - 0.1 * jnp.sin(angle)
        return k + 1, angle + 0.1 * speed, speed

    return small_call(lambda start: lax.while_loop(lambda carried: carried[0] < 30, step, start))(start)[1]


def _loop_in_numpy(x):
    angle, speed = x, 0.0 * x
    for _ in range(30):
        speed = speed - 0.1 * np.sin(angle)
        angle = angle + 0.1 * speed
    return angle


def _solution(x):
    A = x.reshape(-1, 3, 3)
    return jnp.linalg.solve(A @ A.mT + jnp.eye(3), A[..., :1])[..., 0]


def _solution_in_numpy(x):
    A = x.reshape(-1, 3, 3)
    return np.linalg.solve(A @ A.transpose(0, 2, 1) + np.eye(3), A[..., :1])[..., 0]


def _chain_of_products(x):
    A = x.reshape(-1, 3, 3)
    return jnp.einsum("nij,njk,nkl->nil", A, A, A)


def _chain_of_products_in_numpy(x):
    A = x.reshape(-1, 3, 3)
    return A @ A @ A


def _reductions(x):
    return jnp.stack((jnp.max(x, axis=1), jnp.sum(x**2, axis=1), jnp.sum(jnp.abs(x), axis=1) / jnp.min(x, axis=1)))


def _reductions_in_numpy(x):
    return np.stack((np.max(x, axis=1), np.sum(x**2, axis=1), np.sum(np.abs(x), axis=1) / np.min(x, axis=1)))


COMPILER_PROGRAMS = {
    "product with a constant matrix, squared and summed": _of_rows(
        (LANES, 3),
        _square_of_constant_product,
        lambda x: np.sum((x @ MATRIX.T) ** 2, axis=1),
    ),
    "turned force, squared and summed": _of_rows(
        (LANES,), _square_of_turned, lambda x: np.sum((_turn(np, x) @ FORCE * x[:, None]) ** 2, axis=1)
    ),
    "gradient of products": _of_rows((LANES, 3), _gradient_of_product, _gradient_in_numpy),
    "chain of products": CompilerProgram((LANES, 9), _chain_of_products, _chain_of_products_in_numpy),
    "reductions of a row": CompilerProgram((LANES, 7), _reductions, _reductions_in_numpy),
    "sum over a column": CompilerProgram(
        (LANES, 3), lambda x: jnp.sum(x * x[:, :1], axis=0), lambda x: np.sum(x * x[:, :1], axis=0)
    ),
    "fusion of seven axes": CompilerProgram((2000,), _of_seven_axes, _of_seven_axes_in_numpy),
    "scan with stacked outputs": CompilerProgram((200, 40), _scan, _scan_in_numpy),
    "gathers and scatters": CompilerProgram((LANES, 2), _scattered, _scattered_in_numpy),
    "loop of a motion": CompilerProgram((LANES,), _loop, _loop_in_numpy),
    "cumulative sum": CompilerProgram((LANES,), jnp.cumsum, np.cumsum),
    "solutions of small systems": CompilerProgram((2000, 9), _solution, _solution_in_numpy),
}
