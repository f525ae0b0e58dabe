"""Ends of the models of bearings: speeds and frequencies that a table has, lengths that a film is for."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from ..checks import is_concrete
from ..errors import warn
from ..forces._validity import Margin
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, faults_in_short
from ..runtime import note
from ..status import Status
from ..typing import ScalarLike

_ROUNDING = 1e-9  # of the last point of a table, by which speeds may be beyond


class BearingValidity(Reported, eqx.Module):
    """Margins of the bearings of a rotor to the ends of their models, over the speed; negative outside.

    Attributes:
        speeds: (S,) [rad/s].
        margins: by "bearing 0" and so on, then by name; values (S,), or (S, m) of roots at frequencies of their own.
    """

    speeds: Float[Array, " S"]
    margins: Mapping[str, dict[str, Margin]]

    def report(self) -> Report:
        speed = (Axis("speed", np.asarray(self.speeds), "rad/s"),)
        found = [
            Quantity(f"{bearing} {name}", _least(margin), margin.unit, speed)
            for bearing, margins in self.margins.items()
            for name, margin in margins.items()
        ]
        summary = "margins to the ends of models, negative outside" if found else "no bearing has an end of its model"
        return Report(found, summary, faults_in_short(self.faults()))

    @property
    def is_outside(self) -> Bool[Array, " S"]:
        """True at speeds where a bearing is beyond the end of its model (traceable)."""
        beyond = jnp.zeros(self.speeds.shape, bool)
        for margins in self.margins.values():
            for margin in margins.values():
                beyond = beyond | (_least(margin) < 0.0)
        return beyond

    @property
    def result(self) -> Int[Array, ""]:
        """`Status` code () of all speeds (traceable)."""
        return jnp.where(jnp.any(self.is_outside), Status.VALIDITY, Status.SUCCESS).astype(jnp.int32)

    def faults(self) -> list[str]:
        """Bearings that are beyond the end of their model, a sentence each with the first speed where that is so and
        the largest excess."""
        return [
            sentence
            for bearing, margins in self.margins.items()
            for margin in margins.values()
            for sentence in self._sentences(bearing, margin)
        ]

    def _sentences(self, bearing, margin):
        values, speeds = np.asarray(_least(margin)), np.asarray(self.speeds)
        if np.any(beyond := values < 0.0):
            first, most = speeds[np.argmax(beyond)], -np.min(values[beyond])
            yield f"{bearing} {margin.end}, by {most:.3g} {margin.unit}, first at {first:.6g} rad/s"


def _least(margin):
    """The least margin (S,) of all roots."""
    return jnp.min(margin.value, axis=tuple(range(1, margin.value.ndim)))


def distance_to(x: ScalarLike, end: Array, scale: Array) -> Array:
    """Margin `x - end`, zero where it is rounding of a scale."""
    return jnp.where(jnp.abs(x - end) <= _ROUNDING * jnp.abs(scale), 0.0, x - end)


def bearing_validity(bearings: Any, speeds: Array, omegas: Array | None = None) -> BearingValidity:
    """Margins of bearings at speeds (S,) [rad/s].

    Args: omegas: (S, m) of whirl [rad/s], where bearings are taken at those.
    """
    found = {}
    for k, bearing in enumerate(bearings):
        if not hasattr(bearing, "validity"):
            continue
        if omegas is not None and getattr(bearing, "depends_on_frequency", False):
            margins = jax.vmap(jax.vmap(bearing.validity, (None, 0)))(speeds, omegas)
        else:
            margins = jax.vmap(bearing.validity)(speeds)
        if margins:
            found[f"bearing {k}"] = margins
    return BearingValidity(speeds, found)


def tell(question: str, validity: BearingValidity | None) -> None:
    """Warn of bearings beyond the ends of their models; a search takes note of the status."""
    if validity is None or not validity.margins:
        return
    note(lambda: validity.result)
    if is_concrete(validity) and (faults := validity.faults()):
        warn(f"{question}: {faults_in_short(faults)}")


def fault_of(validity: BearingValidity | None) -> str:
    """The first of its faults, in words."""
    return "" if validity is None else faults_in_short(validity.faults())
