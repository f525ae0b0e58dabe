"""Problems of machines with published optima for `optimisers.py`.

The rod of a slider-crank, ten bars under stresses, displacements and frequencies, a four-bar through 18 points from
the first of 64 starts (it has many local optima), a bracket of five boxes and two bars (Svanberg 1987), a gear box
(Golinski 1970), a weld of a bracket (Rao 1996), a spring (Arora 1989), the tolerances of a toggle press,
whose optimum has a closed form, and the double wishbone of `wishbone_limits.py`, with the least of what these find.
"""

import sys
from pathlib import Path

import jax
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


def _stress_limits(x):
    stress = structures.weight(x)[1]["stress"] / 25e3
    return jnp.concatenate([stress - 1.0, -stress - 1.0])


def _frequencies(x):
    """Of ten bars of areas [cm^2]: least frequencies over those of the modes."""
    return jnp.array([7.0, 15.0, *[20.0] * 6]) / structures.mass(x)[1]["f"] - 1.0


BENDS = np.array([61.0, 37.0, 19.0, 7.0, 1.0])  # of the boxes of the bracket, for its deflection


def _two_bars(x):
    bends = 0.124 * jnp.sqrt(1.0 + x[1] ** 2)
    return jnp.stack([bends * (8.0 / x[0] + s / (x[0] * x[1])) - 1.0 for s in (1.0, -1.0)])


def _gear_box(x):
    """Weight of two shafts and their gears: width, module, teeth, two lengths and two diameters."""
    width, module, teeth, a, b, c, d = x
    gears = 0.7854 * width * module**2 * (3.3333 * teeth**2 + 14.9334 * teeth - 43.0934)
    return gears - 1.508 * width * (c**2 + d**2) + 7.4777 * (c**3 + d**3) + 0.7854 * (a * c**2 + b * d**2)


def _gear_box_limits(x):
    width, module, teeth, a, b, c, d = x
    stress = lambda length, load: jnp.sqrt((745.0 * length / (module * teeth)) ** 2 + load)
    return jnp.stack([
        27.0 / (width * module**2 * teeth), 397.5 / (width * module**2 * teeth**2),
        1.93 * a**3 / (module * teeth * c**4), 1.93 * b**3 / (module * teeth * d**4),
        stress(a, 16.9e6) / (110.0 * c**3), stress(b, 157.5e6) / (85.0 * d**3),
        module * teeth / 40.0, 5.0 * module / width, width / (12.0 * module),
        (1.5 * c + 1.9) / a, (1.1 * d + 1.9) / b,
    ]) - 1.0  # fmt: skip


def _weld(x):
    """Cost of a bar and its weld: leg and length of the weld, height and width of the bar [in]."""
    leg, length, height, width = x
    return 1.10471 * leg**2 * length + 0.04811 * height * width * (14.0 + length)


def _weld_limits(x):
    leg, length, height, width = x
    load, reach, young, shear = 6000.0, 14.0, 30e6, 12e6
    direct = load / (np.sqrt(2.0) * leg * length)
    radius = jnp.sqrt(length**2 / 4.0 + ((leg + height) / 2.0) ** 2)
    polar = 2.0 * np.sqrt(2.0) * leg * length * (length**2 / 12.0 + ((leg + height) / 2.0) ** 2)
    torsion = load * (reach + length / 2.0) * radius / polar
    tau = jnp.sqrt(direct**2 + direct * torsion * length / radius + torsion**2)
    buckling = 4.013 * young * height * width**3 / 6.0 / reach**2
    buckling = buckling * (1.0 - height / (2.0 * reach) * np.sqrt(young / (4.0 * shear)))
    return jnp.stack([
        tau / 13600.0, 6.0 * load * reach / (width * height**2) / 30000.0, leg / width,
        4.0 * load * reach**3 / (young * height**3 * width) / 0.25, load / buckling,
        (0.10471 * leg**2 + 0.04811 * height * width * (14.0 + length)) / 5.0,
    ]) - 1.0  # fmt: skip


def _spring_limits(x):
    """Of wire, coil [in] and turns of a spring: deflection, shear, surge, size."""
    wire, coil, turns = x
    shear = (4.0 * coil**2 - wire * coil) / (12566.0 * (coil * wire**3 - wire**4)) + 1.0 / (5108.0 * wire**2) - 1.0
    return jnp.stack([
        1.0 - coil**3 * turns / (71785.0 * wire**4), shear, 1.0 - 140.45 * wire / (coil**2 * turns),
        (coil + wire) / 1.5 - 1.0,
    ])  # fmt: skip


