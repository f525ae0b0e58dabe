"""Cables from the elements of their path, as the user gives them."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from ..checks import require_numbers
from ..forces import Attachment, Cable, Eyelet, InextensibleCable, Sheave, Winch, WrapCylinder, WrapSphere
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


def cable_parts(elements, closed: bool, friction: Any, values: dict) -> tuple[Cable, tuple, str | None]:
    """The law of a cable, its frames, and the joint of its drum.

    Args:
        values: the fields of `Cable` that are no parts of the path.

    Raises: TypeError or ValueError with the fault of an element.
    """
    elements = list(elements)
    route = _route(elements, closed)
    winch = elements[0] if elements and isinstance(elements[0], Winch) else None
    law = Cable(
        **route,
        friction=_frictions(elements, friction),
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


def _frictions(elements, friction):
    """Coefficients (n,) at the elements, or None where there is no friction at all."""
    own = [getattr(item, "friction", None) for item in elements]
    if friction is None and all(mu is None for mu in own):
        return None
    common = 0.0 if friction is None else friction
    return _stack([common if mu is None else mu for mu in own], ())


def _stack(values, shape):
    values = [as_array(value) for value in values]
    for value in values:
        if value.shape != shape:
            raise ValueError(f"a radius or a coefficient is one number, got shape {value.shape}")
    return jnp.stack(values) if values else jnp.zeros((0, *shape))
