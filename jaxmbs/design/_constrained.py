"""Optimisers with constraints: SciPy's SLSQP and trust-constr, and MMA and CCSAQ of nlopt where installed."""

import math
from collections.abc import Callable

import numpy as np

from ._optimisers import barrier_value
from ._search import Point
from ._working_set import FAR_OUTSIDE, FEASIBILITY, ConstrainedSearch

#: Largest number of runs of an optimiser, each with a new working set or from a better point; a few are usual.
_ROUNDS = 30


class ScaledProblem:
    """A search as functions of scaled variables z (n,): x = x_start + scale * z, from the current point.

    A trial that is not finite gets the value of a barrier, which turns a line search back, and the current
    constraints.
    """

    def __init__(self, search: ConstrainedSearch) -> None:
        self.search, self.start = search, search.current
        self.scale, variables = search.variables.scale, search.variables
        self.unit = float(np.max(np.abs(self.start.gradient * self.scale))) or 1.0
        self.lower = (variables.lower - self.start.x) / self.scale
        self.upper = (variables.upper - self.start.x) / self.scale

    def evaluate(self, z: np.ndarray, slopes: bool = False) -> Point:
        """The evaluated point at z, with its gradients or with its values alone."""
        point = self.search.evaluate(self.start.x + self.scale * np.asarray(z), slopes)
        if point.finite:
            return point
        value, gradient = barrier_value(self.search.current, point.x)
        return self.search.current._replace(x=point.x, value=value, gradient=gradient)

    def objective(self, z: np.ndarray) -> float:
        """Scaled objective."""
        return self.evaluate(z).value / self.unit

    def gradient(self, z: np.ndarray) -> np.ndarray:
        """Gradient (n,) of the scaled objective."""
        return self.evaluate(z, slopes=True).gradient * self.scale / self.unit

    def constraint_margin(self, z: np.ndarray) -> np.ndarray:
        """Margins -c (k,) of the working set, not negative where the limits are satisfied (SciPy's sign)."""
        return -self.evaluate(z).constraints[self.search.working_set]

    def margin_jacobian(self, z: np.ndarray) -> np.ndarray:
        """Jacobian (k, n) of `constraint_margin`."""
        return -self.evaluate(z, slopes=True).jacobian * self.scale

    def accept(self, z: np.ndarray) -> bool:
        """Accept a step of the optimiser; returns True to stop."""
        point = self.search.evaluate(self.start.x + self.scale * np.asarray(z))
        if not point.finite or np.array_equal(point.x, self.search.current.x):
            return False
        stop = self.search.accept(point, by_decrease=False)
        is_outside = self.search.is_working_set_insufficient(FAR_OUTSIDE)
        return stop or is_outside or self.search.is_working_set_optimal()


def run_constrained(search: ConstrainedSearch, steps: int, optimiser: Callable) -> None:
    """Run an optimiser until it converges with all limits, those that become active on the way included.

    If it ends at an infeasible point, feasibility is restored once.  If it finds no further step, it is started again
    from there, as long as that halves the residual: its approximation of the curvature may have been rounding.
    """
    restored, before = False, math.inf
    for _ in range(_ROUNDS):
        if search.steps < steps and not search.reason:
            optimiser(search, steps - search.steps)
        if search.reason:
            break
        if search.steps >= steps:
            search.reason = "step limit"
        elif search.is_working_set_insufficient():
            search.update_working_set()
        elif search.is_best_optimal():
            search.reason = "converged"
        elif search.current.violation > FEASIBILITY and not restored:
            restored = True
            restore_feasibility(search, steps - search.steps)
        elif search.residual < 0.5 * before:
            before = search.residual
        else:
            search.reason = search.failure_reason()
    if search.best.violation > FEASIBILITY:
        search.reason = f"no design found that satisfies all limits: {search.describe_violations()}"


def slsqp(search: ConstrainedSearch, steps: int) -> None:
    """Sequential quadratic programming by SciPy's SLSQP.

    Its own tolerance is below rounding: `ScaledProblem.accept` decides on convergence, by the KKT residual.
    """
    from scipy.optimize import minimize

    scaled = ScaledProblem(search)
    minimize(
        scaled.objective,
        np.zeros(len(scaled.scale)),
        jac=scaled.gradient,
        method="SLSQP",
        bounds=np.stack([scaled.lower, scaled.upper], axis=1),
        constraints={"type": "ineq", "fun": scaled.constraint_margin, "jac": scaled.margin_jacobian},
        callback=_scipy_callback(scaled),
        options={"maxiter": steps, "ftol": 1e-15},
    )


