"""Laws with internal states that several tests share: a lag of the first order on every kind of port, and a servo."""

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp

from jaxmbs import forces as F


def number(x):
    return jnp.asarray(x, float)


class Lag(F.AbstractScalarLaw):
    """Force f that follows a command, `tau df/dt = command - f`; its power counts as input."""

    is_source: ClassVar[bool] = True
    tau: jax.Array = eqx.field(converter=number)
    command: jax.Array = eqx.field(converter=number, default=0.0)

    @property
    def internal_states(self):
        return {"force": F.InternalState((), "N", 10.0)}

    def rate(self, x, v, s, t):
        return {"force": (self.command - s["force"]) / self.tau}

    def effort(self, x, v, s, t):
        return s["force"]


class PoseLag(F.AbstractPoseLaw):
    """Maxwell's element of three directions: stretch z (3,), `dz/dt = v - rate z`, force `-k z`."""

    stiffness: jax.Array = eqx.field(converter=number)
    decay: jax.Array = eqx.field(converter=number)

    @property
    def internal_states(self):
        return {"stretch": F.InternalState((3,), "m")}

    def rate(self, rotation, displacement, angular_velocity, velocity, s, t):
        return {"stretch": velocity - self.decay * s["stretch"]}

    def wrench(self, rotation, displacement, angular_velocity, velocity, s, t):
        return -self.stiffness * s["stretch"], jnp.zeros(3)

    def potential(self, rotation, displacement, s, t):
        return self.stiffness * jnp.sum(s["stretch"] ** 2) / 2.0


class Wake(F.AbstractBodyLaw):
    """Drag `-c w` of a wake that follows the velocity, `tau dw/dt = v - w`."""

    drag: jax.Array = eqx.field(converter=number)
    tau: jax.Array = eqx.field(converter=number)

    @property
    def internal_states(self):
        return {"wake": F.InternalState((3,), "m/s")}

    def rate(self, rotation, position, angular_velocity, velocity, s, t):
        return {"wake": (velocity - s["wake"]) / self.tau}

    def wrench(self, rotation, position, angular_velocity, velocity, s, t):
        return -self.drag * s["wake"], jnp.zeros(3)


class Servo(F.AbstractSystemLaw):
    """Efforts `i - damping v` with integral states i of every velocity, `di/dt = gain (target - q)`."""

    gain: jax.Array = eqx.field(converter=number)
    target: jax.Array = eqx.field(converter=number)
    damping: jax.Array = eqx.field(converter=number)

    @property
    def internal_states(self):
        return {"integral": F.InternalState(self.target.shape, "N", 5.0)}

    def start(self, coordinates, velocities, t):
        return {"integral": 0.1 * coordinates}

    def rate(self, coordinates, velocities, s, t):
        return {"integral": self.gain * (self.target - coordinates)}

    def effort(self, coordinates, velocities, s, t):
        return s["integral"] - self.damping * velocities
