"""The old place of `tests.models`, until no test asks for it."""

from tests.models import (  # noqa: F401
    DOWN_Y,
    LENGTHS,
    PIN,
    OnCart,
    bennett,
    closed_chain,
    four_bar,
    four_bar_angles,
    four_bar_state,
    rotation_about,
    slopes,
)
