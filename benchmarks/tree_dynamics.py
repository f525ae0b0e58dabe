"""Forward dynamics of kinematic trees and its gradient: CPU time per sample beside Pinocchio's `abaInParallel`.

Ours is the whole Hamiltonian right-hand side (q, p) -> (q_dot, p_dot); Pinocchio's articulated-body algorithm on one
thread is similar work, not the same function.  Batches run in chunks, batch axis last.  B=1 is the cost inside one
compiled loop that feeds each result into the next evaluation.  The gradient is that of a scalar functional of both
rates with respect to every parameter of every body, q and p, for each sample by itself.
"""

import common
import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
from jax import lax
from random_trees import our_system, pinocchio_model, random_links

from jaxmbs.dynamics._hamilton import tree_state_rate
from jaxmbs.kinematics._poses import node_parameters

CASES = tuple(("chain", n) for n in (7, 30, 100, 300)) + (("tree", 30), ("tree", 100))
QUICK = (("tree", 7),)
PEER = "pinocchio abaInParallel, 1 thread"
STEP = 1e-6  # of the loop at B=1: each evaluation sees a slightly new state


class Case:
    """A random tree with states for it, in this library and in Pinocchio."""

    def __init__(self, shape, n, batch):
        links = random_links(shape, n, seed=n)
        system = our_system(links)
        self.shape, self.n, self.batch = shape, n, batch
        self.topology, self.gravity, self.P = system.topology, system.gravity, node_parameters(system)
        self.model = pinocchio_model(links)
        self.pool, self.data = pin.ModelPool(self.model, 1), self.model.createData()
        rng = np.random.default_rng(1)
        self.q, self.v = rng.uniform(-np.pi, np.pi, (n, batch)), rng.normal(size=(n, batch))
        self.p = np.stack([self.momentum(q, v) for q, v in zip(self.q.T, self.v.T, strict=True)], axis=1)

    def name(self, batch):
        return f"{self.shape} N={self.n} B={batch}"

    def momentum(self, q, v):
        """p = M v by Pinocchio: inverse dynamics of the acceleration v at rest, less the weight."""
        weight = pin.rnea(self.model, self.data, q, 0.0 * v, 0.0 * v).copy()
        return pin.rnea(self.model, self.data, q, 0.0 * v, v) - weight

    def rate(self, P, q, p):
        return tree_state_rate(self.topology, P, q, p, self.gravity)

    def functional(self, P, q, p):
        """A scalar of both rates, per sample: fixed weights that favour no body."""
        u, p_dot = self.rate(P, q, p)
        weight = jnp.cos(jnp.arange(self.n, dtype=q.dtype)).reshape((-1,) + (1,) * (q.ndim - 1))
        return jnp.sum(weight * u + 0.1 * p_dot / (1.0 + weight * weight))

    def gradient(self, P, q, p):
        """Per sample: the parameters are copied along the batch, so each sample has its own derivatives."""
        P = jnp.broadcast_to(P.reshape(P.shape + (1,) * (q.ndim - 1)), P.shape + q.shape[1:])
        return jax.grad(self.functional, argnums=(0, 1, 2))(P, q, p)

    def chunk(self, samples):
        """(chunks, nodes, samples of a chunk), from (nodes, B): about 1 MB of state a chunk."""
        size = min(self.batch, 64 if self.n <= 30 else 16)
        return jnp.moveaxis(jnp.asarray(samples).reshape(self.n, -1, size), 1, 0)


def check(case, samples=4):
    """Largest relative errors of (q_dot, p_dot) against Pinocchio: q_dot = v, p_dot = C^T v - weight."""
    u, p_dot = jax.jit(case.rate)(case.P, jnp.asarray(case.q[:, :samples]), jnp.asarray(case.p[:, :samples]))
    errors = []
    for i in range(samples):
        q, v = case.q[:, i], case.v[:, i]
        C = pin.computeCoriolisMatrix(case.model, case.data, q, v)
        expected = C.T @ v - pin.computeGeneralizedGravity(case.model, case.data, q)
        errors.append([_relative(u[:, i], v), _relative(p_dot[:, i], expected)])
    worst = np.max(errors, axis=0)
    if not np.all(worst < 1e-9):
        raise RuntimeError(
            f"{case.name(samples)} disagrees with Pinocchio: q_dot {worst[0]:.1e}, p_dot {worst[1]:.1e}"
        )
    return worst


