"""Rates and gradients of kinematic trees: CPU time per sample beside Pinocchio's `abaInParallel`.

`simulate` integrates the canonical formulation, (q, p) -> (q_dot, p_dot): similar work to Pinocchio's articulated
body algorithm on one thread, not the same function; `forward_dynamics` is the same function.  Batches run as
`mbs.batch` runs them on one thread: `vmap` over as many samples as it puts side by side, chunk after chunk.  B=1
is the cost inside one compiled loop that feeds each result into the next evaluation.  The gradient is that of a
scalar functional of both rates with respect to every parameter of every body, q and p, for each sample by itself.
"""

import functools

import common
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
from jax import lax
from random_trees import our_system, pinocchio_model, random_links

import jaxmbs as mbs
from jaxmbs.kinematics._configuration import at_state
from jaxmbs.motion._formulations import Canonical
from jaxmbs.runtime import tuning

CASES = tuple(("chain", n) for n in (7, 30, 100, 300)) + (("tree", 30), ("tree", 100))
QUICK = (("tree", 7),)
PEER = "pinocchio abaInParallel, 1 thread"
CHECKED = "q_dot", "p_dot", "accelerations"
STEP = 1e-6  # of the loop at B=1: each evaluation sees a slightly new state


class Case:
    """A random tree with states for it, in this library and in Pinocchio."""

    def __init__(self, shape, n, batch):
        links = random_links(shape, n, seed=n)
        system = our_system(links)
        self.shape, self.n, self.batch, self.system = shape, n, batch, system
        self.problem = Canonical.begin(system, at_state(system, mbs.State.at(system)), jnp.zeros(n))[0]
        self.P = self.problem.P
        self.model = pinocchio_model(links)
        self.pool, self.data = pin.ModelPool(self.model, 1), self.model.createData()
        rng = np.random.default_rng(1)
        self.q, self.v = rng.uniform(-np.pi, np.pi, (batch, n)), rng.normal(size=(batch, n))
        self.p = np.stack([self.momentum(q, v) for q, v in zip(self.q, self.v, strict=True)])

    def name(self, batch):
        return f"{self.shape} N={self.n} B={batch}"

    def momentum(self, q, v):
        """p = M v by Pinocchio: inverse dynamics of the acceleration v at rest, less the weight."""
        weight = pin.rnea(self.model, self.data, q, 0.0 * v, 0.0 * v).copy()
        return pin.rnea(self.model, self.data, q, 0.0 * v, v) - weight

    def rate(self, P, q, p):
        """(q_dot, p_dot) of one sample: the vector field of `simulate`, whose momenta are scaled."""
        problem = eqx.tree_at(lambda problem: problem.P, self.problem, P)
        q_dot, rate, _ = problem.rate(jnp.zeros(()), (q, p / problem.scale, jnp.zeros(0)))
        return q_dot, rate * problem.scale

    def accelerations(self, q, v):
        state = mbs.State(jnp.zeros(()), q, v, structure=self.system.topology.structure)
        return mbs.forward_dynamics(self.system, state)[0]

    def functional(self, P, q, p):
        """A scalar of both rates of one sample: fixed weights that favour no body."""
        u, p_dot = self.rate(P, q, p)
        weight = jnp.cos(jnp.arange(self.n, dtype=q.dtype))
        return jnp.sum(weight * u + 0.1 * p_dot / (1.0 + weight * weight))

    def gradient(self, P, q, p):
        return jax.grad(self.functional, argnums=(0, 1, 2))(P, q, p)

    def chunks(self, samples):
        """(chunks, samples of a chunk, nodes), from (B, nodes)."""
        return jnp.asarray(samples).reshape(-1, min(self.batch, tuning.CHUNK), self.n)


def check(case, samples=4):
    """Largest relative errors of q_dot = v, p_dot = C^T v - weight and the accelerations against Pinocchio."""
    q, v, p = (jnp.asarray(x[:samples]) for x in (case.q, case.v, case.p))
    u, p_dot = jax.jit(jax.vmap(case.rate, (None, 0, 0)))(case.P, q, p)
    a = jax.jit(jax.vmap(case.accelerations))(q, v)
    errors = []
    for i in range(samples):
        q, v = case.q[i], case.v[i]
        C = pin.computeCoriolisMatrix(case.model, case.data, q, v)
        expected = C.T @ v - pin.computeGeneralizedGravity(case.model, case.data, q)
        aba = pin.aba(case.model, case.data, q, v, 0.0 * v)
        errors.append([_relative(u[i], v), _relative(p_dot[i], expected), _relative(a[i], aba)])
    worst = np.max(errors, axis=0)
    if not np.all(worst < 1e-9):
        raise RuntimeError(f"{case.name(samples)} disagrees with Pinocchio: {dict(zip(CHECKED, worst, strict=True))}")
    return worst


