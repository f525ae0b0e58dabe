"""Problems of Hock and Schittkowski with their published optima, and some without a solution.

Source: Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (1981), by their numbers there.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

INF = np.inf


class Problem(NamedTuple):
    """Minimise `f(x)` subject to `e(x) = 0`, `c(x) <= 0` and bounds; value: the published optimum, or the verdict."""

    f: Callable
    start: list
    value: float | str
    e: Callable | None = None
    c: Callable | None = None
    lower: list | float = -INF
    upper: list | float = INF


def row(*values):
    return jnp.stack(values)


def _colville(x):
    """Objective of problems 38 and, in part, 39."""
    a = 100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2 + 90.0 * (x[3] - x[2] ** 2) ** 2 + (1.0 - x[2]) ** 2
    return a + 10.1 * ((x[1] - 1.0) ** 2 + (x[3] - 1.0) ** 2) + 19.8 * (x[1] - 1.0) * (x[3] - 1.0)


def _hs100(x):
    a = (x[0] - 10.0) ** 2 + 5.0 * (x[1] - 12.0) ** 2 + x[2] ** 4 + 3.0 * (x[3] - 11.0) ** 2 + 10.0 * x[4] ** 6
    return a + 7.0 * x[5] ** 2 + x[6] ** 4 - 4.0 * x[5] * x[6] - 10.0 * x[5] - 8.0 * x[6]


def _hs113(x):
    a = x[0] ** 2 + x[1] ** 2 + x[0] * x[1] - 14.0 * x[0] - 16.0 * x[1] + (x[2] - 10.0) ** 2 + 4.0 * (x[3] - 5.0) ** 2
    b = (x[4] - 3.0) ** 2 + 2.0 * (x[5] - 1.0) ** 2 + 5.0 * x[6] ** 2 + 7.0 * (x[7] - 11.0) ** 2
    return a + b + 2.0 * (x[8] - 10.0) ** 2 + (x[9] - 7.0) ** 2 + 45.0


def _hs113_limits(x):
    return row(
        -105.0 + 4.0 * x[0] + 5.0 * x[1] - 3.0 * x[6] + 9.0 * x[7],
        10.0 * x[0] - 8.0 * x[1] - 17.0 * x[6] + 2.0 * x[7],
        -8.0 * x[0] + 2.0 * x[1] + 5.0 * x[8] - 2.0 * x[9] - 12.0,
        3.0 * (x[0] - 2.0) ** 2 + 4.0 * (x[1] - 3.0) ** 2 + 2.0 * x[2] ** 2 - 7.0 * x[3] - 120.0,
        5.0 * x[0] ** 2 + 8.0 * x[1] + (x[2] - 6.0) ** 2 - 2.0 * x[3] - 40.0,
        0.5 * (x[0] - 8.0) ** 2 + 2.0 * (x[1] - 4.0) ** 2 + 3.0 * x[4] ** 2 - x[5] - 30.0,
        x[0] ** 2 + 2.0 * (x[1] - 2.0) ** 2 - 2.0 * x[0] * x[1] + 14.0 * x[4] - 6.0 * x[5],
        -3.0 * x[0] + 6.0 * x[1] + 12.0 * (x[8] - 8.0) ** 2 - 7.0 * x[9],
    )


ROSENBROCK = lambda x: 100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2
PROBLEMS = {
    "HS1": Problem(ROSENBROCK, [-2.0, 1.0], 0.0, lower=[-INF, -1.5]),
    "HS2": Problem(ROSENBROCK, [-2.0, 1.0], 0.0504261879, lower=[-INF, 1.5]),
    "HS3": Problem(lambda x: x[1] + 1e-5 * (x[1] - x[0]) ** 2, [10.0, 1.0], 0.0, lower=[-INF, 0.0]),
    "HS4": Problem(lambda x: (x[0] + 1.0) ** 3 / 3.0 + x[1], [1.125, 0.125], 8.0 / 3.0, lower=[1.0, 0.0]),
    "HS5": Problem(
        lambda x: jnp.sin(x[0] + x[1]) + (x[0] - x[1]) ** 2 - 1.5 * x[0] + 2.5 * x[1] + 1.0, [0.0, 0.0],
        -np.sqrt(3.0) / 2.0 - np.pi / 3.0, lower=[-1.5, -3.0], upper=[4.0, 3.0],
    ),
    "HS6": Problem(lambda x: (1.0 - x[0]) ** 2, [-1.2, 1.0], 0.0, e=lambda x: row(10.0 * (x[1] - x[0] ** 2))),
    "HS7": Problem(
        lambda x: jnp.log(1.0 + x[0] ** 2) - x[1], [2.0, 2.0], -np.sqrt(3.0),
        e=lambda x: row((1.0 + x[0] ** 2) ** 2 + x[1] ** 2 - 4.0),
    ),
    "HS9": Problem(
        lambda x: jnp.sin(np.pi * x[0] / 12.0) * jnp.cos(np.pi * x[1] / 16.0), [0.0, 0.0], -0.5,
        e=lambda x: row(4.0 * x[0] - 3.0 * x[1]),
    ),
    "HS10": Problem(
        lambda x: x[0] - x[1], [-10.0, 10.0], -1.0,
        c=lambda x: row(3.0 * x[0] ** 2 - 2.0 * x[0] * x[1] + x[1] ** 2 - 1.0),
    ),
    "HS11": Problem(
        lambda x: (x[0] - 5.0) ** 2 + x[1] ** 2 - 25.0, [4.9, 0.1], -8.498464223, c=lambda x: row(x[0] ** 2 - x[1])
    ),
    "HS12": Problem(
        lambda x: 0.5 * x[0] ** 2 + x[1] ** 2 - x[0] * x[1] - 7.0 * x[0] - 7.0 * x[1], [0.0, 0.0], -30.0,
        c=lambda x: row(4.0 * x[0] ** 2 + x[1] ** 2 - 25.0),
    ),
    "HS13": Problem(  # no constraint qualification at the optimum
        lambda x: (x[0] - 2.0) ** 2 + x[1] ** 2, [-2.0, -2.0], 1.0, lower=0.0,
        c=lambda x: row(x[1] - (1.0 - x[0]) ** 3),
    ),
    "HS14": Problem(
        lambda x: (x[0] - 2.0) ** 2 + (x[1] - 1.0) ** 2, [2.0, 2.0], 9.0 - 2.875 * np.sqrt(7.0),
        e=lambda x: row(x[0] - 2.0 * x[1] + 1.0), c=lambda x: row(0.25 * x[0] ** 2 + x[1] ** 2 - 1.0),
    ),
    "HS15": Problem(
        ROSENBROCK, [-2.0, 1.0], 306.5, c=lambda x: row(1.0 - x[0] * x[1], -x[0] - x[1] ** 2), upper=[0.5, INF]
    ),
    "HS22": Problem(
        lambda x: (x[0] - 2.0) ** 2 + (x[1] - 1.0) ** 2, [2.0, 2.0], 1.0,
        c=lambda x: row(x[0] + x[1] - 2.0, x[0] ** 2 - x[1]),
    ),
    "HS24": Problem(
        lambda x: ((x[0] - 3.0) ** 2 - 9.0) * x[1] ** 3 / (27.0 * np.sqrt(3.0)), [1.0, 0.5], -1.0,
        c=lambda x: row(
            x[1] - x[0] / np.sqrt(3.0), -x[0] - np.sqrt(3.0) * x[1], x[0] + np.sqrt(3.0) * x[1] - 6.0
        ), lower=0.0,
    ),
    "HS26": Problem(
        lambda x: (x[0] - x[1]) ** 2 + (x[1] - x[2]) ** 4, [-2.6, 2.0, 2.0], 0.0,
        e=lambda x: row((1.0 + x[1] ** 2) * x[0] + x[2] ** 4 - 3.0),
    ),
    "HS27": Problem(
        lambda x: 0.01 * (x[0] - 1.0) ** 2 + (x[1] - x[0] ** 2) ** 2, [2.0, 2.0, 2.0], 0.04,
        e=lambda x: row(x[0] + x[2] ** 2 + 1.0),
    ),
    "HS28": Problem(
        lambda x: (x[0] + x[1]) ** 2 + (x[1] + x[2]) ** 2, [-4.0, 1.0, 1.0], 0.0,
        e=lambda x: row(x[0] + 2.0 * x[1] + 3.0 * x[2] - 1.0),
    ),
    "HS29": Problem(
        lambda x: -x[0] * x[1] * x[2], [1.0, 1.0, 1.0], -16.0 * np.sqrt(2.0),
        c=lambda x: row(x[0] ** 2 + 2.0 * x[1] ** 2 + 4.0 * x[2] ** 2 - 48.0),
    ),
    "HS33": Problem(
        lambda x: (x[0] - 1.0) * (x[0] - 2.0) * (x[0] - 3.0) + x[2], [0.0, 0.0, 3.0], np.sqrt(2.0) - 6.0,
        c=lambda x: row(x[0] ** 2 + x[1] ** 2 - x[2] ** 2, 4.0 - x @ x), lower=0.0, upper=[INF, INF, 5.0],
    ),
    "HS35": Problem(
        lambda x: 9.0 - 8.0 * x[0] - 6.0 * x[1] - 4.0 * x[2] + 2.0 * x[0] ** 2 + 2.0 * x[1] ** 2 + x[2] ** 2
        + 2.0 * x[0] * x[1] + 2.0 * x[0] * x[2], [0.5, 0.5, 0.5], 1.0 / 9.0,
        c=lambda x: row(x[0] + x[1] + 2.0 * x[2] - 3.0), lower=0.0,
    ),
    "HS38": Problem(_colville, [-3.0, -1.0, -3.0, -1.0], 0.0, lower=-10.0, upper=10.0),
    "HS39": Problem(
        lambda x: -x[0], [2.0, 2.0, 2.0, 2.0], -1.0,
        e=lambda x: row(x[1] - x[0] ** 3 - x[2] ** 2, x[0] ** 2 - x[1] - x[3] ** 2),
    ),
    "HS40": Problem(
        lambda x: -x[0] * x[1] * x[2] * x[3], [0.8, 0.8, 0.8, 0.8], -0.25,
        e=lambda x: row(x[0] ** 3 + x[1] ** 2 - 1.0, x[0] ** 2 * x[3] - x[2], x[3] ** 2 - x[1]),
    ),
    "HS43": Problem(
        lambda x: x[0] ** 2 + x[1] ** 2 + 2.0 * x[2] ** 2 + x[3] ** 2 - 5.0 * x[0] - 5.0 * x[1] - 21.0 * x[2]
        + 7.0 * x[3], [0.0, 0.0, 0.0, 0.0], -44.0,
        c=lambda x: row(
            x @ x + x[0] - x[1] + x[2] - x[3] - 8.0, x[0] ** 2 + 2.0 * x[1] ** 2 + x[2] ** 2 + 2.0 * x[3] ** 2
            - x[0] - x[3] - 10.0, 2.0 * x[0] ** 2 + x[1] ** 2 + x[2] ** 2 + 2.0 * x[0] - x[1] - x[3] - 5.0,
        ),
    ),
    "HS48": Problem(
        lambda x: (x[0] - 1.0) ** 2 + (x[1] - x[2]) ** 2 + (x[3] - x[4]) ** 2, [3.0, 5.0, -3.0, 2.0, -2.0], 0.0,
        e=lambda x: row(jnp.sum(x) - 5.0, x[2] - 2.0 * (x[3] + x[4]) + 3.0),
    ),
    "HS71": Problem(
        lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], [1.0, 5.0, 5.0, 1.0], 17.0140173,
        e=lambda x: row(x @ x - 40.0), c=lambda x: row(25.0 - jnp.prod(x)), lower=1.0, upper=5.0,
    ),
    "HS76": Problem(
        lambda x: x[0] ** 2 + 0.5 * x[1] ** 2 + x[2] ** 2 + 0.5 * x[3] ** 2 - x[0] * x[2] + x[2] * x[3] - x[0]
        - 3.0 * x[1] + x[2] - x[3], [0.5, 0.5, 0.5, 0.5], -4.681818181,
        c=lambda x: row(
            x[0] + 2.0 * x[1] + x[2] + x[3] - 5.0, 3.0 * x[0] + x[1] + 2.0 * x[2] - x[3] - 4.0,
            1.5 - x[1] - 4.0 * x[2],
        ), lower=0.0,
    ),
    "HS77": Problem(
        lambda x: (x[0] - 1.0) ** 2 + (x[0] - x[1]) ** 2 + (x[2] - 1.0) ** 2 + (x[3] - 1.0) ** 4 + (x[4] - 1.0) ** 6,
        [2.0, 2.0, 2.0, 2.0, 2.0], 0.24150513,
        e=lambda x: row(
            x[0] ** 2 * x[3] + jnp.sin(x[3] - x[4]) - 2.0 * np.sqrt(2.0),
            x[1] + x[2] ** 4 * x[3] ** 2 - 8.0 - np.sqrt(2.0),
        ),
    ),
    "HS100": Problem(
        _hs100, [1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0], 680.6300573,
        c=lambda x: row(
            2.0 * x[0] ** 2 + 3.0 * x[1] ** 4 + x[2] + 4.0 * x[3] ** 2 + 5.0 * x[4] - 127.0,
            7.0 * x[0] + 3.0 * x[1] + 10.0 * x[2] ** 2 + x[3] - x[4] - 282.0,
            23.0 * x[0] + x[1] ** 2 + 6.0 * x[5] ** 2 - 8.0 * x[6] - 196.0,
            4.0 * x[0] ** 2 + x[1] ** 2 - 3.0 * x[0] * x[1] + 2.0 * x[2] ** 2 + 5.0 * x[5] - 11.0 * x[6],
        ),
    ),
    "HS113": Problem(_hs113, [2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0], 24.3062091, c=_hs113_limits),
    "infeasible": Problem(
        lambda x: x @ x, [1.0, 1.0], "infeasible", c=lambda x: row(x[0] + x[1] - 1.0, 3.0 - x[0] - x[1])
    ),
    "circle missed": Problem(
        lambda x: x[0], [0.5, 2.0], "infeasible", e=lambda x: row(x @ x - 1.0, x[0] + x[1] - 3.0)
    ),
    "unbounded": Problem(lambda x: x[0], [1.0, 1.0], "unbounded", c=lambda x: row(x[1] - 1.0)),
    "unbounded curve": Problem(lambda x: -x[0] * x[1], [1.0, 2.0], "unbounded", e=lambda x: row(x[0] - x[1])),
    "twice the same": Problem(  # dependent equations
        lambda x: x @ x, [3.0, 1.0], 0.5, e=lambda x: row(x[0] + x[1] - 1.0, 2.0 * x[0] + 2.0 * x[1] - 2.0)
    ),
    "kissing limits": Problem(  # one feasible point, no interior
        lambda x: x[0], [2.0, 2.0], 0.0, c=lambda x: row(x[0] ** 2 + (x[1] - 1.0) ** 2 - 1.0, x[0] ** 2
        + (x[1] + 1.0) ** 2 - 1.0),
    ),
}  # fmt: skip