def _relative(actual, expected):
    return np.max(np.abs(np.asarray(actual) - expected)) / np.max(np.abs(expected))


# -------------------------------------------------------------------------------------------------- what is timed
def batch_driver(function):
    """`function(P, q, p)` over the chunks of a batch, one after another."""
    return lambda P, q, p: lax.map(lambda chunk: function(P, *chunk), (q, p))


def rate_loop(case, count):
    """`count` evaluations of one sample in one compiled loop."""

    def step(state, _):
        q, p = state
        u, p_dot = case.rate(case.P, q, p)
        return (q + STEP * u, p + STEP * p_dot), None

    return lambda q, p: lax.scan(step, (q, p), None, length=count)[0]


def gradient_loop(case, count):
    """`count` gradients of one sample in one compiled loop; all of each gradient enters the next evaluation."""

    def step(state, _):
        return jax.tree.map(lambda x, g: x + STEP * STEP * g, state, case.gradient(*state)), None

    return lambda P, q, p: lax.scan(step, (P, q, p), None, length=count)[0]


def pinocchio_batch(case, count):
    q, v = (np.asfortranarray(x[:, :count]) for x in (case.q, case.v))
    tau, a = np.zeros_like(v, order="F"), np.zeros_like(v, order="F")
    return lambda: pin.abaInParallel(1, case.pool, q, v, tau, a)


# ------------------------------------------------------------------------------------------------------- the rows
def goals(shape, n):
    """Printed beside the figures: (batch, one sample)."""
    one = "<=5" if n < 30 else "<=2"
    return "<=1.0" if shape == "chain" else "<=1.3", one


def batch_rows(case, rounds):
    q, p = case.chunk(case.q), case.chunk(case.p)
    forward, seconds = common.compiled(batch_driver(case.rate), case.P, q, p, often=True)
    reverse, reverse_seconds = common.compiled(batch_driver(case.gradient), case.P, q, p, often=True)
    times = common.cpu_seconds(
        {
            "ours": lambda: forward(case.P, q, p),
            "peer": pinocchio_batch(case, case.batch),
            "gradient": lambda: reverse(case.P, q, p),
        },
        rounds,
    )
    times = {name: 1e6 * value / case.batch for name, value in times.items()}
    return rows(case.name(case.batch), times, (seconds, reverse_seconds), goals(case.shape, case.n)[0])


def single_rows(case, rounds):
    count = 100
    q, p = jnp.asarray(case.q[:, 0]), jnp.asarray(case.p[:, 0])
    forward, seconds = common.compiled(rate_loop(case, count), q, p)
    reverse, reverse_seconds = common.compiled(gradient_loop(case, count), case.P, q, p)
    samples = min(case.batch, 256)
    times = common.cpu_seconds(
        {
            "ours": lambda: forward(q, p),
            "peer": pinocchio_batch(case, samples),
            "gradient": lambda: reverse(case.P, q, p),
        },
        rounds,
    )
    per = {"ours": count, "gradient": count, "peer": samples}
    times = {name: 1e6 * value / per[name] for name, value in times.items()}
    return rows(case.name(1), times, (seconds, reverse_seconds), goals(case.shape, case.n)[1])


def rows(name, times, seconds, goal):
    """Rows of one case from microseconds per sample and compile seconds."""
    return [
        common.row(name, "forward dynamics", times["ours"], "us CPU per sample", PEER, times["peer"], goal),
        common.row(
            name,
            "gradient, all parameters",
            times["gradient"],
            "us CPU",
            "one evaluation, ours",
            times["ours"],
            "<=4",
        ),
        common.row(name, "compile forward", seconds[0], "s CPU", goal="<5 s"),
        common.row(name, "compile gradient", seconds[1], "s CPU", goal="<10 s"),
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
            for what, error in zip(("q_dot", "p_dot"), errors, strict=True)
        ]
        found += batch_rows(case, rounds) + single_rows(case, rounds)
        print(f"{shape} N={n} done", flush=True)
    common.report(found, options)


if __name__ == "__main__":
    main()
