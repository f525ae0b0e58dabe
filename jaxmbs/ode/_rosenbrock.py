"""A Rosenbrock method for diffrax: implicit by one matrix of slopes a step, without iterations."""

from typing import Any, ClassVar

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import PyTree

from ..math import _square as square
from ..typing import ScalarLike

# Coefficients of G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the
# Julia Differential Equations package, BIT 63:27 (2023), for the unknowns u = k Gamma / h of a step: stages at
# y0 + sum a_ij u_j, with sum c_ij u_j / h on their right sides.
_GAMMA = 0.21193756319429014
_A_ROWS = (
    (),
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946),
)
_C_ROWS = (
    (),
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
    (
        30.91273214028599,
        -3.1208243349937974,
        77.79954646070892,
        34.28646028294783,
        -19.097331116725623,
        -28.087943162872662,
    ),
    (
        37.80277123390563,
        -3.2571969029072276,
        112.26918849496327,
        66.9347231244047,
        -40.06618937091002,
        -54.66780262877968,
        -9.48861652309627,
    ),
)
_NODES = np.array([0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1, 1, 1])
_OF_TIME = np.array(  # weights of the slope in time
    [_GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0]
)
_DENSE = np.array(
    [
        [
            25.948786856663858,
            -2.5579724845846235,
            10.433815404888879,
            -2.3679251022685204,
            0.524948541321073,
            1.1241088310450404,
            0.4272876194431874,
            -0.17202221070155493,
        ],
        [
            -9.91568850695171,
            -0.9689944594115154,
            3.0438037242978453,
            -24.495224566215796,
            20.176138334709044,
            15.98066361424651,
            -6.789040303419874,
            -6.710236069923372,
        ],
        [
            11.419903575922262,
            2.8879645146136994,
            72.92137995996029,
            80.12511834622643,
            -52.072871366152654,
            -59.78993625266729,
            -0.15582684282751913,
            4.883087185713722,
        ],
    ]
)


def _lower(rows):
    """A matrix (8, 8) of the rows below its diagonal."""
    matrix = np.zeros((8, 8))
    for k, row in enumerate(rows):
        matrix[k, : len(row)] = row
    return matrix


_A, _C = _lower((*_A_ROWS, (*_A_ROWS[-1], 1.0), (*_A_ROWS[-1], 1.0, 1.0))), _lower(_C_ROWS)
_END = np.array([*_A_ROWS[-1], 1.0, 1.0, 1.0])  # the last stage is the error of the end


class RodasInterpolation(diffrax.AbstractLocalInterpolation):
    """The fourth-order polynomial of a step."""

    t0: Any  # type: ignore[misc]
    t1: Any  # type: ignore[misc]
    y0: PyTree
    y1: PyTree
    k: PyTree

    def evaluate(self, t0: ScalarLike, t1: ScalarLike | None = None, left: bool = True) -> PyTree:
        """The state at a time, or its change between two."""
        if t1 is not None:
            return jax.tree.map(jnp.subtract, self.evaluate(t1), self.evaluate(t0))
        length = self.t1 - self.t0
        s = (t0 - self.t0) / jnp.where(length == 0.0, 1.0, length)

        def at(y0, y1, k):
            return (1.0 - s) * y0 + s * (y1 + (1.0 - s) * (k[0] + s * (k[1] + s * k[2])))

        return jax.tree.map(at, self.y0, self.y1, self.k)


class Rodas5P(diffrax.AbstractAdaptiveSolver):
    """Rosenbrock method of order 5 for stiff systems, with adaptive or fixed steps: A-stable, stiffly accurate.

    A step takes the matrix of slopes of the rates once, by forward derivatives, and solves eight linear systems with
    it: no iterations that may fail, and several times cheaper than a step of `diffrax.Kvaerno5` of the same error.
    It is for mechanisms of up to some dozens of velocities, as the matrix is dense.

    Source: G. Steinebach, BIT Numerical Mathematics 63:27 (2023).
    """

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar = RodasInterpolation

    def order(self, terms: PyTree) -> int:
        return 5

    def init(self, terms: PyTree, t0: ScalarLike, t1: ScalarLike, y0: PyTree, args: PyTree) -> None:
        return None

    def func(self, terms: PyTree, t0: ScalarLike, y0: PyTree, args: PyTree) -> PyTree:
        return terms.vf(t0, y0, args)

    def step(
        self,
        terms: PyTree,
        t0: ScalarLike,
        t1: ScalarLike,
        y0: PyTree,
        args: PyTree,
        solver_state: None,
        made_jump: Any,
    ) -> tuple:
        """The quadratures in y = (positions, second half, quadratures) change no rate, so they are no unknowns."""
        del solver_state, made_jump
        psi, p, work = y0
        h, x0, n = terms.contr(t0, t1), jnp.concatenate([psi, p]), psi.size
        A, C, nodes, of_time = (jnp.asarray(x, x0.dtype) for x in (_A, _C, _NODES, _OF_TIME))

        def rates(t, x):
            psi_dot, p_dot, power = terms.vf(t, (x[:n], x[n:], work), args)
            return jnp.concatenate([psi_dot, p_dot, power])

        t0 = jnp.asarray(t0, x0.dtype)
        by_time, slopes = _slopes(rates, t0, x0)
        matrix = jnp.eye(x0.size, dtype=x0.dtype) / (h * _GAMMA) - slopes[: x0.size]
        solve = square.solver(matrix)

        def stage(U, row):
            k, a, c, node, weight = row
            right = rates(t0 + node * h, x0 + a @ U[:, : x0.size]) + c @ U / h + h * weight * by_time
            u = solve(right[: x0.size])
            quadratures = h * _GAMMA * (right[x0.size :] + slopes[x0.size :] @ u)
            return U.at[k].set(jnp.concatenate([u, quadratures])), None

        U = jnp.zeros((8, x0.size + work.size), x0.dtype)
        U, _ = lax.scan(stage, U, (np.arange(8), A, C, nodes, of_time))

        def parts(x):
            return x[..., :n], x[..., n : x0.size], x[..., x0.size :]

        y1 = jax.tree.map(jnp.add, y0, parts(jnp.asarray(_END, x0.dtype) @ U))
        dense = {"y0": y0, "y1": y1, "k": parts(jnp.asarray(_DENSE, x0.dtype) @ U)}
        return y1, parts(U[-1]), dense, None, diffrax.RESULTS.successful


def _slopes(rates, t, x):
    """Derivatives of the rates (m,) by time (m,) and by x (m, n)."""
    unit = np.eye(1 + x.size, dtype=x.dtype)
    found = jax.vmap(lambda e: jax.jvp(rates, (t, x), (e[0], e[1:]))[1])(unit)
    return found[0], found[1:].T
