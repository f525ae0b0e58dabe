"""The model of a rubbing joint from what `SystemBuilder.friction` is given, earlier keywords among it."""

from typing import Any

from ..errors import warn
from ..forces._old_friction import OldModel
from ..friction import AbstractFriction, SmoothCoulomb
from ..friction._places import as_friction

#: The default of the keyword `transition_speed` that joints had [m/s].
_SPEED = 0.01


def joint_model(friction: Any, mu: Any, static_ratio: Any, transition_speed: Any, model: Any) -> AbstractFriction:
    """The model of a joint; the last four are deprecated.

    Raises: TypeError or ValueError for what is no model, and for two of them.
    """
    if mu is None and static_ratio is None and transition_speed is None and model is None:
        if friction is None:
            raise TypeError("give friction=, a coefficient or a model of jaxmbs.friction")
        return as_friction(friction)
    warn(
        "mu, static_ratio, transition_speed and model of SystemBuilder.friction are deprecated; give friction= a "
        "model of jaxmbs.friction, as SmoothCoulomb(dynamic, static, transition_speed)",
        DeprecationWarning,
    )
    dynamic, numbers = mu if friction is None else friction, (static_ratio, transition_speed)
    if isinstance(model, AbstractFriction) and dynamic is None and numbers == (None, None):
        return model
    if isinstance(model, AbstractFriction) or isinstance(dynamic, AbstractFriction):
        raise TypeError("a model of jaxmbs.friction has its own numbers; give it alone, as friction=")
    if dynamic is None:
        raise TypeError("give friction=, a coefficient or a model of jaxmbs.friction")
    if not isinstance(model, OldModel | None):
        raise TypeError(f"model must be one of jaxmbs.friction, got {model!r}")
    coefficient: Any = as_friction(dynamic).breakaway
    static = None if static_ratio is None else coefficient * static_ratio
    old = OldModel(SmoothCoulomb, {}) if model is None else model
    return old.model(coefficient, static, _SPEED if transition_speed is None else transition_speed)
