"""Results of an optimisation: the best design and the history of the search."""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import PyTree

from ..checks import no_such
from ..errors import UnknownNameError
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, reported
from ._limit_result import LimitResult, limits_table
from ._variables import AT_BOUND, units_by_name


@reported
class History(NamedTuple):
    """History of a search, with one entry for the first design and for every step taken.

    Attributes:
        values: objective (steps + 1,).
        gradient_norms: the largest decrease of the objective (steps + 1,), to first order, when one variable moves by
            its scale (width of its bounds, else its size now or at first, or one), or up to its bound; with limits
            the same for the gradient of the Lagrangian.
        evaluations: objective evaluations so far (steps + 1,).
    """

    values: np.ndarray
    gradient_norms: np.ndarray
    evaluations: np.ndarray

    def report(self) -> Report:
        step = (Axis("step", np.arange(len(self.values))),)
        columns = {"objective": self.values, "gradient norm": self.gradient_norms, "evaluations": self.evaluations}
        return Report(
            [Quantity(name, values, "", step) for name, values in columns.items()], f"{len(self.values) - 1} steps"
        )


class Optimum(Reported, eqx.Module):
    """The best design of an optimisation.

    Attributes:
        design: the best design, a pytree like the first one.
        value: its objective.
        initial_design: the first design.
        initial_value: its objective.
        history: objective, gradient norm and evaluations by step.
        lower: lower bounds of the scalar variables (n,).
        upper: upper bounds (n,).
        names: their names.
        reason: why the search ended: "converged", "step limit", "stopped by callback", "non-finite" (no
            finite objective and gradient ahead), "no further descent" (no lower value along the last step) or
            "unbounded: ..." with the variables along which the objective falls without end; "a kink: ..." where
            slopes on both sides of the last step differ, as at a largest of several numbers; "outside of a model's
            validity: ..." where a motion or equilibrium of the design has the status VALIDITY; "no design
            found that satisfies all limits: ..." with those that are violated; for one start among many also "no
            search can start ...", its value is then NaN.
        starts: the optima from all first designs, where there were many.
        limits: values, margins and shadow prices of the limits, in their order.
        bound_prices: (n,) shadow prices of the variables' bounds, with limits: change of the objective if an active
            bound moves up by one unit.
        kkt: residual of the Karush-Kuhn-Tucker conditions, as `History.gradient_norms`.
        units: of the variables, and last of the objective; empty where they are not known, see `with_units`.
    """

    design: PyTree
    value: float
    initial_design: PyTree
    initial_value: float
    history: History
    lower: np.ndarray
    upper: np.ndarray
    names: tuple[str, ...] = eqx.field(static=True)
    reason: str = eqx.field(static=True)
    starts: "tuple[Optimum, ...]" = ()
    limits: tuple[LimitResult, ...] = ()
    bound_prices: np.ndarray | None = None
    kkt: float | None = None
    units: tuple[str, ...] = eqx.field(static=True, default=())

    def with_units(self, units: Mapping[str, str]) -> "Optimum":
        """The same result with units in its tables: `with_units({"radius": "mm", "objective": "kg"})`, an array's for
        all of its entries.

        Raises: UnknownNameError; TypeError for a unit that is no word.
        """
        return dataclasses.replace(self, units=units_by_name(self.names, units, ("objective",)))

    def report(self) -> Report:
        """The variables, the objective and the worst entry of each limit, before and after."""
        names = Axis("variable", self.names)
        columns = {"before": _flatten(self.initial_design), "after": _flatten(self.design)}
        columns |= {"lower": self.lower, "upper": self.upper}
        found = [Quantity(name, values, "", (names,)) for name, values in columns.items()]
        *_, unit = self.units or ("",)
        summary = f"objective {self.initial_value:.6g} before, {self.value:.6g} after {unit}".rstrip()
        return Report(found, summary, "" if self.ok else self.reason, table=self._rows(self.limits))

    @property
    def ok(self) -> bool:
        """True if the search converged."""
        return self.reason == "converged"

    def table(self) -> str:
        """Table of every variable before and after, with its bounds and a mark where a bound is active."""
        return _format_table(self._rows()) + ("\n\n" + limits_table(self.limits) if self.limits else "")

    def _rows(self, limits=()):
        before, after = _flatten(self.initial_design), _flatten(self.design)
        rows: list[tuple[str, ...]] = [("variable", "before", "after", "lower", "upper", "")]
        for name, *numbers in zip(self.names, before, after, self.lower, self.upper, strict=True):
            rows.append((name, *(f"{number:.6g}" for number in numbers), _bound_mark(*numbers[1:])))
        rows.append(("objective", f"{self.initial_value:.6g}", f"{self.value:.6g}", "", "", self.reason))
        rows += [limit.bounds_row() for limit in limits]
        own = self.units or ("",) * (len(self.names) + 1)
        units = [*own, *(limit.unit for limit in limits)]
        if not any(units):
            return rows
        return [(*row[:-1], unit or "-", row[-1]) for row, unit in zip(rows, ("unit", *units), strict=True)]

    def limit(self, name: str) -> LimitResult:
        """The result of the limit with a name.

        Raises: UnknownNameError.
        """
        found = {limit.name: limit for limit in self.limits}
        if name not in found:
            raise UnknownNameError(no_such("limit", name, list(found)))
        return found[name]

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` by variable: before, after and bounds; see `limits_to_pandas`."""
        import pandas

        columns = {"before": _flatten(self.initial_design), "after": _flatten(self.design)}
        return pandas.DataFrame(columns | {"lower": self.lower, "upper": self.upper}, pandas.Index(self.names))

    def limits_to_pandas(self) -> Any:
        """A `pandas.DataFrame` by limit: its worst entry before and after, bound, margin, price, active."""
        import pandas

        rows = [
            {
                "before": limit.before[limit.worst],
                "after": limit.after[limit.worst],
                "bound": limit.bound,
                "margin": limit.margin,
                "price": limit.price,
                "active": limit.active,
            }
            for limit in self.limits
        ]
        return pandas.DataFrame(rows, pandas.Index([limit.name for limit in self.limits]))

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over `variable` and `limit`, of both tables; the objective is an attribute."""
        import xarray

        variables = xarray.Dataset.from_dataframe(self.to_pandas().rename_axis("variable"))
        limits = xarray.Dataset.from_dataframe(self.limits_to_pandas().rename_axis("limit").add_prefix("limit "))
        return variables.merge(limits).assign_attrs(objective=self.value, reason=self.reason)

    def starts_table(self) -> str:
        """Table of the starts: objective before and after, steps and reason; the best one is marked."""
        rows: list[tuple[str, ...]] = [("start", "before", "after", "steps", "", "")]
        for k, found in enumerate(self.starts):
            mark = "best" if found.value == self.value else ""
            steps = str(len(found.history.values) - 1)
            rows.append((str(k), f"{found.initial_value:.6g}", f"{found.value:.6g}", steps, mark, found.reason))
        return _format_table(rows)


def _flatten(design: PyTree) -> np.ndarray:
    return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(design)])


def _format_table(rows: list[tuple[str, ...]]) -> str:
    widths = [max(len(cell) for cell in column) for column in list(zip(*rows, strict=True))[:-1]]
    return "\n".join(_line(row, widths) for row in rows)


def _line(row: tuple[str, ...], widths: list[int]) -> str:
    numbers = (cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:], strict=True))
    return "  ".join([row[0].ljust(widths[0]), *numbers, row[-1]]).rstrip()


def _bound_mark(x: float, lower: float, upper: float) -> str:
    if lower == upper:
        return "fixed"
    size = upper - lower if np.isfinite(upper - lower) else abs(x) + 1.0
    if x - lower <= AT_BOUND * size:
        return "at lower"
    return "at upper" if upper - x <= AT_BOUND * size else ""
