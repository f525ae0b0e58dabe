"""Answers of force elements and rows to a question at an instant, such as their margins, results or arrows."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import Array

from ..constraints._rows import at_frames
from ..forces import PathKinematics
from ..kinematics._configuration import VelocityKinematics
from ..kinematics._element_flows import element_flows
from ..kinematics._poses import frame_twists
from ..model._system import System
from ..signal_flow._acting_laws import acting_laws
from ._newton_euler import accelerations


class Answers(NamedTuple):
    """Answers of the elements of a group, stacked (n, ...).

    `reference` are axes (n, 3, 3) and places (n, 3), from the common origin, of what they say in space; None where it
    was not asked for.
    """

    names: tuple[str, ...]
    values: Any
    reference: tuple[Array, Array] | None


def force_answers(
    system: System, at: VelocityKinematics, has: Callable, ask: Callable, in_space: bool = False
) -> Iterator[Answers]:
    """Answers of force elements.

    Args:
        has: true for laws that have an answer; ask: the answer of a law to the arguments of its effort.
        in_space: true for points and vectors, which need their axes.
    """
    for group, law in acting_laws(system, at):
        if not has(group.law):
            continue
        seen, x, flow = element_flows(system, group, at, at.V, at.u)

        def of_one(law, x, flow, port=group.port):
            law, arguments = port.law_and_arguments(law, x, flow)
            return ask(law)(*arguments, at.t)

        values = jax.vmap(of_one)(law, x, flow)
        yield Answers(group.names, values, jax.vmap(group.port.reference)(*seen) if in_space else None)


def row_answers(
    system: System, at: VelocityKinematics, has: Callable, ask: Callable, multipliers: Array | None = None
) -> Iterator[Answers]:
    """Answers of rows on frames, such as inextensible cables, to the motion of their frames and their loads.

    Args: multipliers: (rows,) of the motion, where they are found already.
    """
    groups = [group for group in system.rows if has(group.law)]
    if not groups:
        return
    multipliers = accelerations(system, at)[1] if multipliers is None else multipliers
    twist = frame_twists(system, at.V)

    def of_one(law, R, x, V, loads):
        return ask(law)(PathKinematics.of_twists(R, x, V), loads)

    for group in groups:
        R, x, V = at_frames(group, at.R, at.x, twist)
        yield Answers(group.names, jax.vmap(of_one)(group.law, R, x, V, multipliers[np.array(group.places)]), None)
