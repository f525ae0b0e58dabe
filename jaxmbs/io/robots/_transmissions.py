"""Places where scalar laws of a file act: a joint, the coordinate of a fixed tendon, the length of a path."""

from typing import NamedTuple

from ...builder import SystemBuilder
from ...forces import AbstractScalarLaw


class Transmission(NamedTuple):
    """A joint of one coordinate, or the elements of a path; neither where a law cannot act, with the reason why."""

    joint: str | None = None
    path: tuple = ()
    reason: str = ""

    def add(self, builder: SystemBuilder, name: str, law: AbstractScalarLaw) -> None:
        """Declare a law here."""
        if self.path:
            builder.cable(name, self.path, law=law)
        else:
            builder.force(name, law, joint=self.joint)
