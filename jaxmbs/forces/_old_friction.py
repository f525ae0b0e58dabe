"""Earlier names of models of friction; they warn and go with the next release."""

from typing import Any, NamedTuple

from .. import friction as models
from ..errors import ModelError, warn
from ..runtime import as_array
from ..typing import ArrayLike, WordedError
from ._friction_force import FrictionForce


class OldModel(NamedTuple):
    """A class of `jaxmbs.friction` and its own numbers, without those that `SystemBuilder.friction` was given."""

    kind: type
    numbers: dict

    def model(self, mu, static, speed):
        """The model of a coefficient of sliding friction, one at breakaway or None, and a speed [m/s]."""
        which = "stribeck_speed" if self.kind.has_bristles else "transition_speed"
        return self.kind(mu, static=static, **{which: speed}, **self.numbers)


def warn_of_old_name(old: str, new: str) -> None:
    """Warn of a name of an earlier release."""
    warn(f"{old} is deprecated; it is {new}", DeprecationWarning)


def require_bristles(friction: Any) -> Any:
    """The model itself.  Raises: TypeError for one without bristles."""
    if not getattr(friction, "has_bristles", False):
        raise TypeError(f"friction must be a model with bristles, got {type(friction).__name__}")
    return friction


def BristleForce(
    friction: WordedError[models.AbstractFriction], load: ArrayLike = 1.0, radius: ArrayLike = 1.0
) -> FrictionForce:
    """Deprecated: `forces.FrictionForce(...)`, whose model may have bristles; arguments as there."""
    warn_of_old_name("forces.BristleForce(...)", "forces.FrictionForce(...)")
    return FrictionForce(require_bristles(friction), load, radius)


class AbstractJointFriction:
    """Earlier base of models of joints' friction; those derive from `friction.AbstractFriction` now."""

    def __init_subclass__(cls) -> None:
        raise ModelError(
            [
                f"{cls.__name__}: forces.AbstractJointFriction is friction.AbstractFriction now, whose models give "
                "`coefficient(speed)` and work in every place (docs/extend/friction.md)"
            ],
            "the class",
        )


def SmoothCoulomb() -> OldModel:
    """Deprecated: `friction.SmoothCoulomb(dynamic, static, transition_speed)`, given to `SystemBuilder.friction`."""
    warn_of_old_name("forces.SmoothCoulomb()", "friction.SmoothCoulomb(dynamic, static, transition_speed)")
    return OldModel(models.SmoothCoulomb, {})


def BrownMcPhee() -> OldModel:
    """Deprecated: `friction.BrownMcPhee(dynamic, static, transition_speed)`, given to `SystemBuilder.friction`."""
    warn_of_old_name("forces.BrownMcPhee()", "friction.BrownMcPhee(dynamic, static, transition_speed)")
    return OldModel(models.BrownMcPhee, {})


def BearingFriction(viscous: ArrayLike = 0.0, seal: ArrayLike = 0.0) -> OldModel:
    """Deprecated: `friction.BearingFriction(dynamic, ..., viscous=, seal=)`, given to `SystemBuilder.friction`.

    Args: viscous: friction over slip [N s/m]; seal: friction without load [N].
    """
    warn_of_old_name("forces.BearingFriction(...)", "friction.BearingFriction(dynamic, viscous=, seal=)")
    return OldModel(models.BearingFriction, {"viscous": viscous, "seal": seal})


def JointLuGre(sigma0: ArrayLike, sigma1: ArrayLike = 0.0, sigma2: ArrayLike = 0.0) -> OldModel:
    """Deprecated: `friction.LuGre(dynamic, sigma0, sigma1, sigma2, static, stribeck_speed)`.

    Args: sigma0, sigma1, sigma2: of the bristles, over the load [1/m, s/m, s/m].
    """
    warn_of_old_name("forces.JointLuGre(...)", "friction.LuGre(dynamic, sigma0, sigma1, sigma2, static)")
    return OldModel(models.LuGre, {"sigma0": sigma0, "sigma1": sigma1, "sigma2": sigma2})


def CoulombFriction(
    effort_limit: ArrayLike,
    static_ratio: ArrayLike = 1.0,
    slip_speed: ArrayLike = 1e-3,
    viscous: ArrayLike = 0.0,
    stribeck_speed: ArrayLike | None = None,
) -> FrictionForce:
    """Deprecated: `forces.FrictionForce(friction.BearingFriction(dynamic, static, transition_speed, ...), load)`.

    Args: effort_limit: load times `dynamic`; static_ratio: `static` over `dynamic`; slip_speed: `transition_speed`;
        viscous, stribeck_speed: as there.
    """
    warn_of_old_name(
        "CoulombFriction(...)", "forces.FrictionForce(friction.BearingFriction(dynamic, static, ...), load)"
    )
    static = as_array(effort_limit) * as_array(static_ratio)
    return FrictionForce(models.BearingFriction(effort_limit, static, slip_speed, stribeck_speed, viscous))


def LuGre(
    effort_limit: ArrayLike,
    bristle_stiffness: ArrayLike,
    bristle_damping: ArrayLike = 0.0,
    static_ratio: ArrayLike = 1.0,
    viscous: ArrayLike = 0.0,
    stribeck_speed: ArrayLike = 1e-3,
) -> FrictionForce:
    """Deprecated: `forces.FrictionForce(friction.LuGre(dynamic, sigma0, sigma1, sigma2, static, ...), load)`.

    Args: effort_limit, bristle_stiffness, bristle_damping, viscous: load times `dynamic`, `sigma0`, `sigma1`,
        `sigma2`; static_ratio: `static` over `dynamic`; stribeck_speed: as there.
    """
    warn_of_old_name("forces.LuGre(...)", "forces.FrictionForce(friction.LuGre(dynamic, sigma0, ...), load)")
    static = as_array(effort_limit) * as_array(static_ratio)
    numbers = (effort_limit, bristle_stiffness, bristle_damping, viscous, static, stribeck_speed)
    return FrictionForce(models.LuGre(*numbers))
