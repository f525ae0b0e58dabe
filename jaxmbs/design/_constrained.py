"""The optimisers that keep limits: SciPy's SLSQP and trust-constr, and MMA and CCSAQ of nlopt where installed."""

import math
from collections.abc import Callable

import numpy as np

from ._optimisers import barrier_value
from ._search import Point
from ._working_set import FEASIBILITY, ConstrainedSearch

#: How often a search may take up limits that it had not looked at.
_ROUNDS = 30


class ScaledProblem:
    """A search as functions of variables z (n,) over their scale, counted from the current point.

    A trial that is not finite has the value of a wall, that turns a line search back, and the current limits.
    """

    def __init__(self, search: ConstrainedSearch):
        self.search, self.start = search, search.current
        self.scale, variables = search.variables.scale, search.variables
        self.unit = float(np.max(np.abs(self.start.gradient * self.scale))) or 1.0
        self.lower = (variables.lower - self.start.x) / self.scale
        self.upper = (variables.upper - self.start.x) / self.scale

    def point(self, z) -> Point:
        """What the search knows at z."""
        point = self.search.evaluate(self.start.x + self.scale * np.asarray(z))
        if point.finite:
            return point
        value, gradient = barrier_value(self.search.current, point.x)
        return self.search.current._replace(x=point.x, value=value, gradient=gradient)

    def objective(self, z):
        point = self.point(z)
        return point.value / self.unit, point.gradient * self.scale / self.unit

    def room(self, z):
        """(k,) how far the rows are from their limits, relative."""
        return -self.point(z).excess[self.search.rows]

    def room_slopes(self, z):
        return -self.point(z).slopes * self.scale

    def accept(self, z) -> bool:
        """A step of the optimiser; whether to stop."""
        point = self.search.evaluate(self.start.x + self.scale * np.asarray(z))
        if not point.finite or np.array_equal(point.x, self.search.current.x):
            return False
        stop = self.search.accept(point, by_decrease=False)
        return stop or self.search.is_at_rest()


def run_constrained(search: ConstrainedSearch, steps: int, engine: Callable) -> None:
    """Run an optimiser until it converges with all limits, those taken up on the way included.

    Where it ends outside of the limits, what exceeds them most is made small first.  Where it finds no way on, it
    begins once more from there, and again while that helps: what it had learned of the curvature may have been
    rounding.
    """
    restored, before = False, math.inf
    for _ in range(_ROUNDS):
        if search.steps < steps and not search.reason:
            engine(search, steps - search.steps)
        if search.reason:
            break
        if search.steps >= steps:
            search.reason = "step limit"
        elif search.is_missing():
            search.update_working_set()
        elif search.is_proven():
            search.reason = "converged"
        elif search.current.violation > FEASIBILITY and not restored:
            restored = True
            restore_feasibility(search, steps - search.steps)
        elif search.residual < 0.5 * before:
            before = search.residual
        else:
            search.reason = search.stuck()
    if search.best.violation > FEASIBILITY:
        search.reason = f"no design found that keeps all limits: {search.worst()}"


def slsqp(search: ConstrainedSearch, steps: int) -> None:
    """SciPy's sequential quadratic programming."""
    from scipy.optimize import minimize

    scaled = ScaledProblem(search)
    minimize(
        scaled.objective,
        np.zeros(len(scaled.scale)),
        jac=True,
        method="SLSQP",
        bounds=np.stack([scaled.lower, scaled.upper], axis=1),
        constraints={"type": "ineq", "fun": scaled.room, "jac": scaled.room_slopes},
        callback=_scipy_callback(scaled),
        options={"maxiter": steps, "ftol": 1e-15},
    )


