"""Stresses of steep laws as unknowns of their own in Newton's method.

Turning a thin element stretches it to second order: its tension, times what a step turns it by, would hide its
bending in the slope, and the more the thinner it is.  So the slope is taken with the stresses that the step before
predicts, to first order, not with those of its end; where the search ends both are the same.

Source: Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech. Eng. 313 (2017) 986-1005, mixed integration points.
"""

from typing import Any

import jax
import jax.numpy as jnp

from ..kinematics._configuration import Configuration, at_rest
from ..kinematics._element_flows import element_flows
from ..model._internal_states import replace_field
from ..model._system import System


def steep_groups(system: System) -> tuple[int, ...]:
    """Places of the groups whose law is far stiffer along some directions than along others."""
    return tuple(k for k, group in enumerate(system.forces) if group.law.is_steep)


def is_steep(system: System) -> bool:
    """True if the system has such laws."""
    return bool(steep_groups(system))


def own_stresses(system: System) -> tuple:
    """NaN in the shape of the stresses, which says that laws take their own."""
    laws: list[Any] = [system.forces[k].law for k in steep_groups(system)]
    return tuple(jnp.full_like(law.screw, jnp.nan) for law in laws)


def given_or_own(given: tuple, own: tuple) -> tuple:
    """The given stresses, where they are not NaN."""
    return tuple(jnp.where(jnp.isnan(x), y, x) for x, y in zip(given, own, strict=True))


def under_stresses(system: System, given: tuple) -> System:
    """The system whose steep laws are under given stresses."""
    for k, stress in zip(steep_groups(system), given, strict=True):
        group = system.forces[k]
        law: Any = group.law
        changed = replace_field(group, "law", law.under(stress))
        system = replace_field(system, "forces", (*system.forces[:k], changed, *system.forces[k + 1 :]))
    return system


def stresses_at(system: System, at: Configuration) -> tuple:
    """Stresses (n, k) of each group of steep laws at a configuration."""
    if not steep_groups(system):
        return ()
    still, found = at_rest(system, at), []
    for k in steep_groups(system):
        group = system.forces[k]
        displacement = element_flows(system, group, at, still.V, still.u)[1]
        found.append(jax.vmap(lambda law, x: law.stress(*x))(group.law, displacement))
    return tuple(found)
