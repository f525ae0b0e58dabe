"""Limits of joints as bump stops."""

from collections.abc import Mapping

import numpy as np

from ...builder import SystemBuilder
from ...forces import BumpStop
from ._imported import JointLimits, count_nouns


def _bounded_joints(limits):
    return {name: held for name, held in limits.items() if np.isfinite(held.lower) or np.isfinite(held.upper)}


def add_stops(builder: SystemBuilder, limits: Mapping[str, JointLimits], stiffness: float | None) -> None:
    """A force "joint.stop" for every joint with an end of its stroke, none where the stiffness is None."""
    for name, held in {} if stiffness is None else _bounded_joints(limits).items():
        builder.force(f"{name}.stop", BumpStop(stiffness, held.lower, held.upper), joint=name)


def describe_ignored_limits(limits: Mapping[str, JointLimits], stiffness: float | None) -> list[str]:
    """Sentences on joint limits that have no stops."""
    number = len(_bounded_joints(limits))
    if stiffness is not None or not number:
        return []
    return [f"limits of {count_nouns(number, 'joint')}: they hold nothing back unless stops= gives their stiffness"]
