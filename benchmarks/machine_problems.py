"""Problems of machines with published optima for `optimisers.py`: the rod of a slider-crank, ten bars, a four-bar
through 18 points from the first of 64 starts: it has many local optima."""

import jax.numpy as jnp
import numpy as np

from tests.cases import test_four_bar_through_18_points as four_bar
from tests.design import test_working_set as structures

from .hock_schittkowski import INF, Problem


def _rod(x):
    """Mass [kg] of the rod of length and diameter [m], and its answers."""
    return structures.rod_over_a_turn({"length": x[0], "diameter": x[1]})


def _rod_limits(x):
    answers = _rod(x)[1]
    return jnp.concatenate([answers["pin"] / 8000.0 - 1.0, answers["buckling"] - 1.0])


def _bar_limits(x):
    """Of ten bars of areas [in^2]: stresses and displacements."""
    answers = structures.weight(x)[1]
    parts = jnp.concatenate([answers["stress"] / 25e3, jnp.ravel(answers["displacements"]) / 2.0])
    return jnp.concatenate([parts - 1.0, -parts - 1.0])


MACHINES = {
    "rod of a crank": Problem(
        lambda x: _rod(x)[0], [0.3, 0.012], 0.13779112454716813, None, _rod_limits, [0.12, 0.004], [0.5, 0.02]
    ),
    "ten bars": Problem(
        lambda x: structures.weight(x)[0], [20.0, 10.0] * 5, 5060.853660338411, None, _bar_limits, 0.1, INF
    ),
    "18 points": Problem(
        four_bar.distance, np.round(four_bar.first_designs(64)[0], 3).tolist(), four_bar.BEST, None, four_bar.grashof,
        four_bar.LOWER.tolist(), four_bar.UPPER.tolist(),
    ),
}  # fmt: skip
