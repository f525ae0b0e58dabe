"""Optimisers under limits: `design.interior_point` beside SLSQP and trust-constr of SciPy and, where `ipyopt` is
installed, IPOPT, on the problems of `hock_schittkowski` and of `machine_problems`.

    python benchmarks/optimisers.py [--only PROBLEM ... | --minimise] [--json FILE]

A problem counts as solved where the objective is within 1e-6 (relative, or absolute below one) of the published one
and no limit is violated by more than 1e-6, or where its verdict is the right one.
"""

import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

from common import parser, report, row  # first: sets what JAX reads at import

import jax  # isort: skip
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

sys.path.insert(0, str(Path(__file__).parent.parent))  # machines are those of the tests
from benchmarks.hock_schittkowski import PROBLEMS, Problem
from benchmarks.machine_problems import MACHINES, wishbone

NONE = lambda x: jnp.zeros(0)


class Outcome(NamedTuple):
    """Where an optimiser ended: objective, violation, evaluations of values, its verdict and CPU seconds."""

    value: float
    violation: float
    evaluations: int
    verdict: str
    seconds: float


class Functions:
    """A problem's functions as programs, with counts of the evaluations of the objective."""

    def __init__(self, problem: Problem):
        n = len(problem.start)
        self.start = np.array(problem.start, float)
        self.lower, self.upper = (np.full(n, x, float) for x in (problem.lower, problem.upper))
        self.e, self.c = problem.e or NONE, problem.c or NONE
        both = lambda x: jnp.concatenate([self.e(x), self.c(x)])
        program = lambda f: mbs.jit(f, compile="tape")
        self.f, self.gradient = program(lambda x: problem.f(x) * 1.0), program(jax.grad(problem.f))
        self.limits, self.jacobian = program(both), program(jax.jacfwd(both))
        lagrangian = lambda x, y, w: w * problem.f(x) + y @ both(x)
        self.hessian = program(jax.hessian(lagrangian))
        self.p, self.m = self.e(jnp.asarray(self.start)).size, self.c(jnp.asarray(self.start)).size
        self.count = 0

    def value(self, x):
        self.count += 1
        return float(self.f(jnp.array(x)))

    def outcome(self, x, verdict, begin) -> Outcome:
        seconds, found = time.process_time() - begin, np.asarray(self.limits(jnp.array(x)))
        over = np.concatenate([np.abs(found[: self.p]), found[self.p :], self.lower - x, x - self.upper, [0.0]])
        return Outcome(float(self.f(jnp.array(x))), float(np.max(over)), self.count, verdict, seconds)


def interior_point(problem: Problem, functions: Functions, hessian: str = "exact") -> Outcome:
    options = {"bounds": (functions.lower, functions.upper), "equalities": problem.e, "inequalities": problem.c}
    solve = lambda: mbs.design.interior_point(problem.f, functions.start, **options, hessian=hessian, compile="tape")
    solve()
    begin = time.process_time()
    found = solve()
    outcome = functions.outcome(np.asarray(found.design), found.reasons[int(found.reason)], begin)
    return outcome._replace(evaluations=int(found.evaluations))


def scipy(method: str):
    def run(problem: Problem, functions: Functions) -> Outcome:
        from scipy.optimize import Bounds, NonlinearConstraint, minimize

        p, m = functions.p, functions.m
        limits = lambda x: np.asarray(functions.limits(jnp.array(x)))
        slopes = lambda x: np.asarray(functions.jacobian(jnp.array(x)))
        parts = {"eq": (slice(0, p), 1.0), "ineq": (slice(p, p + m), -1.0)}
        constraints = [
            {"type": kind, "fun": lambda x, k=k, s=s: s * limits(x)[k], "jac": lambda x, k=k, s=s: s * slopes(x)[k]}
            for kind, (k, s) in parts.items()
            if k.stop > k.start
        ]
        options = {"maxiter": 1000}
        if method == "SLSQP":
            options["ftol"] = 1e-10
        else:
            ends = np.concatenate([np.zeros(p), np.full(m, -np.inf)]), np.zeros(p + m)
            constraints = [NonlinearConstraint(limits, *ends, jac=slopes)] if p + m else []
            options |= {"gtol": 1e-8, "xtol": 1e-10}
        begin = time.process_time()
        bounds = Bounds(functions.lower, functions.upper)
        gradient = lambda x: np.asarray(functions.gradient(jnp.array(x)))
        found = minimize(
            functions.value, functions.start, jac=gradient, method=method, bounds=bounds, constraints=constraints,
            options=options,
        )  # fmt: skip
        return functions.outcome(found.x, str(found.message), begin)

    return run


