"""Result of a reliability question: probability of failure, index, design points, importances, derivatives."""

from collections.abc import Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Float

from ..quantities import Axis, Quantity
from ..reports import Report, Reported


class Reliability(Reported, eqx.Module):
    """Probability that a design fails, and what it comes from.

    Attributes:
        probability: of failure; nan where no search or level led to it.
        index: reliability index, the standard normal number that is exceeded with this probability.
        design_point: the most probable failure, by variable; empty where none was searched.
        importances: of the variables for the index, by name; they add to one.
        derivatives: of the probability, by variable: by "mean", "deviation" and each parameter of its distribution;
            by pair of correlated variables, "a, b": by "correlation".
        method: as asked.
        points: (k, n) design points in the space of independent standard normal numbers, by limit state.
        indices: (k,) distances of the design points, negative where the medians fail.
        curvatures: (n - 1,) of the limit state at the design point, by the second order.
        second_order: probabilities with them: "tvedt", exact for a paraboloid, which `probability` is, "breitung" and
            "hohenbichler".
        bounds: (least, largest) probability of a system, after Ditlevsen where it is in series.
        error: standard error of the probability, of samples; confidence: the 95 % interval.
        samples: designs that were sampled; failed: those among them that gave no number, which count as failures.
        gradients: evaluations of the limit state with its gradient.
        surrogate_error: of the polynomial that was sampled by "pce", over the deviation of the limit state.
        faults: what makes the result doubtful, in sentences.
    """

    probability: float
    index: float
    design_point: Mapping[str, float]
    importances: Mapping[str, float]
    derivatives: Mapping[str, Mapping[str, float]]
    method: str = eqx.field(static=True)
    points: Float[np.ndarray, "k n"]
    indices: Float[np.ndarray, " k"]
    curvatures: Float[np.ndarray, " c"] | None = None
    second_order: Mapping[str, float] | None = None
    bounds: tuple[float, float] | None = None
    error: float | None = None
    confidence: tuple[float, float] | None = None
    samples: int = 0
    failed: int = 0
    gradients: int = 0
    surrogate_error: float | None = None
    faults: tuple[str, ...] = eqx.field(static=True, default=())

    @property
    def ok(self) -> bool:
        """True if nothing makes the result doubtful."""
        return not self.faults

    @property
    def index_derivatives(self) -> dict[str, dict[str, float]]:
        """Derivatives of the index, as `derivatives`."""
        density = np.exp(-0.5 * self.index**2) / np.sqrt(2.0 * np.pi)
        return {name: {key: -x / density for key, x in row.items()} for name, row in self.derivatives.items()}

    def report(self) -> Report:
        axis = (Axis("variable", tuple(self.importances)),)
        found = [Quantity("probability of failure", self.probability), Quantity("reliability index", self.index)]
        found += [Quantity(f"after {name.title()}", x) for name, x in (self.second_order or {}).items()]
        if self.surrogate_error is not None:
            found.append(Quantity("error of the polynomial", self.surrogate_error))
        if self.error is not None:
            found.append(Quantity("standard error", self.error))
        if self.bounds is not None:
            found += [Quantity(f"{end} bound", x) for end, x in zip(("lower", "upper"), self.bounds, strict=True)]
        if self.importances:
            found.append(Quantity("design point", np.array([*self.design_point.values()]), "", axis))
            found.append(Quantity("importance", np.array([*self.importances.values()]), "", axis))
        found += self._slopes()
        counts = [f"{self.gradients} gradients"] * bool(self.gradients) + [f"{self.samples} samples"] * bool(
            self.samples
        )
        return Report(found, f"{self.method}, {', '.join(counts)}", "; ".join(self.faults))

    def _slopes(self) -> list[Quantity]:
        rows = {key: None for row in self.derivatives.values() for key in row}
        found = []
        for key in rows:
            labels = [name for name, row in self.derivatives.items() if key in row]
            values = np.array([row[key] for row in self.derivatives.values() if key in row])
            found.append(Quantity(f"derivative by {key}", values, "", (Axis("variable", tuple(labels)),)))
        return found