def _relative(actual, expected):
    return np.max(np.abs(np.asarray(actual) - expected)) / np.max(np.abs(expected))


# -------------------------------------------------------------------------------------------------- what is timed
def batch_driver(function):
    """`function(*sample)` over the chunks of a batch, one after another."""
    return lambda *samples: lax.map(lambda chunk: jax.vmap(function)(*chunk), samples)


def loop(function, count):
    """`count` evaluations of the rates of one sample's pair in one compiled loop."""

    def step(pair, _):
        rates = function(*pair)
        return jax.tree.map(lambda x, rate: x + STEP * rate, pair, rates), None

    return lambda *pair: lax.scan(step, pair, None, length=count)[0]


def gradient_loop(case, count):
    """`count` gradients of one sample in one compiled loop; all of each gradient enters the next evaluation."""

    def step(state, _):
        return jax.tree.map(lambda x, g: x + STEP * STEP * g, state, case.gradient(*state)), None

    return lambda P, q, p: lax.scan(step, (P, q, p), None, length=count)[0]


def pinocchio_batch(case, count):
    q, v = (np.asfortranarray(x[:count].T) for x in (case.q, case.v))
    tau, a = np.zeros_like(v, order="F"), np.zeros_like(v, order="F")
    return lambda: pin.abaInParallel(1, case.pool, q, v, tau, a)


# ------------------------------------------------------------------------------------------------------- the rows
def goals(shape, n):
    """Printed beside the figures: (batch, one sample)."""
    one = "<=5" if n < 30 else "<=2"
    return "<=1.0" if shape == "chain" else "<=1.3", one


def batch_rows(case, rounds):
    q, v, p = (case.chunks(x) for x in (case.q, case.v, case.p))
    programs = {
        "rate": (batch_driver(lambda q, p: case.rate(case.P, q, p)), (q, p)),
        "forward dynamics": (batch_driver(case.accelerations), (q, v)),
        "gradient": (batch_driver(lambda q, p: case.gradient(case.P, q, p)), (q, p)),
    }
    return rows(case, case.batch, programs, dict.fromkeys(programs, case.batch), case.batch, rounds)


def single_rows(case, rounds):
    count = 100
    q, v, p = (jnp.asarray(x[0]) for x in (case.q, case.v, case.p))
    programs = {
        "rate": (loop(lambda q, p: case.rate(case.P, q, p), count), (q, p)),
        "forward dynamics": (loop(lambda q, v: (v, case.accelerations(q, v)), count), (q, v)),
        "gradient": (gradient_loop(case, count), (case.P, q, p)),
    }
    return rows(case, 1, programs, dict.fromkeys(programs, count), min(case.batch, 256), rounds)


def rows(case, batch, programs, counts, samples, rounds):
    """Rows of one case: CPU microseconds per sample, and CPU seconds to compile."""
    name, goal = case.name(batch), goals(case.shape, case.n)[batch == 1]
    functions, seconds = {"peer": pinocchio_batch(case, samples)}, {}
    for which, (function, arguments) in programs.items():
        program, seconds[which] = common.compiled(function, *arguments, often=batch > 1)
        functions[which] = functools.partial(program, *arguments)
    counts = counts | {"peer": samples}
    times = {which: 1e6 * time / counts[which] for which, time in common.cpu_seconds(functions, rounds).items()}
    unit, peer, one = "us CPU per sample", (PEER, times["peer"], goal), ("one rate, ours", times["rate"], "<=4")
    return [
        common.row(name, "rate that simulate integrates", times["rate"], unit, *peer),
        common.row(name, "forward_dynamics", times["forward dynamics"], unit, *peer),
        common.row(name, "gradient of the rate, all parameters", times["gradient"], unit, *one),
        common.row(name, "compile rate", seconds["rate"], "s CPU", goal="<5 s"),
        common.row(name, "compile forward_dynamics", seconds["forward dynamics"], "s CPU", goal="<5 s"),
        common.row(name, "compile gradient", seconds["gradient"], "s CPU", goal="<10 s"),
    ]


def main():
    parser = common.parser(__doc__, *(f"'{shape} N={n}'" for shape, n in CASES))
    options = parser.parse_args()
    rounds = 2 if options.quick else 7
    found = []
    for shape, n in QUICK if options.quick else CASES:
        if not common.wanted(options, f"{shape} N={n}"):
            continue
        case = Case(shape, n, 64 if options.quick else 256 if n >= 300 else 1024)
        errors = check(case)
        found += [
            common.row(f"{shape} N={n}", f"relative error of {what}", error, "1", "pinocchio", goal="<1e-9")
            for what, error in zip(CHECKED, errors, strict=True)
        ]
        found += batch_rows(case, rounds) + single_rows(case, rounds)
        print(f"{shape} N={n} done", flush=True)
    common.report(found, options)


if __name__ == "__main__":
    main()
