"""An axle of two equal suspensions in roll: travels of both wheels at constant axle load, and their curves."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..errors import ModelError
from ..forces import AbstractScalarLaw
from ..forces._fields import number
from ..quantities import Quantity
from ..reports import Report, Reported
from ..runtime import jit
from ..typing import ArrayLike, WordedError
from ._rig import Rig, _places
from ._rig_curves import RigCurves

_STEPS = 6  # of Newton: the load over travel bends little, each step doubles the digits


class RollCurves(Reported, eqx.Module):
    """An axle in roll, arrays (...) of the poses asked; the right wheel is the image of the left one.

    Attributes:
        angle: of the line through both contacts against the body, positive where the left wheel is higher [rad].
        heave: mean travel of both wheels that keeps the load [m].
        moment: of both loads about the middle of the axle [N m]; its slope over the angle is the roll stiffness.
        left, right: curves of the wheels.
    """

    angle: Array
    heave: Array
    moment: Array
    left: RigCurves
    right: RigCurves

    def report(self) -> Report:
        """Angle, heave and moment; the wheels have reports of their own."""
        rows = [
            Quantity("angle", self.angle * 180.0 / np.pi, "deg"),
            Quantity("heave", self.heave * 1e3, "mm"),
            Quantity("moment", self.moment, "N m"),
        ]
        return Report(rows, f"{np.size(self.angle)} poses of an axle in roll")


def roll_curves(
    rig: WordedError[Rig],
    opposite: ArrayLike,
    spring: WordedError[AbstractScalarLaw],
    hardpoints: Mapping[str, ArrayLike] | None = None,
) -> RollCurves:
    """Curves of both wheels over opposite travel, with the body as high as the axle load asks.

    Args:
        rig: of the left suspension, `kc_rig`.
        opposite: half of the difference of the travels, left less right [m].
        spring: law over the length of the strut; an anti-roll bar leaves the load as it is and is not in it.
        hardpoints: in place of those of the suspension, all or some of them [m]; derivatives by these.

    Raises: ModelError for what is no rig or no law.
    """
    faults = [] if isinstance(rig, Rig) else ["rig must be one of kc_rig"]
    faults += [] if isinstance(spring, AbstractScalarLaw) else [f"spring must be a force law, not {spring!r}"]
    if faults:
        raise ModelError(faults, "the axle")
    own, opposite = rig.with_points(hardpoints), number(opposite)
    heave, loads = _balance(own, opposite, spring)
    both = own.curves(jnp.stack([heave + opposite, heave - opposite]))
    left, right = (jax.tree.map(lambda x, k=k: x[k], both) for k in (0, 1))
    (y, z), (other_y, other_z) = ((curves.contact[..., 1], curves.contact[..., 2]) for curves in (left, right))
    moment = loads[0] * y - loads[1] * other_y
    return RollCurves(jnp.arctan2(z - other_z, y + other_y), heave, moment, left, right)


@jit
def _balance(rig, opposite, spring):
    """Mean travel (...) at the load of the design position, and the loads of both wheels."""

    def load(travel):
        """Of a wheel, by virtual work."""
        places, rates = jax.jvp(lambda z: _places(rig, z, jnp.zeros_like(z)), (travel,), (jnp.ones_like(travel),))
        return -spring.effort(places["strut"], jnp.zeros_like(travel), jnp.zeros_like(travel)) * rates["strut"]

    def one(half):
        def step(heave, _):
            ends = jnp.stack([heave + half, heave - half, jnp.zeros_like(half)])
            loads, slopes = jax.jvp(jax.vmap(load), (ends,), (jnp.ones_like(ends),))
            return heave - (loads[0] + loads[1] - 2.0 * loads[2]) / (slopes[0] + slopes[1]), loads[:2]

        heave, loads = lax.scan(step, jnp.zeros_like(half), length=_STEPS)
        return heave, loads[-1]

    heave, loads = jax.vmap(one)(opposite.ravel())
    return heave.reshape(opposite.shape), tuple(x.reshape(opposite.shape) for x in loads.T)
