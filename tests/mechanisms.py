"""The old place of `tests.models`, until no test asks for it."""

from tests.models import *  # noqa: F403
