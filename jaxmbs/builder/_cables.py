"""Cables from the elements of their path, as the user gives them."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from ..checks import require_numbers
from ..forces import Attachment, Cable, Eyelet, InextensibleCable, PathForce, Sheave, Winch, WrapCylinder, WrapSphere
from ..friction import SmoothCoulomb
from ..friction._places import as_optional_friction
from ..math._rotation import axis_vector
from ..runtime import as_array

_KINDS = {
    Attachment: "point",
    Winch: "point",
    Eyelet: "point",
    Sheave: "sheave",
    WrapCylinder: "cylinder",
    WrapSphere: "sphere",
}
_SENSES = {"+": 1, "-": -1}


def cable_parts(
    elements, closed: bool, friction: Any, slip_speed: Any, values: dict
) -> tuple[Cable, tuple, str | None]:
    """The law of a cable, its frames, and the joint of its drum.

    Args:
        friction: of elements that give none; slip_speed: transition speed of coefficients, None for the default.
        values: the fields of `Cable` that are no parts of the path.

    Raises: TypeError or ValueError with the fault of an element.
    """
    elements = list(elements)
    route = _route(elements, closed)
    winch = elements[0] if elements and isinstance(elements[0], Winch) else None
    law = Cable(
        **route,
        friction=_models(elements, friction, slip_speed),
        drum_radius=None if winch is None else _stack([winch.radius], ())[0] * _SENSES[winch.side],
        **values,
    )
    return law, tuple(item.at for item in elements), None if winch is None else winch.joint


def inextensible_cable_parts(elements, closed: bool, free_length) -> tuple[InextensibleCable, tuple]:
    """The constraint of a cable that does not stretch, and its frames.

    Raises: TypeError or ValueError with the fault of an element.
    """
    elements = list(elements)
    route = _route(elements, closed)
    for k, item in enumerate(elements):
        if isinstance(item, Winch):
            raise ValueError(
                f"element {k}: an inextensible cable takes no Winch; give free_length= as a function of time, or "
                "the cable a stiffness"
            )
        if getattr(item, "friction", None) is not None:
            raise ValueError(
                f"element {k}: an inextensible cable has one tension, so it takes no friction; give the cable a "
                "stiffness, or the joint of the sheave a friction"
            )
    return InextensibleCable(**route, free_length=free_length), tuple(item.at for item in elements)


def path_force_parts(elements, closed: bool, law) -> tuple[PathForce, tuple]:
    """A scalar law over the length of a path, and its frames.  Raises: TypeError or ValueError."""
    elements = list(elements)
    route = _route(elements, closed)
    for k, item in enumerate(elements):
        if isinstance(item, Winch) or getattr(item, "friction", None) is not None:
            raise ValueError(f"element {k}: a path with law= has one tension; it takes no Winch and no friction")
    return PathForce(**route, law=law), tuple(item.at for item in elements)


def _route(elements, closed):
    """Fields of the `CableRoute` over elements.  Raises: TypeError or ValueError."""
    for k, item in enumerate(elements):
        if type(item) not in _KINDS:
            raise TypeError(
                f"element {k}: {item!r} is not Attachment, Winch, Eyelet, Sheave, WrapCylinder or WrapSphere"
            )
        if getattr(item, "side", "+") not in _SENSES:
            raise ValueError(f"element {k}: side is '+' or '-', got {item.side!r}")
        turns = getattr(item, "turns", 0)
        if isinstance(turns, bool) or not isinstance(turns, int | np.integer):
            raise TypeError(f"element {k}: turns is a whole number, got {turns!r}")
        require_numbers(**{f"element {k}: turns": turns})
        if isinstance(item, Attachment) and (closed or k not in (0, len(elements) - 1)):
            raise ValueError(f"element {k}: an Attachment is an end; a cable passes through an Eyelet")
        if isinstance(item, Winch) and (closed or k != 0):
            raise ValueError(f"element {k}: a Winch is the first element of a cable")
    circles = [item for item in elements if hasattr(item, "axis") or isinstance(item, Sheave)]
    return {
        "kinds": tuple(_KINDS[type(item)] for item in elements),
        "radii": _stack([item.radius for item in circles], ()),
        "axes": _stack([_axis(item) for item in circles], (3,)),
        "turns": jnp.array([float(getattr(item, "turns", 0)) for item in circles]),
        "closed": closed,
    }


def _axis(item):
    """Unit vector about which the cable turns in the positive sense."""
    axis = axis_vector(getattr(item, "axis", "z"))
    return axis * _SENSES[item.side] / jnp.linalg.norm(axis)


def _models(elements, friction, slip_speed):
    """Models at the elements, None at those without; None where there is no friction at all."""
    own = [getattr(item, "friction", None) for item in elements]
    given = [friction if model is None else model for model in own]
    if all(model is None for model in given):
        return None
    return [_model(k, model, slip_speed) for k, model in enumerate(given)]


def _model(k, given, slip_speed):
    try:
        model = as_optional_friction(given)
    except (TypeError, ValueError) as error:
        raise type(error)(f"element {k}: {error}") from None
    if given is model or slip_speed is None:
        return model
    return SmoothCoulomb(given, transition_speed=slip_speed)


def _stack(values, shape):
    values = [as_array(value) for value in values]
    for value in values:
        if value.shape != shape:
            raise ValueError(f"a radius or a coefficient is one number, got shape {value.shape}")
    return jnp.stack(values) if values else jnp.zeros((0, *shape))
