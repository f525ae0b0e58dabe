"""Reference values of the slider-crank: closed-form inverse dynamics of the textbooks (Norton; Shigley).

The closed form was confirmed by a planar simulation in absolute coordinates with a driving constraint (reactions
within 2e-9 N), and the free run by Eksergian's equation of the effective inertia (within 2e-12).
"""

from typing import NamedTuple

SOURCE = "closed-form slider-crank inverse dynamics (Norton, Shigley)"
TIMES = (0.0, 0.02, 0.05, 0.1)  # [s]


class Reference(NamedTuple):
    """One quantity at `TIMES`, (4, components), with the deviation allowed."""

    label: str
    unit: str
    values: tuple[tuple[float, ...], ...]
    tolerance: float


LOADS = {
    "main": Reference(
        "main bearing x, y",
        "N",
        (
            (-2055.2265757835958, 0.19606482662214297),
            (285.6049575801878, -584.6498589252576),
            (1837.2954307127475, -190.8099724017561),
            (-1053.541804271849, 248.3420401289314),
        ),
        1e-5,
    ),
    "crank_pin": Reference(
        "crank pin x, y",
        "N",
        (
            (-1847.9878521329465, 76.04319184606851),
            (323.847564732742, -374.69566967785414),
            (1618.8298435540896, -148.75087332861006),
            (-910.7359071847563, 62.69803042883427),
        ),
        1e-5,
    ),
    "wrist": Reference(
        "wrist pin x, y",
        "N",
        (
            (-1076.9424845363983, 202.45507021181245),
            (340.6889324902493, -24.772020932181583),
            (991.040398717245, -78.65237487336665),
            (-454.5445590297012, -246.70865240466094),
        ),
        1e-5,
    ),
    "guide": Reference(
        "guide",
        "N",
        ((-173.02507021181245,), (54.20202093218158,), (108.08237487336666,), (276.13865240466095,)),
        1e-5,
    ),
    "torque": Reference(
        "driving torque",
        "N m",
        ((119.26532232955927,), (-57.27315315786412,), (-37.28822083656242,), (-99.03818566467768,)),
        1e-6,
    ),
    "shaking": Reference(
        "shaking force x, y",
        "N",
        (
            (2255.2265757835958, 233.65100538519033),
            (-85.60495758018779, 591.2698379930761),
            (-1637.2954307127475, 143.54959752838946),
            (1253.541804271849, -463.65869253359233),
        ),
        1e-5,
    ),
}

FREE_TIMES = (0.1, 0.25, 0.5, 1.0)  # [s], of the free run: no torque, no gas force
FREE_ANGLE = (0.6795678819016574, 0.6343730906807451, -1.1325023760573416, -3.615675498623736)  # [rad]
FREE_TOLERANCE = 1e-7
