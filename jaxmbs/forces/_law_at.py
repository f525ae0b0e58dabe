"""Laws at given internal states: laws without states, as ports and all functions of one instant take them."""

from typing import Any

import jax

from ..drawings import Drawing
from ..typing import Scalar, ScalarLike
from ._base import AbstractBodyLaw, AbstractLaw, AbstractPoseLaw, AbstractScalarLaw, AbstractSystemLaw
from ._element_bonds import Bonds
from ._readings import Arrows, PointLoads, Reading
from ._validity import Margin

#: Internal states of one element by name: arrays.
States = dict[str, Any]


class LawAt(AbstractLaw):
    """A law with internal states, and values of them; of several elements both are stacked."""

    law: Any
    s: States

    @property
    def stores(self) -> bool:
        """That of the law."""
        return self.law.stores

    @property
    def dissipates(self) -> bool:
        """That of the law."""
        return self.law.dissipates

    @property
    def is_source(self) -> bool:  # type: ignore[override]
        """That of the law."""
        return self.law.is_source

    def potential(self, *args: Any) -> Scalar:
        """Stored energy [J], of (x, t)."""
        return self.law.potential(*self._with_states(args))

    def rate(self, *args: Any) -> States:
        """Rates of the states by name, of (x, v, t)."""
        return self.law.rate(*self._with_states(args))

    def dissipated(self, *args: Any) -> Scalar | None:
        """Power [W] that the law turns into heat, of (x, v, t); None where the law does not say."""
        return self.law.dissipated(*self._with_states(args))

    def bonds(self, *args: Any) -> Bonds:
        """Bonds of the graph inside the element, of (x, v, t)."""
        return self.law.bonds(*self._with_states(args))

    def validity(self, *args: Any) -> dict[str, Margin]:
        """Margins of the law, of (x, v, t)."""
        return self.law.validity(*self._with_states(args))

    def drawing(self) -> Drawing:
        """That of the law."""
        return self.law.drawing()

    def report(self, *args: Any) -> dict[str, Reading]:
        """Results of the law, of (x, v, t)."""
        return self.law.report(*self._with_states(args))

    def arrows(self, *args: Any) -> Arrows | None:
        """Forces of the law, of (x, v, t)."""
        return self.law.arrows(*self._with_states(args))

    def point_loads(self, *args: Any) -> PointLoads | None:
        """Loads at points of contact, of (x, v, t)."""
        return self.law.point_loads(*self._with_states(args))

    def storage_beside(self, *args: Any) -> Scalar | None:
        """Power stored beside the potential, of (x, v, t)."""
        return self.law.storage_beside(*self._with_states(args))

    @property
    def has_ends(self) -> bool:
        """That of the law."""
        return self.law.has_ends

    @property
    def has_bonds(self) -> bool:
        """That of the law."""
        return self.law.has_bonds

    @property
    def has_storage_beside(self) -> bool:
        """That of the law."""
        return self.law.has_storage_beside

    @property
    def has_points(self) -> bool:
        """That of the law."""
        return self.law.has_points

    @property
    def has_arrows(self) -> bool:
        """That of the law."""
        return self.law.has_arrows

    @property
    def has_report(self) -> bool:
        """That of the law."""
        return self.law.has_report

    def state_power(self, x: tuple, rates: States, t: ScalarLike) -> Scalar:
        """Power [W] that goes into the stored energy by the rates of the states, at constant x and time."""
        return jax.jvp(lambda s: self.law.potential(*x, s, t), (self.s,), (rates,))[1]

    def _with_states(self, args):
        """The arguments with the states before the time."""
        *before, t = args
        return *before, self.s, t


class ScalarLawAt(LawAt, AbstractScalarLaw):
    """On a scalar displacement."""

    def effort(self, *args: Any) -> Scalar:
        """Effort, of (x, v, t)."""
        return self.law.effort(*self._with_states(args))


class PoseLawAt(LawAt, AbstractPoseLaw):
    """Between two frames."""

    def wrench(self, *args: Any) -> Any:
        """Force and moment, of (x, v, t)."""
        return self.law.wrench(*self._with_states(args))


class BodyLawAt(LawAt, AbstractBodyLaw):  # type: ignore[override]
    """At one frame."""

    def wrench(self, *args: Any) -> Any:
        """Force and moment, of (x, v, t)."""
        return self.law.wrench(*self._with_states(args))


class SystemLawAt(LawAt, AbstractSystemLaw):  # type: ignore[override]
    """On the whole system."""

    def effort(self, *args: Any) -> Any:
        """Efforts, of (x, v, t)."""
        return self.law.effort(*self._with_states(args))