def trust_constr(search: ConstrainedSearch, steps: int) -> None:
    """Interior points within a trust region by SciPy's trust-constr."""
    from scipy.optimize import BFGS, NonlinearConstraint, minimize

    class Curvature(BFGS):
        """BFGS that skips updates without curvature: SciPy warns of them for linear functions."""

        def update(self, delta_x: np.ndarray, delta_grad: np.ndarray) -> None:
            if np.any(delta_grad):
                super().update(delta_x, delta_grad)

    scaled = ScaledProblem(search)
    limits = NonlinearConstraint(scaled.constraint_margin, 0.0, np.inf, jac=scaled.margin_jacobian, hess=Curvature())
    minimize(
        scaled.objective,
        np.zeros(len(scaled.scale)),
        jac=scaled.gradient,
        hess=Curvature(),
        method="trust-constr",
        bounds=np.stack([scaled.lower, scaled.upper], axis=1),
        constraints=limits if len(search.working_set) else (),
        callback=_scipy_callback(scaled),
        options={
            "maxiter": steps,
            "gtol": 0.0,  # off: it is met for a barrier parameter that is still large, far from the limits
            "xtol": 1e-14,
            "barrier_tol": 1e-10,
            # SciPy starts at 0.1, which pushes a design away from limits that it is usually near; each decrease of
            # the barrier (a factor of five) costs evaluations.  Variables and constraints are scaled to the size of
            # one.
            "initial_barrier_parameter": 1e-3,
            "initial_barrier_tolerance": 1e-3,
            "factorization_method": "SVDFactorization" if len(search.working_set) else None,  # rows may be dependent
        },
    )


def nlopt_optimiser(name: str) -> Callable:
    """MMA or CCSAQ of nlopt: convex separable approximations (Svanberg 2002).

    Raises: ImportError where nlopt is not installed.
    """
    try:
        import nlopt
    except ImportError as error:
        raise ImportError(
            f"the optimiser {name!r} belongs to nlopt, which is not installed: pip install nlopt"
        ) from error

    def run(search: ConstrainedSearch, steps: int) -> None:
        scaled, n = ScaledProblem(search), len(search.variables.start)
        optimiser = nlopt.opt(getattr(nlopt, f"LD_{name}"), n)

        def objective(z, gradient):
            if gradient.size and scaled.accept(z):
                raise nlopt.ForcedStop
            if gradient.size:
                gradient[:] = scaled.gradient(z)
            return float(scaled.objective(z))

        def constraints(result, z, jacobian):
            result[:] = -scaled.constraint_margin(z)
            if jacobian.size:
                jacobian[:] = -scaled.margin_jacobian(z)

        optimiser.set_min_objective(objective)
        if len(search.working_set):
            optimiser.add_inequality_mconstraint(constraints, np.full(len(search.working_set), 1e-9))
        optimiser.set_lower_bounds(scaled.lower)
        optimiser.set_upper_bounds(scaled.upper)
        optimiser.set_maxeval(steps)
        optimiser.set_xtol_rel(1e-12)
        try:
            optimiser.optimize(np.clip(np.zeros(n), scaled.lower, scaled.upper))
        except (nlopt.ForcedStop, nlopt.RoundoffLimited):
            pass

    return run


def restore_feasibility(search: ConstrainedSearch, steps: int) -> None:
    """Minimise the largest violation from the current point; continue from the best point found."""
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
            "fun": lambda z: z[n] + scaled.constraint_margin(z[:n]),
            "jac": lambda z: np.column_stack([scaled.margin_jacobian(z[:n]), np.ones(len(search.working_set))]),
        },
        options={"maxiter": steps, "ftol": 1e-12},
    )
    search.restart_from_best()


def _scipy_callback(scaled: ScaledProblem) -> Callable:
    """Callback of SciPy's optimisers: accept the step, and stop where the search ends."""

    def callback(intermediate_result):
        if scaled.accept(intermediate_result.x):
            raise StopIteration

    return callback


SCIPY_OPTIMISERS = {
    "SLSQP": slsqp,
    "trust-constr": trust_constr,
}
NLOPT_OPTIMISERS = ("MMA", "CCSAQ")
