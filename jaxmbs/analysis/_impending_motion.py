"""Impending motion: the band of holding efforts within which the friction of joints keeps a mechanism at rest."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from ..assembly._state import State
from ..checks import distinct_names
from ..dynamics._efforts import efforts
from ..dynamics._joint_friction import rubbing, solve_friction
from ..dynamics._shared_loads import wrenches_lacking
from ..errors import ModelError
from ..friction import BearingFriction
from ..friction._groups import ModelGroup, values_of
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._slips import slips_of
from ..kinematics._wrench_targets import node_targets
from ..math._nan import nan_where
from ..model._changes import with_changes
from ..model._entry_points import check_single_state
from ..model._internal_states import replace_field
from ..model._system import System
from ..quantities import Quantity, along_freedoms
from ..reaction._inverse_dynamics import ROUNDING_TOLERANCE, actuated_columns, balance_efforts, tree_efforts
from ..reaction._without_drives import without_drives
from ..reports import Report, Reported, failures
from ..runtime import jit

#: Part of the largest slip at which friction has its full value.
_FULL = 1e-9


class ImpendingMotion(Reported, eqx.Module):
    """Limits of the efforts that hold a mechanism at rest, by name of the actuators (n,) [N or N m].

    Attributes:
        forward: efforts at which it starts along the velocities of the state, such as those that raise a load.
        backward: efforts at which it starts against them, such as those at which a load begins to sink.
        frictionless: efforts in balance without friction in the joints.
        efficiency: () power of the frictionless efforts over that of the forward ones, of a slow motion.
        self_locking: () true where it rests without the actuators.
        ok: () true where both limits exist: the loads of the joints are unique, and the actuators balance them; a
            limit that does not exist is NaN.
    """

    forward: dict[str, Float[Array, " n"]]
    backward: dict[str, Float[Array, " n"]]
    frictionless: dict[str, Float[Array, " n"]]
    efficiency: Float[Array, ""]
    self_locking: Bool[Array, ""]
    ok: Bool[Array, ""]

    def report(self) -> Report:
        limits = {"forward": self.forward, "backward": self.backward, "frictionless": self.frictionless}
        found = [along_freedoms(f"{way} {name}", effort) for way, by in limits.items() for name, effort in by.items()]
        verdicts = [Quantity("efficiency", self.efficiency), Quantity("self-locking", self.self_locking)]
        return Report([*found, *verdicts], fault=failures(self.ok, "a limit does not exist"))


def impending_motion(system: System, state: State, actuators: Sequence[str]) -> ImpendingMotion:
    """The band of holding efforts at a pose, between motion that impends along the velocities of a state and against
    them; friction is at its `breakaway` value at every joint that would slip.

    Args:
        state: one State; its velocities give the direction alone, `State.at(system, velocities={"screw": 1.0})`.
        actuators: names of joints whose efforts replace all drives.

    Raises: ModelError for a system without friction in its joints, for a state without velocities, and as
    `inverse_dynamics` for its actuators.
    """
    check_single_state(system, state)
    if system.friction is None:
        raise ModelError(
            ["no joint rubs: declare friction by SystemBuilder.friction(name, joint, mu)"], "the question"
        )
    actuators = distinct_names("actuators", actuators)
    columns = actuated_columns(system, actuators)
    speed = state.velocities
    if not isinstance(speed, jax.core.Tracer) and not np.any(np.asarray(speed)):
        raise ModelError(
            ["the state is at rest, so that no motion impends: give velocities= in the direction of motion"],
            "impending_motion",
        )
    forward, backward, frictionless, ok = _limits(system, state, columns)
    own = jnp.concatenate([speed[a:b] for a, b in columns])
    power, against = jnp.sum(forward * own), jnp.sum(backward * own)
    ends = np.cumsum([0, *(b - a for a, b in columns)])

    def named(values):
        return {name: values[a:b] for name, a, b in zip(actuators, ends[:-1], ends[1:], strict=True)}

    locks = (power >= 0.0) & (against <= 0.0)
    parts = named(forward), named(backward), named(frictionless)
    return ImpendingMotion(*parts, jnp.sum(frictionless * own) / power, locks, ok)


@jit
def _limits(system, state, columns):
    here = without_drives(with_changes(system, state))
    none = jnp.zeros_like(state.velocities)
    rest = with_velocities(here, at_state(here, state), none)
    loads = efforts(here, rest)[:2]
    need = tree_efforts(here, rest, none, loads)
    plain, least = balance_efforts(here, rest, need, columns), ROUNDING_TOLERANCE[need.dtype.itemsize]

    def limit(sign):
        moving = with_velocities(here, rest, sign * state.velocities)
        rub = rubbing(_at_breakaway(here, moving), moving)
        every = jnp.concatenate([need[None], -rub.efforts])
        held = jax.vmap(lambda b: balance_efforts(here, rest, b, columns).multipliers)(every)
        a = jnp.zeros((len(every), len(none)), need.dtype)
        lack = wrenches_lacking(here, rest, node_targets(here), a[:1], loads[0], len(held))
        found = solve_friction(here, rest, rub, lack, a[:1], held)
        balance = balance_efforts(here, rest, need - jnp.sum(found.efforts, axis=0), columns)
        exists = found.loads.unique & (balance.gap <= least)
        return nan_where(~exists, balance.efforts), exists

    (forward, first), (backward, second) = limit(1.0), limit(-1.0)
    return forward, backward, nan_where(~(plain.gap <= least), plain.efforts), first & second


def _at_breakaway(system, at):
    """The system whose joints rub with their breakaway friction at any slip of a configuration that is not zero."""
    f, dtype, number = system.friction, at.u.dtype, len(system.friction.names)
    full = _FULL * jnp.sqrt(jnp.max(lax.stop_gradient(slips_of(system, at).square))) * jnp.ones(number, dtype)
    model = BearingFriction(
        values_of(f.models, lambda model: model.breakaway, dtype),
        transition_speed=jnp.maximum(full, jnp.finfo(dtype).tiny),
        viscous=jnp.zeros(number, dtype),
        seal=values_of(f.models, lambda model: model.breakaway_drag, dtype),
    )
    return replace_field(system, "friction", replace_field(f, "models", (ModelGroup(model, tuple(range(number))),)))
