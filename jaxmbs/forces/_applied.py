"""Loads applied at the origin of a frame; their power counts as input.

Source: S2 (76), the external efforts Q*.
"""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp

from ..checks import faults_if
from ..typing import Convertible, Matrix3, ScalarLike, Vector3
from ._base import AbstractBodyLaw
from ._fields import as_law_function, number
from ._signals import as_signal


class _VectorLoad(AbstractBodyLaw):
    value: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    axes: str = eqx.field(static=True, default="world")
    inputs: ClassVar[tuple[str, ...]] = ("value",)

    def __check_init__(self):
        if self.axes not in ("world", "body"):
            raise ValueError(f"axes must be 'world' or 'body', not {self.axes!r}")

    def faults(self) -> list[str]:
        """The value has three components."""
        if found := super().faults():  # a signal with faults may have no value
            return found
        shape = jax.eval_shape(lambda: number(self.value(number(0.0)))).shape
        return faults_if((shape != (3,), f"value must have shape (3,), not {shape}"))

    def _vector(self, rotation, t):
        """The value (3,) at time t in world axes."""
        vector = number(self.value(t))
        return rotation @ vector if self.axes == "body" else vector


class Force(_VectorLoad):
    """Force at the frame's origin [N].

    Attributes:
        value: (3,), or a function of time that gives (3,).
        axes: "world", or "body": it turns with the frame (a follower force).
    """

    def wrench(
        self, rotation: Matrix3, position: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """The force, no moment. Source: S2 (76)."""
        force = self._vector(rotation, t)
        return force, jnp.zeros_like(force)


class Torque(_VectorLoad):
    """Moment on the body of the frame [N m].

    Attributes:
        value: (3,), or a function of time that gives (3,).
        axes: "world", or "body": it turns with the frame.
    """

    def wrench(
        self, rotation: Matrix3, position: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """No force, the moment. Source: S2 (76)."""
        moment = self._vector(rotation, t)
        return jnp.zeros_like(moment), moment


class Wrench(AbstractBodyLaw):
    """Any load: `function(rotation, position, angular_velocity, velocity, t)`, in and out in world axes.

    Attributes:
        function: gives force [N] and moment [N m], (3,) each, about the frame's origin; the arrays of an
            `eqx.Module` are leaves, a plain function is static.
    """

    function: Convertible[Callable[..., Any]] = eqx.field(converter=as_law_function)

    def wrench(
        self, rotation: Matrix3, position: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """The function's force and moment. Source: S2 (76)."""
        force, moment = self.function(rotation, position, angular_velocity, velocity, t)
        return number(force), number(moment)
