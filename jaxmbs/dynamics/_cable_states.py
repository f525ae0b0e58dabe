"""Cables of a mechanism at a state: lengths, tensions, wrap angles, loads of sheaves."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..assembly._state import HasStates, State
from ..forces import Cable, PathKinematics
from ..forces._cable_route import CableRoute
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._poses import frame_twists
from ..model._changes import with_changes
from ..model._entry_points import map_states, states_of
from ..model._rows import row_elements
from ..model._system import System
from ..quantities import XYZ, Axis, Quantity, numbered
from ..reports import Report, Reported, faults_in_short
from ..runtime import gather_static, jit
from ..signal_flow._acting_laws import acting_laws
from ._efforts import element_efforts
from ._newton_euler import accelerations


class CableResult(Reported, eqx.Module):
    """A cable at a state, or along a motion with leading axes.

    Attributes:
        length: () from end to end along the path, or around [m]; rate [m/s].
        tension: () of the elastic law and the damping, the mean along the cable; of an inextensible cable that of
            the motion, negative where it would have to push [N].
        tensions: (m,) of each span between two elements, in order [N].
        wrap: (n,) angle about each element, zero at ends [rad].
        points: (m, 2, 3) world points where each span begins and ends [m].
        is_tangent: (m,) true where a span touches the wheels at its ends; false where they have no such span, as
            from a point within a wheel's circle: the path is then none.
        force, moment: (n, 3) load of each element on its body, in world axes [N, N m], the moment about the frame's
            origin: that of a sheave turns its wheel.
        t: time [s].
        sheaves: indices of the elements that are no points; free: of those between two points, which the cable may
            leave (static).
    """

    length: Float[Array, "..."]
    rate: Float[Array, "..."]
    tension: Float[Array, "..."]
    tensions: Float[Array, "... m"]
    wrap: Float[Array, "... n"]
    points: Float[Array, "... m 2 3"]
    is_tangent: Bool[Array, "... m"]
    force: Float[Array, "... n 3"]
    moment: Float[Array, "... n 3"]
    sheaves: tuple[int, ...] = eqx.field(static=True)
    free: tuple[int, ...] = eqx.field(static=True, default=())
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        span, element = (
            numbered(name, n) for name, n in (("span", self.tensions.shape[-1]), ("element", self.wrap.shape[-1]))
        )
        ends = Axis("end", ("first", "last"))
        return Report(
            [
                Quantity("length", self.length, "m"),
                Quantity("rate", self.rate, "m/s"),
                Quantity("tension", self.tension, "N"),
                Quantity("tension of span", self.tensions, "N", (span,)),
                Quantity("wrap about element", self.wrap, "rad", (element,)),
                Quantity("force on element", self.force, "N", (element, XYZ), in_table=False),
                Quantity("moment on element", self.moment, "N m", (element, XYZ), in_table=False),
                Quantity("point of span", self.points, "m", (span, ends, XYZ), in_table=False),
            ],
            fault=faults_in_short(self.faults()),
            t=self.t,
        )

    @property
    def has_left(self) -> Array:
        """True (..., n) for sheaves that the cable has left: its wrap is negative.  Past those that stand between two
        points it goes straight; one beside another sheave would pull at it, there the law no longer holds."""
        own = np.isin(np.arange(self.wrap.shape[-1]), self.sheaves)
        return (self.wrap < 0) & np.broadcast_to(own, self.wrap.shape)

    @property
    def is_slack(self) -> Array:
        """True (...) where the cable has no tension."""
        return self.tension <= 0.0

    def faults(self) -> list[str]:
        """Sheaves that the cable cannot leave and has left, and spans that touch no wheel, one sentence each."""
        left = np.asarray(self.has_left).reshape(-1, self.wrap.shape[-1])
        left = left & ~np.isin(np.arange(left.shape[1]), self.free)
        lowest = np.asarray(self.wrap).reshape(left.shape).min(axis=0)
        missing = ~np.asarray(self.is_tangent).reshape(-1, self.is_tangent.shape[-1]).all(axis=0)
        return [
            f"the span after element {k} finds no tangent to its wheels: one lies within the other's circle, or they "
            "are too near for the sides on which they are passed"
            for k in np.flatnonzero(missing)
        ] + [
            f"element {k}: the cable has left it, its wrap falls to {lowest[k]:.4g} rad; give the path without it, "
            "or the other side"
            for k in np.flatnonzero(left.any(axis=0))
        ]


def cable_states(system: System, state: State | HasStates) -> dict[str, CableResult]:
    """All cables and belts of a system at a state, by name.

    Args:
        state: a State, a Motion, or states with leading axes, which the answers have too.
    """
    return _along(system, states_of(system, state))


@jit
def _along(system, states):
    return map_states(lambda state: _of_one(with_changes(system, state), state), states)


def _of_one(system, state):
    rows = [row for row in row_elements(system.rows) if isinstance(row.group.law, CableRoute)]
    at = with_velocities(system, at_state(system, state, inertias=bool(rows)), state.velocities)
    found = {}
    for group, law in acting_laws(system, at):
        if not isinstance(group.law, Cable):
            continue
        _, displacement, flow = element_flows(system, group, at, at.V, at.u)
        effort = element_efforts(group, law, displacement, flow, at.t)[:, : 6 * group.port.num_frames]
        effort = effort.reshape(len(group.names), -1, 6)

        def read(law, x, flow, port=group.port):
            law, frames = port.law_and_motion(law, x, flow)
            return law.state(frames, at.t)

        seen = jax.vmap(read)(group.law, displacement, flow)
        for i, name in enumerate(group.names):
            loads = (effort[i, :, 3:], effort[i, :, :3])
            one = jax.tree.map(lambda x, i=i: x[i], seen)
            found[name] = _result(at, one, loads, group.law)
    return found | (_of_rows(system, at, rows) if rows else {})


def _of_rows(system, at, rows):
    """Results of inextensible cables, whose tensions are multipliers of the motion."""
    multipliers, found = accelerations(system, at)[1], {}
    twist = frame_twists(system, at.V)
    for row in rows:
        frames = PathKinematics.of_twists(*(gather_static(part, row.frames) for part in (at.R, at.x, twist)))
        law, tension = row.law, multipliers[row.places[0]]
        force, moment = law.unit_loads(frames.rotations, frames.positions)
        found[row.name] = _result(at, law.state(frames, tension), (tension * force, tension * moment), law)
    return found


def _result(at, seen, loads, law):
    seen = seen._replace(points=seen.points + at.origin[None, None])
    sheaves, free = (tuple(int(k) for k in own) for own in (law.layout.circles, law.layout.free_wheels))
    return CableResult(*(jnp.asarray(part) for part in seen), *loads, sheaves=sheaves, free=free, t=at.t)
