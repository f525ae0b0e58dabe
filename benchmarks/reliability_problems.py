"""Problems of reliability with reference probabilities, for `reliability.py`.

Source: Rozsas and Slobbe 2019, Repository and black-box reliability challenge (TNO), by their numbers there, with the
references of Fekhari, Baudin, Chabridon and Jebroun 2021, otbenchmark: An open source Python package for benchmarking
and validating uncertainty quantification algorithms.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxmbs.probability import Gumbel, LogNormal, Normal, Uniform, Weibull


class Problem(NamedTuple):
    """Fails where `limit` of the numbers (n,) is zero or less; they are independent; probability: the reference."""

    limit: Callable
    distributions: tuple
    probability: float

    def variables(self) -> dict:
        """The distributions by name."""
        return {f"x{k}": one for k, one in enumerate(self.distributions, 1)}

    def limit_state(self, x: dict):
        """The limit state of a dict of numbers."""
        return self.limit(jnp.stack([x[f"x{k}"] for k in range(1, len(self.distributions) + 1)]))


def least(*values):
    return jnp.min(jnp.stack(values))


def largest(*values):
    return jnp.max(jnp.stack(values))


def _stiffened_panel(x):
    a, b, c, d, e, f, g = x
    top = d**2 - 4.0 * e * f * g**2 + d * (f + 4.0 * e + 2.0 * f * g)
    return 15.59e4 - a * b**3 / (2.0 * c**3) * top / (d * e * (d + f + 2.0 * f * g))


def _three_limits(x):
    strength, a, b, c, d = x
    bent = 0.847 + 0.96 * a + 0.986 * b - 0.216 * c + 0.077 * a**2 + 0.11 * b**2 + 7.0 / 378.0 * c**2
    first = bent - b * a - 0.106 * a * c - 0.11 * b * c
    shear = 84000.0 * strength / jnp.sqrt(b**2 + c**2 - b * c + 3.0 * d**2) - 1.0
    return least(first, shear, 84000.0 * strength / jnp.abs(c) - 1.0)


def _load_paths(x):
    a, b, c, d, load = x
    whole = largest(d - load, least(b - load, c - load))
    return least(a - load, largest(least(b - load / 2.0, c - load / 2.0, d - load / 2.0), whole))


def _corner(x):
    y = jnp.sum(x) / np.sqrt(2.0)
    return 2.5 - y + 0.1 * (x[0] - x[1]) ** 2


def _four_branches(x):
    along, across = (x[0] + x[1]) / np.sqrt(2.0), x[0] - x[1]
    bowl, end = 3.0 + 0.1 * across**2, 7.0 / np.sqrt(2.0)
    return least(bowl - along, bowl + along, end + across, end - across)


def _strip(x):
    across = x[0] - x[1]
    hat, end = 0.2 + 0.6 * across**4, 5.0 / np.sqrt(2.0) - 2.2
    return least(hat - across / np.sqrt(2.0), hat + across / np.sqrt(2.0), end + across, end - across)


def _two_steps(x):
    one = jnp.where(x[0] <= 3.5, 0.85 - 0.1 * x[0], 4.0 - x[0])
    return least(one, jnp.where(x[1] <= 2.0, 2.3 - x[1], 0.5 - 0.1 * x[1]))


def standard(n):
    return (Normal(0.0, 1.0),) * n


def normal(*pairs):
    return tuple(Normal(*pair) for pair in pairs)


_SEVEN = (350.0, 50.8, 3.81, 173.0, 9.38, 33.1, 0.036)
PROBLEMS = {
    "RP8": Problem(
        lambda x: x @ jnp.array([1.0, 2.0, 2.0, 1.0, -5.0, -5.0]),
        (*(LogNormal(120.0, 12.0),) * 4, LogNormal(50.0, 10.0), LogNormal(40.0, 8.0)), 7.897927545598118e-4,
    ),
    "RP14": Problem(
        lambda x: x[0] - 32.0 / (np.pi * x[1] ** 3) * jnp.sqrt(x[2] ** 2 * x[3] ** 2 / 16.0 + x[4] ** 2),
        (Uniform(70.0, 80.0), Normal(39.0, 0.1), Gumbel(1500.0, 350.0), *normal((400.0, 0.1), (250e3, 35e3))),
        7.7285e-4,
    ),
    "RP22": Problem(_corner, standard(2), 4.207305511299618e-3),
    "RP24": Problem(
        lambda x: 2.5 - 0.2357 * (x[0] - x[1]) + 0.00463 * (x[0] + x[1] - 20.0) ** 4, normal((10.0, 3.0)) * 2, 2.86e-3
    ),
    "RP25": Problem(
        lambda x: largest(x[0] ** 2 - 8.0 * x[1] + 16.0, -16.0 * x[0] + x[1] + 32.0), standard(2),
        4.148566293759747e-5,
    ),
    "RP28": Problem(
        lambda x: x[0] * x[1] - 146.14, normal((78064.0, 11710.0), (0.0104, 0.00156)), 1.4532945550025393e-7
    ),
    "RP31": Problem(lambda x: 2.0 - x[1] + 256.0 * x[0] ** 4, standard(2), 3.226681209587691e-3),
    "RP33": Problem(lambda x: least(3.0 * np.sqrt(3.0) - jnp.sum(x), 3.0 - x[2]), standard(3), 2.57e-3),
    "RP35": Problem(
        lambda x: least(2.0 - x[1] + jnp.exp(-0.1 * x[0] ** 2) + (0.2 * x[0]) ** 4, 4.5 - x[0] * x[1]),
        standard(2), 3.47894632e-3,
    ),
    "RP38": Problem(_stiffened_panel, normal(*((mean, 0.1 * mean) for mean in _SEVEN)), 8.1e-3),
    "RP53": Problem(
        lambda x: jnp.sin(2.5 * x[0]) + 2.0 - (x[0] ** 2 + 4.0) * (x[1] - 1.0) / 20.0,
        normal((1.5, 1.0), (2.5, 1.0)), 3.13e-2,
    ),
    "RP54": Problem(lambda x: jnp.sum(x) - 8.951, (Weibull(1.0, 1.0),) * 20, 9.98e-4),
    "RP55": Problem(_strip, (Uniform(-1.0, 1.0),) * 2, 0.5600144282863704),
    "RP57": Problem(
        lambda x: least(
            largest(-(x[0] ** 2) + x[1] ** 3 + 3.0, 2.0 - x[0] - 8.0 * x[1]),
            (x[0] + 3.0) ** 2 + (x[1] + 3.0) ** 2 - 4.0,
        ), standard(2), 2.84e-2,
    ),
    "RP60": Problem(
        _load_paths, tuple(LogNormal(*pair) for pair in ((2200.0, 220.0), (2100.0, 210.0), (2300.0, 230.0),
        (2000.0, 200.0), (1200.0, 480.0))), 4.56e-2,
    ),
    "RP63": Problem(lambda x: 0.1 * jnp.sum(x[1:] ** 2) - x[0] - 4.5, standard(100), 3.79e-4),
    "RP75": Problem(lambda x: 3.0 - x[0] * x[1], standard(2), 9.81929872154689e-3),
    "RP77": Problem(
        lambda x: jnp.where(x[2] <= 5.0, x[0] - x[1] - x[2], x[2] - x[1]),
        normal((10.0, 0.5), (0.0, 1.0), (4.0, 1.0)), 2.87e-7,
    ),
    "RP89": Problem(
        lambda x: least(-(x[0] ** 2) - x[1] + 8.0, -x[0] / 5.0 - x[1] + 6.0), standard(2), 5.43e-3
    ),
    "RP91": Problem(
        _three_limits,
        normal((0.07433, 0.005), (0.1, 0.01), (13.0, 60.0), (4751.0, 48.0), (-684.0, 11.0)), 6.97e-4,
    ),
    "RP107": Problem(lambda x: 5.0 * np.sqrt(10.0) - jnp.sum(x), standard(10), 2.92e-7),
    "RP110": Problem(_two_steps, standard(2), 3.19e-5),
    "RP111": Problem(lambda x: 12.5 - jnp.abs(x[0] * x[1]), standard(2), 7.65e-7),
    "four branches": Problem(_four_branches, standard(2), 2.2227950661944398e-3),
    "R-S": Problem(lambda x: x[0] - x[1], normal((4.0, 1.0), (2.0, 1.0)), 7.864960352514257e-2),
    "stressed beam": Problem(
        lambda x: x[0] - x[1] / (100.0 * np.pi), (LogNormal(300.0, 30.0), Normal(75e3, 5e3)), 2.919819462483095e-2
    ),
}  # fmt: skip
