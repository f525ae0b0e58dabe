"""Paths of frames in time: tools and moving supports, which are prescribed without a drive at a joint."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import any_concrete, distinct_names, no_such
from ..math._rotation import rotation_matrix
from ..runtime import as_array, explain_error
from ..typing import ArrayLike, ScalarLike
from ._base import alignment_rows
from ._closures import AbstractClosure

_TRANSLATIONS, _ROTATIONS = ("x", "y", "z"), ("rx", "ry", "rz")


class FramePath(AbstractClosure):
    """Frame B follows a path in frame A; the constraint has the force and moment that this takes as its reaction.

    Args:
        position: function of time to the place (3,) of B's origin in the axes of A [m], or a place; None: free.
        rotation: the same to the rotation vector (3,) of B in A [rad]; None: free.
        hold: components that are prescribed, of x, y, z and rx, ry, rz (default: all of those given):
            `("x", "y", "rz")` moves a tool in the plane.  Turns are those that are left between B and the path.

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
        self.position, self.rotation = map(_as_path, (position, rotation))
        given = (_TRANSLATIONS if position is not None else ()) + (_ROTATIONS if rotation is not None else ())
        self.hold = given if hold is None else distinct_names("hold", hold)

    @property
    def row_units(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple("m" if name in _TRANSLATIONS else "rad" for name in self.hold)

    def closure_at(self, R: Array, d: Array, t: ScalarLike) -> Array:
        """Rows (k,): deviation of frame B from the path, lengths [m] and twice the tangents of half angles."""
        parts = [jnp.zeros(0, d.dtype)]
        held = [name for name in self.hold if name in _TRANSLATIONS]
        if held:
            parts.append(
                (d - _evaluate_path(self.position, t))[np.array([_TRANSLATIONS.index(name) for name in held])]
            )
        held = [name for name in self.hold if name in _ROTATIONS]
        if held:
            left = alignment_rows(rotation_matrix(_evaluate_path(self.rotation, t)).T @ R)
            parts.append(left[np.array([_ROTATIONS.index(name) for name in held])])
        return jnp.concatenate(parts)

    def faults(self) -> list[str]:
        """Faults: components that do not exist or have no path, and paths that do not give three numbers."""
        found = [
            no_such("component", name, (*_TRANSLATIONS, *_ROTATIONS))
            for name in self.hold
            if name not in _TRANSLATIONS + _ROTATIONS
        ]
        if not self.hold:
            found.append("it prescribes nothing: give position=, rotation= or both")
        for what, path, names in (
            ("position", self.position, _TRANSLATIONS),
            ("rotation", self.rotation, _ROTATIONS),
        ):
            led = [name for name in self.hold if name in names]
            if path is None and led:
                found.append(f"{', '.join(led)} have no path: give {what}=")
            elif path is not None:
                found += [f"{what}: {fault}" for fault in _path_faults(path)]
        return found


def _as_path(given):
    """A function unchanged, a place as an array, which is then a number of the model."""
    return given if given is None or callable(given) else as_array(given)


def _evaluate_path(path: Any, t: ScalarLike):
    """Value of a path at a time."""
    return as_array(path(t) if callable(path) else path)


def _path_faults(path):
    """Faults that one abstract call shows, and the path's own."""
    try:
        shape = jax.eval_shape(lambda t: _evaluate_path(path, t), jnp.zeros(())).shape
    except Exception as error:  # noqa: BLE001 - the user's own code
        return [f"it cannot be evaluated: {explain_error(error)}"]
    found = list(path.faults()) if hasattr(path, "faults") else []
    if not callable(path) and any_concrete(lambda x: ~np.isfinite(x), path):
        found.append("it is not finite")
    return found if shape == (3,) else [*found, f"it gives shape {shape}, not three numbers"]
