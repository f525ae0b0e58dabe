"""Laws of force elements at an instant."""

from collections.abc import Iterator
from typing import Any

from ..forces._implicit_law import ImplicitLaw
from ..forces._law_at import LawAt
from ..kinematics._configuration import Configuration
from ..model._system import ForceGroup, System
from ._signals import with_driven_fields


def acting_laws(system: System, at: Configuration) -> Iterator[tuple[ForceGroup, Any]]:
    """Every group of force elements with its law at the internal states and signals of a configuration: one of
    (x, v, t)."""
    for k, group in enumerate(system.forces):
        yield group, law_at(group, k, at)


def law_at(group: ForceGroup, k: int, at: Configuration) -> Any:
    """The law of the k-th group of force elements at the internal states and signals of a configuration."""
    law = group.law if at.signals is None else with_driven_fields(group.law, at.signals.driven[k])
    if at.s is None or not group.internal:
        return law
    s, step = at.s.laws[k], None if at.s.steps is None else at.s.steps[k]
    return LawAt(law, s) if step is None else ImplicitLaw(law, s, step)
