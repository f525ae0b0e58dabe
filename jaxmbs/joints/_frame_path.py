"""A frame that follows a path in time: tools, moved supports, whatever is led and not driven at a joint."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import any_concrete, no_such
from ..math._rotation import rotation_matrix
from ..runtime import as_array
from ..typing import ArrayLike, ScalarLike
from ._base import aligned
from ._closures import AbstractClosure

_PLACES, _TURNS = ("x", "y", "z"), ("rx", "ry", "rz")


class FramePath(AbstractClosure):
    """Frame B is led along a path in frame A; what leads it carries the force and moment that this takes.

    Args:
        position: function of time to the place (3,) of B's origin in the axes of A [m], or a place; None: not led.
        rotation: the same to the rotation vector (3,) of B in A [rad]; None: not led.
        hold: components that are led, of x, y, z and rx, ry, rz (default: all of those given): `("x", "y", "rz")`
            leads a tool in the plane.  Turns are those that are left between B and the path.

    Rows in the order of `hold`: lengths [m] along the axes of A, twice the tangents of half angles (rad, where
    small), positive as B lies beyond the path.  They are like those of a cut joint: `State.at` closes them, and
    `reactions` names the wrench on frame B. `inverse_dynamics(..., actuators=)` and `reactions(..., actuators=)` let
    actuators take its place.  Paths need two derivatives.  Source: S2 (3), (5), rows with time in them.
    """

    may_depend_on_time: ClassVar[bool] = True

    position: Callable | ArrayLike | None = None
    rotation: Callable | ArrayLike | None = None
    hold: tuple[str, ...] = eqx.field(static=True, default=())

    def __init__(
        self,
        position: Callable | ArrayLike | None = None,
        rotation: Callable | ArrayLike | None = None,
        hold: Sequence[str] | None = None,
    ) -> None:
        self.position, self.rotation = map(_path, (position, rotation))
        given = (_PLACES if position is not None else ()) + (_TURNS if rotation is not None else ())
        self.hold = given if hold is None else tuple(hold)

    @property
    def row_units(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple("m" if name in _PLACES else "rad" for name in self.hold)

    def closure_at(self, R: Array, d: Array, t: ScalarLike) -> Array:
        """Rows (k,): what is left between frame B and the path, lengths [m] and tangents of half angles."""
        parts = [jnp.zeros(0, d.dtype)]
        held = [name for name in self.hold if name in _PLACES]
        if held:
            parts.append((d - _value(self.position, t))[np.array([_PLACES.index(name) for name in held])])
        held = [name for name in self.hold if name in _TURNS]
        if held:
            left = aligned(rotation_matrix(_value(self.rotation, t)).T @ R)
            parts.append(left[np.array([_TURNS.index(name) for name in held])])
        return jnp.concatenate(parts)

    def faults(self) -> list[str]:
        """Components that do not exist or have no path, and paths that give no three numbers."""
        found = [
            no_such("component", name, (*_PLACES, *_TURNS)) for name in self.hold if name not in _PLACES + _TURNS
        ]
        if len(set(self.hold)) < len(self.hold):
            found.append("hold names a component twice")
        if not self.hold:
            found.append("it leads nothing: give position=, rotation= or both")
        for what, path, names in (("position", self.position, _PLACES), ("rotation", self.rotation, _TURNS)):
            led = [name for name in self.hold if name in names]
            if path is None and led:
                found.append(f"{', '.join(led)} are held without {what}=")
            elif path is not None:
                found += [f"{what}: {fault}" for fault in _path_faults(path)]
        return found


def _path(given):
    """A function as it is, a place as an array, which is a number of the model."""
    return given if given is None or callable(given) else as_array(given)


def _value(path: Any, t: ScalarLike):
    """Of a path at a time."""
    return as_array(path(t) if callable(path) else path)


def _path_faults(path):
    """What one call says, and the path's own faults."""
    try:
        shape = jax.eval_shape(lambda t: _value(path, t), jnp.zeros(())).shape
    except Exception as error:  # noqa: BLE001 - the user's own code
        return [f"it cannot be evaluated: {type(error).__name__}: {error}"]
    found = list(path.faults()) if hasattr(path, "faults") else []
    if not callable(path) and any_concrete(lambda x: ~np.isfinite(x), path):
        found.append("it is not finite")
    return found if shape == (3,) else [*found, f"it gives shape {shape}, not three numbers"]
