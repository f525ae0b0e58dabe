"""Interfaces of models of friction: friction over the load that presses two surfaces, by the speed of their slip."""

import abc
import dataclasses
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, negative, not_positive
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import Scalar, ScalarLike

#: Names that mean the same in every model and place, by the numbers that they may have.
_POSITIVE = ("transition_speed", "stribeck_speed", "sigma0")
_NOT_NEGATIVE = ("dynamic", "static", "viscous", "seal", "sigma1", "sigma2")
#: Speed [m/s] in which bristles that are apart straighten, of a model that does not say.
_STRAIGHTENING = 1e-3


class AbstractFriction(eqx.Module):
    """A model of friction: one class for joints, contacts, cables, worm gears and force laws.

    The place gives the slip and the load; the model has friction over load by the speed of slip, `coefficient`.
    Models of one structure are stacked and mapped, so that methods never branch on values.  A model of your own gives
    `coefficient`; fields called `dynamic`, `static` and `transition_speed` have the meaning that they have in the
    models of this room, and their values are checked.
    """

    has_bristles: ClassVar[bool] = False
    __repr__ = fields_repr

    @abc.abstractmethod
    def coefficient(self, speed: ScalarLike) -> Scalar:
        """Friction over load at a steady speed of slip >= 0 [m/s]; without bristles zero at rest."""

    def resistance(self, square: ScalarLike) -> Scalar:
        """`coefficient` over the speed [s/m], from the square of the speed: smooth at rest too.

        By default that of `coefficient`, and at rest its slope.  Derivatives of the friction by the slip are right up
        to the second; a model whose derivatives of every order matter gives its own.
        """
        square = jnp.asarray(square)
        moves = square > 0.0
        speed = jnp.sqrt(jnp.where(moves, square, 1.0))
        at_rest = jax.jvp(self.coefficient, (jnp.zeros_like(speed),), (jnp.ones_like(speed),))[1]
        return jnp.where(moves, self.coefficient(speed) / speed, at_rest)

    def drag(self, square: ScalarLike) -> Scalar | None:
        """Friction over speed that follows no load [N s/m], from the square of the speed; None for none."""
        return None

    @property
    def creep_speed(self) -> Scalar:
        """Slip below which a surface creeps where a real one would stick [m/s]: by default the `transition_speed`, or
        zero where the model has none."""
        return getattr(self, "transition_speed", jnp.zeros(()))

    @property
    def breakaway(self) -> Scalar | None:
        """Friction over load at which slip begins: by default `static`, or `dynamic`; None where the model has
        neither."""
        static = getattr(self, "static", None)
        return getattr(self, "dynamic", None) if static is None else static

    @property
    def breakaway_drag(self) -> Scalar:
        """Friction that follows no load, where slip begins [N]."""
        return jnp.zeros(())

    def faults(self) -> list[str]:
        """Sentences about numbers that are none, and of fields in the table of names that are out of range."""
        found = []
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        for name, value in values.items():
            leaves = [leaf for leaf in jax.tree.leaves(value) if eqx.is_inexact_array(leaf)]
            if any(any_concrete(np.isnan, leaf) for leaf in leaves):
                found.append(f"{name} is not a number")
            elif any(any_concrete(np.isinf, leaf) for leaf in leaves):
                found.append(f"{name} is not finite")
            elif name in _POSITIVE and value is not None and not_positive(value):
                found.append(f"{name} must be positive")
            elif name in _NOT_NEGATIVE and value is not None and negative(value):
                found.append(f"{name} must not be negative")
        dynamic, static = values.get("dynamic"), values.get("static")
        if dynamic is not None and static is not None and any_concrete(lambda s, d: s < d, static, dynamic):
            found.append("static must be at least dynamic")
        return found


class AbstractBristles(AbstractFriction):
    """A model whose friction has a state: bristles that bend by z [m] along the slip, and hold at rest.

    Slip and bend are vectors (k,) of the same axes: k = 1 along a slide, 3 in the plane of a contact, where the part
    along the normal is zero.  The state is "NAME.bristle".
    """

    has_bristles: ClassVar[bool] = True

    @property
    @abc.abstractmethod
    def bend_scale(self) -> Scalar:
        """A bend in use [m], about that of steady slip: the tolerances of a motion apply to bends over it."""

    @property
    def largest_bend(self) -> Scalar:
        """The largest bend at rest [m], at which slip begins: by default none is known."""
        return jnp.asarray(jnp.inf)

    @abc.abstractmethod
    def rate(self, bend: Float[Array, " k"], slip: Float[Array, " k"]) -> Float[Array, " k"]:
        """Rate of the bend [m/s] of surfaces that are pressed, at a slip [m/s]."""

    @abc.abstractmethod
    def bristle_force(self, bend: Float[Array, " k"], rate: Float[Array, " k"]) -> Float[Array, " k"]:
        """Force of the bristles over the load, along the slip; rate: of the bend."""

    def viscous_force(self, slip: Float[Array, " k"]) -> Float[Array, " k"]:
        """Force beside them over the load; by default there is none."""
        return jnp.zeros_like(slip)

    def traction(
        self, bend: Float[Array, " k"], rate: Float[Array, " k"], slip: Float[Array, " k"]
    ) -> Float[Array, " k"]:
        """Friction over load, along the slip: both of these."""
        return self.bristle_force(bend, rate) + self.viscous_force(slip)

    @abc.abstractmethod
    def energy(self, bend: Float[Array, " k"]) -> Scalar:
        """Energy of the bent bristles over the load [m]."""

    def rate_apart(self, bend: Float[Array, " k"]) -> Float[Array, " k"]:
        """Rate of the bend [m/s] of surfaces that are apart: by default they straighten at a millimetre a second."""
        return -bend * _STRAIGHTENING / self.bend_scale


def optional(value: Any) -> Array | None:
    """Array leaf of the default float type, or None where there is none."""
    return None if value is None else as_array(value)