def ipopt(problem: Problem, functions: Functions) -> Outcome:
    import ipyopt

    n, rows = len(functions.start), functions.p + functions.m

    def fill(values, out):
        out[()] = np.asarray(values).ravel()
        return out

    lower = np.concatenate([np.zeros(functions.p), np.full(functions.m, -np.inf)])
    pairs = np.indices((rows, n)).reshape(2, -1)
    low = np.tril_indices(n)
    at = jnp.array
    solver = ipyopt.Problem(
        n, functions.lower, functions.upper, rows, lower, np.zeros(rows), tuple(pairs), low,
        functions.value, lambda x, out: fill(functions.gradient(at(x)), out),
        lambda x, out: fill(functions.limits(at(x)), out), lambda x, out: fill(functions.jacobian(at(x)), out),
        lambda x, y, w, out: fill(np.asarray(functions.hessian(at(x), at(y), at(float(w))))[low], out),
        ipopt_options={"print_level": 0, "sb": "yes", "tol": 1e-8},
    )  # fmt: skip
    begin = time.process_time()
    x, _, status = solver.solve(functions.start.copy())
    return functions.outcome(x, str(status), begin)


def is_solved(problem: Problem, outcome: Outcome) -> bool:
    """True for the published optimum, or the right verdict."""
    if isinstance(problem.value, str):
        words = {"infeasible": ("no design near", "incompatible", "2"), "unbounded": ("unbounded", "4")}
        return any(word in outcome.verdict.lower() for word in words[problem.value])
    near = abs(outcome.value - problem.value) <= 1e-6 * max(1.0, abs(problem.value))
    return near and outcome.violation <= 1e-6


def optimisers() -> dict:
    found = {
        "interior point": interior_point,
        "with BFGS": lambda *args: interior_point(*args, "bfgs"),
        "SLSQP": scipy("SLSQP"),
        "trust-constr": scipy("trust-constr"),
    }
    try:
        import ipyopt  # noqa: F401
    except ImportError:
        return found
    return found | {"IPOPT": ipopt}


def compare_in_minimise() -> list:
    """Rows of CPU seconds of `minimise` of all machines, compiling included, by SLSQP and by the interior point."""
    rows = []
    for title, problem in MACHINES.items():
        ends, start = (problem.lower, problem.upper), np.array(problem.start, float)
        bounds = tuple(np.broadcast_to(np.array(end, float), start.shape) for end in ends)
        for name in ("SLSQP", "interior point"):
            begin = time.process_time()
            limits = mbs.Limit("limits", problem.c, upper=0.0, scale=1.0)
            found = mbs.minimise(problem.f, start, bounds, name, 500, limits=limits, progress=False)
            seconds = time.process_time() - begin
            good = found.ok and abs(found.value - problem.value) <= 1e-6 * max(1.0, abs(problem.value))
            rows.append((f"minimise {title}", name, good, 0, seconds))
    return rows


def compare(problems: dict[str, Problem]) -> list:
    """Rows (problem, optimiser, is solved, evaluations, CPU seconds) of all problems; printed as they come."""
    runs, rows = optimisers(), []
    print("evaluations of the objective; (not solved)")
    print(f"{'':16}" + "".join(f"{name:>16}" for name in runs), flush=True)
    for title, problem in problems.items():
        cells = []
        for name, run in runs.items():
            try:
                outcome = run(problem, Functions(problem))
            except Exception as error:  # a peer that breaks has not solved it
                print(f"{title}, {name}: {error!r}", file=sys.stderr)
                outcome = Outcome(np.nan, np.inf, 0, repr(error), 0.0)
            good = is_solved(problem, outcome)
            cells.append(f"{outcome.evaluations}" if good else f"({outcome.evaluations})")
            rows.append((title, name, good, outcome.evaluations, outcome.seconds))
        print(f"{title:16}" + "".join(f"{cell:>16}" for cell in cells), flush=True)
    return rows


def main() -> None:
    problems = PROBLEMS | MACHINES | {"wishbone": wishbone()}
    arguments = parser(__doc__, *problems)
    arguments.add_argument("--minimise", action="store_true", help="only CPU seconds of `minimise` of all machines")
    options = arguments.parse_args()
    names = options.only or (("HS71", "gear box") if options.quick else problems)
    found = compare_in_minimise() if options.minimise else compare({name: problems[name] for name in names})
    rows = []
    for title, name, good, evaluations, seconds in found:
        case = f"{title}, {name}"
        rows += [row(case, "solved", int(good)), row(case, "running", seconds, "CPU s")]
        rows += [row(case, "evaluations", evaluations)] if evaluations else []
    for name in dict.fromkeys(line[1] for line in found):
        of_it = [line[2:] for line in found if line[1] == name]
        case = f"{len(of_it)} {'machines in minimise' if options.minimise else 'problems'}, {name}"
        solved, evaluations, seconds = (sum(column) for column in zip(*of_it, strict=True))
        rows += [row(case, "solved", int(solved)), row(case, "running", seconds, "CPU s")]
        rows += [row(case, "evaluations", evaluations)] if evaluations else []
    report(rows, options)


if __name__ == "__main__":
    main()