def trust_constr(search: ConstrainedSearch, steps: int) -> None:
    """SciPy's interior points within a trust region."""
    from scipy.optimize import BFGS, NonlinearConstraint, minimize

    class Curvature(BFGS):
        def update(self, delta_x, delta_grad):
            if np.any(delta_grad):  # of a linear function there is none to be learned, SciPy would warn of it
                super().update(delta_x, delta_grad)

    scaled = ScaledProblem(search)
    limits = NonlinearConstraint(scaled.room, 0.0, np.inf, jac=scaled.room_slopes, hess=Curvature())
    minimize(
        scaled.objective,
        np.zeros(len(scaled.scale)),
        jac=True,
        hess=Curvature(),
        method="trust-constr",
        bounds=np.stack([scaled.lower, scaled.upper], axis=1),
        constraints=limits if len(search.rows) else (),
        callback=_scipy_callback(scaled),
        options={
            "maxiter": steps,
            "gtol": 0.0,  # it is met inside of a barrier too, far from the limits
            "xtol": 1e-14,
            "barrier_tol": 1e-10,
            "initial_barrier_parameter": 1e-3,
            "initial_barrier_tolerance": 1e-3,
            "factorization_method": "SVDFactorization" if len(search.rows) else None,  # they may contradict
        },
    )


def nlopt_optimiser(name: str) -> Callable:
    """MMA or CCSAQ of nlopt: convex approximations of Svanberg.

    Raises: ImportError where nlopt is not installed.
    """
    try:
        import nlopt
    except ImportError as error:
        raise ImportError(f"the optimiser {name!r} is one of nlopt: pip install nlopt") from error

    def engine(search: ConstrainedSearch, steps: int) -> None:
        scaled, n = ScaledProblem(search), len(search.variables.start)
        optimiser = nlopt.opt(getattr(nlopt, f"LD_{name}"), n)

        def objective(z, gradient):
            if gradient.size and scaled.accept(z):
                raise nlopt.ForcedStop
            value, slopes = scaled.objective(z)
            if gradient.size:
                gradient[:] = slopes
            return float(value)

        def excess(result, z, slopes):
            result[:] = -scaled.room(z)
            if slopes.size:
                slopes[:] = -scaled.room_slopes(z)

        optimiser.set_min_objective(objective)
        if len(search.rows):
            optimiser.add_inequality_mconstraint(excess, np.full(len(search.rows), 1e-9))
        optimiser.set_lower_bounds(scaled.lower)
        optimiser.set_upper_bounds(scaled.upper)
        optimiser.set_maxeval(steps)
        optimiser.set_xtol_rel(1e-12)
        try:
            optimiser.optimize(np.clip(np.zeros(n), scaled.lower, scaled.upper))
        except (nlopt.ForcedStop, nlopt.RoundoffLimited):
            pass

    return engine


def restore_feasibility(search: ConstrainedSearch, steps: int) -> None:
    """From the current point, make the largest excess small; go on from what comes nearest."""
    from scipy.optimize import minimize

    scaled = ScaledProblem(search)
    n = len(scaled.scale)
    first, last = np.r_[np.zeros(n), search.current.violation], np.r_[np.zeros(n), 1.0]
    minimize(
        lambda z: (z[n], last),
        first,
        jac=True,
        method="SLSQP",
        bounds=[*zip(scaled.lower, scaled.upper, strict=True), (0.0, None)],
        constraints={
            "type": "ineq",
            "fun": lambda z: z[n] + scaled.room(z[:n]),
            "jac": lambda z: np.column_stack([scaled.room_slopes(z[:n]), np.ones(len(search.rows))]),
        },
        options={"maxiter": steps, "ftol": 1e-12},
    )
    search.continue_from_best()


def _scipy_callback(scaled: ScaledProblem) -> Callable:
    """The callback of SciPy's optimisers."""

    def callback(intermediate_result):
        if scaled.accept(intermediate_result.x):
            raise StopIteration

    return callback


SCIPY_OPTIMISERS = {
    "SLSQP": slsqp,
    "trust-constr": trust_constr,
}
NLOPT_OPTIMISERS = ("MMA", "CCSAQ")