PRICES = np.array([2.0, 2.0, 5.0])  # of tolerances of 0.1 mm of the links and the bearing of a press
SPREAD = 0.1 / 3.2905  # [mm] deviation of the depth, of which a thousandth passes 0.1 mm


def _toggle(x):
    """Depth [m] of a press of two links, above its bearing."""
    upper, lower, bearing = x
    return bearing + upper * np.cos(0.08) + jnp.sqrt(lower**2 - (upper * np.sin(0.08)) ** 2)


def _press_limits(x):
    """Deviation of the depth, of tolerances [mm] that are three deviations each, over the allowed one."""
    slopes = jax.grad(_toggle)(jnp.array([0.3, 0.4, 0.0]))
    return jnp.stack([jnp.sum((slopes * x / 3.0) ** 2) / SPREAD**2 - 1.0])


def _least_press_cost():
    """In closed form: the cost of each tolerance is stationary with its share of the variance."""
    root = np.sqrt(0.4**2 - (0.3 * np.sin(0.08)) ** 2)
    slopes = np.array([np.cos(0.08) - 0.3 * np.sin(0.08) ** 2 / root, 0.4 / root, 1.0]) / (3.0 * SPREAD)
    return float(np.sum((0.1 * PRICES * slopes) ** (2.0 / 3.0)) ** 1.5)


MACHINES = {
    "rod of a crank": Problem(
        lambda x: _rod(x)[0], [0.3, 0.012], 0.13779112454716813, None, _rod_limits, [0.12, 0.004], [0.5, 0.02]
    ),
    "ten bars": Problem(
        lambda x: structures.weight(x)[0], [20.0, 10.0] * 5, 5060.853660338411, None, _bar_limits, 0.1, INF
    ),
    "ten bars, stress": Problem(
        lambda x: structures.weight(x)[0], [20.0] * 10, 1593.1810,
        None, _stress_limits, 0.1, INF
    ),
    "ten bars, modes": Problem(
        lambda x: structures.mass(x)[0], [20.0] * 10, 532.0298092157224, None, _frequencies, 0.645, 50.0
    ),
    "bracket": Problem(
        lambda x: 0.0624 * jnp.sum(x), [5.0] * 5, 0.0624 * float(np.sum(BENDS**0.25)) ** (4.0 / 3.0), None,
        lambda x: jnp.stack([jnp.sum(BENDS / x**3) - 1.0]), 1.0, 10.0
    ),
    "two bars": Problem(
        lambda x: x[0] * jnp.sqrt(1.0 + x[1] ** 2), [1.5, 0.5], 1.5086524, None, _two_bars, [0.2, 0.1], [4.0, 1.6]
    ),
    "gear box": Problem(
        _gear_box, [3.0, 0.75, 20.0, 7.8, 7.8, 3.4, 5.2], 2994.4710661, None, _gear_box_limits,
        [2.6, 0.7, 17.0, 7.3, 7.3, 2.9, 5.0], [3.6, 0.8, 28.0, 8.3, 8.3, 3.9, 5.5]
    ),
    "weld": Problem(
        _weld, [0.4, 6.0, 9.0, 0.5], 1.724852309, None, _weld_limits, [0.125, 0.1, 0.1, 0.1], [2.0, 10.0, 10.0, 2.0]
    ),
    "spring": Problem(
        lambda x: (x[2] + 2.0) * x[1] * x[0] ** 2, [0.06, 0.5, 8.0], 0.0126652328, None, _spring_limits,
        [0.05, 0.25, 2.0], [2.0, 1.3, 15.0]
    ),
    "18 points": Problem(
        four_bar.distance, np.round(four_bar.first_designs(64)[0], 3).tolist(), four_bar.BEST, None, four_bar.grashof,
        four_bar.LOWER.tolist(), four_bar.UPPER.tolist(),
    ),
    "press": Problem(
        lambda x: jnp.sum(0.1 * PRICES / x), [0.05] * 3, _least_press_cost(), None, _press_limits, 0.005, 0.5
    ),
}  # fmt: skip


def wishbone() -> Problem:
    """The double wishbone.  Its script sets up a process for measurements, so that it is imported when asked for."""
    sys.path.append(str(Path(__file__).parent))  # scripts import each other by name
    import wishbones_side_by_side as one

    limits = lambda z: one.limits(z, jnp.ones(7))
    return Problem(
        one.largest_load, one.START.tolist(), 0.82512879, None, limits, one.LOWER.tolist(), one.UPPER.tolist()
    )
