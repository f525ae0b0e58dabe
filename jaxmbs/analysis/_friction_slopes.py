"""Slopes of the friction of joints, by velocities and by efforts, and the joints that stick."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..dynamics._efforts import efforts
from ..dynamics._joint_friction import friction_loads
from ..dynamics._loads import Loads, on_columns
from ..dynamics._newton_euler import motion_with_friction
from ..errors import ModelError
from ..friction._groups import values_of
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._slips import slips_of
from ..kinematics._wrench_targets import node_targets
from ..math._nan import nan_where
from ..runtime import jit


def loads_with_friction(system, at, tau=None):
    """Loads on nodes (nodes, 6) and columns (nv,) of force elements and, in the motion that they make together with
    the efforts tau (nv,), of the friction of joints."""
    F, Q = efforts(system, at)[:2]
    if system.friction is None:
        return F, Q
    found = motion_with_friction(system, at, loads=(F, Q if tau is None else Q + tau))
    both = Loads(F, Q) + friction_loads(system, found, node_targets(system))
    return both.wrench, both.column


def friction_slopes(system, at, velocities, Gamma):
    """Efforts of the friction on the independent velocities: minus their slopes (N, N) by these, and their slopes
    (N, nv) by efforts on all columns."""

    def of(w, tau):
        here = with_velocities(system, at, velocities + Gamma @ w)
        F, Q = loads_with_friction(system, here, tau)
        own_F, own_Q = efforts(system, here)[:2]
        return Gamma.T @ (on_columns(system, here, Loads(F - own_F)) + Q - own_Q)

    none = jnp.zeros(Gamma.shape[1], Gamma.dtype), jnp.zeros(len(Gamma), Gamma.dtype)
    by_velocity, by_effort = jax.jacfwd(of, (0, 1))(*none)
    return -by_velocity, by_effort


@jit
def _sticking(system, state):
    f = system.friction
    at = with_velocities(system, at_state(system, state), state.velocities)
    return slips_of(system, at).square < values_of(f.models, _stick_speed, at.u.dtype) ** 2


def _stick_speed(model):
    """Slip below which a surface counts as stuck [m/s], zero for one that does not rub or has bristles."""
    if model.has_bristles:
        return 0.0
    if model.breakaway is None:
        return model.creep_speed
    return jnp.where((model.breakaway > 0.0) | (model.breakaway_drag > 0.0), model.creep_speed, 0.0)


def nan_at_stick(system, state, found):
    """The same pytree, not a number where a joint sticks."""
    stick = jnp.any(_sticking(system, state))
    return jax.tree.map(lambda x: nan_where(stick, x) if eqx.is_inexact_array(x) else x, found)


def refuse_stick(system, state, driven):
    """Raises: ModelError for joints that stick, where that can be seen, and for inputs that are driven joints."""
    if driven:
        raise ModelError(
            [
                f"input {name!r} is a driven joint: not beside friction in joints; leave the drive out and take the "
                "joint's effort as input"
                for name in driven
            ],
            "the question",
        )
    stick = _sticking(system, state)
    if is_concrete(stick) and np.any(np.asarray(stick)):
        f = system.friction
        names = dict.fromkeys(system.topology.joints[f.joints[k]].name for k in np.flatnonzero(np.asarray(stick)))
        raise ModelError(
            [
                f"joint {name!r} sticks: it slips slower than the transition speed of its friction, where the slope "
                "is that of creep; linearise at a state that slides, give it friction.LuGre(...), whose bristles "
                "have a stiffness, or build without its friction"
                for name in names
            ],
            "the question",
        )
