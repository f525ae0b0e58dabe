"""The stiffest mode at a state and its cause, in words: why a motion needs so many steps; on the host."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..analysis._linearise import linearise
from ..assembly._state import State
from ..constraints._kic import velocity_map
from ..constraints._mobility import with_mobility_at
from ..dynamics._efforts import element_efforts
from ..kinematics._configuration import at_coordinates, at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._poses import coordinate_rate
from ..model._changes import with_changes
from ..model._system import System
from ..ode._named_solver import is_implicit
from ..runtime import jit
from ..signal_flow._acting_laws import acting_laws
from ..signal_flow._signals import with_signals

#: Rate times mean step [rad] above which stability bounds the step of explicit methods, not accuracy: their
#: regions of stability end at 2.8 to 6, and accuracy asks for less than this.
_STABILITY_BOUND = 1.5
_STIFFNESS_RATIO = 100.0  # of the fastest and the slowest mode, from which a stiff solver pays
_LIGHT = 1e-6  # of the largest inertia of the independent velocities: a body that was given no mass
_NAMED = 0.1  # of the largest entry of a shape: joints that move less are not named


def advise(system: System, state: State, solver: Any) -> str:
    """Advice while a motion from a state runs, and takes long: its stiffest mode, and a solver for it."""
    return describe_stiffest_mode(system, state, np.inf, solver) or "; it has no mode that is much faster than others"


def describe_stiffest_mode(system: System, state: State, step: float, solver: Any = None) -> str:
    """The stiffest mode beside the mean step [s]: its rate, its joints, the force element that causes it, advice that
    the solver (None: not known) has not taken already."""
    system = with_mobility_at(system, state)
    if not system.topology.mobility or not np.isfinite(state.velocities).all():
        return ""
    found = linearise(system, state)
    roots, shapes = np.linalg.eig(np.asarray(found.state_space.A))
    rates = np.abs(roots)
    k = np.argmax(rates)
    rate, shape = float(rates[k]), np.real(shapes[-len(found.names) :, k])
    if not rate > 0.0 or not np.any(shape):
        return ""
    shape = shape / np.max(np.abs(shape))
    names = [name for name, x in zip(found.names, shape, strict=True) if abs(x) > _NAMED]
    cause = _element(system, state, jnp.asarray(shape, found.mass.dtype), rate)
    text = f"; the stiffest mode there, of {', '.join(names)}, has a rate of {rate:.3g} 1/s"
    text += f", caused by force {cause!r}" if cause else ""
    inertia, M = shape @ np.asarray(found.mass) @ shape, np.diagonal(found.mass)
    if inertia < _LIGHT * np.max(M):
        text += f", and moves hardly any inertia ({inertia:.2g}): give the bodies there mass, or weld them"
    if rate * step > _STABILITY_BOUND or rate > _STIFFNESS_RATIO * np.min(rates[rates > 1e-9 * rate]):
        if is_implicit(solver):
            return f"{text}, which {type(solver).__name__} steps over: make it softer, or raise rtol and atol"
        text += "; take a stiff solver (solver=mbs.ode.Rodas5P())"
        return text + " or fixed steps (dt=, mbs.ode.ImplicitMidpoint())"
    return text + "; raise max_steps, or rtol and atol"


def _element(system, state, shape, rate):
    """The force element with more than half of the stiffness and damping in a motion (N,), or None."""
    names = [name for group in system.forces for name in group.names]
    if not names:
        return None
    stiff, damping = map(np.abs, _shares(system, state, shape))
    share = np.asarray(stiff + rate * damping)
    k = int(np.argmax(share))
    return names[k] if share[k] > 0.5 * np.sum(share) else None


@jit(compile="tape")
def _shares(system, state, shape):
    """`z . K z` and `z . C z` of every force element along the velocities of an independent motion (N,)."""
    system = with_changes(system, state)
    at = at_state(system, state, inertias=False)
    z = velocity_map(system, at)[0] @ shape

    def power(psi, u):
        here = with_signals(system, with_velocities(system, at_coordinates(system, at, psi), u))
        found = []
        for group, law in acting_laws(system, here):
            _, displacement, flow = element_flows(system, group, here, here.V, here.u)
            found.append(jnp.sum(element_efforts(group, law, displacement, flow, here.t) * flow, axis=1))
        return jnp.concatenate(found)

    along = coordinate_rate(system.topology, at.psi, z)
    slope = jax.jvp(lambda psi: power(psi, z), (at.psi,), (along,))[1]
    return -slope, -(power(at.psi, z) + power(at.psi, -z)) / 2.0
