"""Reactions of networks of rigid bodies: growth, gradients and batches, beside direct solvers in the same run.

Ours, `bond_reactions`, goes from joint positions and loads to the wrenches of all bonds.  The peers are given the
nodal matrix `Q C^-1 Q^T` (6 p, 6 p), its assembly not counted, and factorise and solve it: dense Gauss (LAPACK),
SuperLU, CHOLMOD with its symbolic analysis reused (cvxopt), KLU with analysis and pivots reused (klujax).
"block solver" is our sparse Cholesky on that same matrix.  CPU time throughout, one thread.
"""

import time

import common
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
import scipy.sparse.linalg as spl
from networks import SHAPES, Case

from jaxmbs import blocksparse as bs

SIZES, QUICK_SIZES, QUICK_SHAPES = (10, 100, 1000, 10_000), (30,), ("chain", "loops")
DENSE_UP_TO = 1000
BATCH_ENTRIES = 500  # bodies of the systems solved together


# ------------------------------------------------------------------------------------------------------- the peers
def superlu(matrix, right):
    return lambda: spl.splu(matrix).solve(right)


def cholmod(matrix, right):
    import cvxopt
    from cvxopt import cholmod

    coo = scipy.sparse.tril(matrix).tocoo()  # it reads the lower half
    A = cvxopt.spmatrix(coo.data, coo.row.tolist(), coo.col.tolist(), matrix.shape)
    factor = cholmod.symbolic(A)

    def solve():
        x = cvxopt.matrix(right)
        cholmod.numeric(A, factor)
        cholmod.solve(factor, x)
        return np.asarray(x).ravel()

    return solve


def klu(matrix, right):
    """Analysis and pivot order from a first factorisation; each call refactorises and solves."""
    import klujax

    coo = matrix.tocoo()
    i, j, x = jnp.asarray(coo.row, jnp.int32), jnp.asarray(coo.col, jnp.int32), jnp.asarray(coo.data)
    symbolic = klujax.analyze(i, j, matrix.shape[0])
    numeric = klujax.factor(i, j, x, symbolic)
    b = jnp.asarray(right)
    return lambda: klujax.refactor_and_solve(i, j, x, b, numeric, symbolic)[0]


def klu_batch(matrix, right, batch):
    """All systems of a batch in one call, the analysis reused."""
    import klujax

    coo = matrix.tocoo()
    i, j = jnp.asarray(coo.row, jnp.int32), jnp.asarray(coo.col, jnp.int32)
    x, b = jnp.tile(jnp.asarray(coo.data), (batch, 1)), jnp.tile(jnp.asarray(right), (batch, 1))
    symbolic = klujax.analyze(i, j, matrix.shape[0])
    solve = jax.jit(lambda x, b: klujax.solve_with_symbol(i, j, x, b, symbolic))
    return lambda: solve(x, b)


def dense(matrix, right):
    full = matrix.toarray()
    return lambda: np.linalg.solve(full, right)


def dense_batch(matrix, right, batch, chunk=50):
    """`vmap` of the dense solve, in chunks."""
    full, b = jnp.asarray(matrix.toarray()), jnp.asarray(right)
    scale = jnp.linspace(1.0, 2.0, batch)
    solve = jax.jit(lambda s: jax.lax.map(lambda k: jnp.linalg.solve(k * full, b), s, batch_size=chunk))
    return lambda: solve(scale)


def block_solver(case, matrix, right):
    """Our sparse Cholesky on the peers' matrix."""
    parent, child = case.bonds.network.ends
    inside = (parent < case.p) & (child < case.p)
    pattern = bs.Pattern(case.p, 6, np.stack([parent, child], axis=1)[inside])
    rows = matrix.tobsr(blocksize=(6, 6))
    i = np.repeat(np.arange(case.p), np.diff(rows.indptr))
    order = {(a, b): k for k, (a, b) in enumerate(zip(i.tolist(), rows.indices.tolist(), strict=True))}
    diagonal = rows.data[[order[k, k] for k in range(case.p)]]
    upper = rows.data[[order[a, b] for a, b in pattern.edges.tolist()]].reshape(-1, 6, 6)
    A = bs.BlockMatrix(pattern, jnp.asarray(diagonal), jnp.asarray(upper))
    b = jnp.asarray(right).reshape(case.p, 6)
    solve = jax.jit(bs.solve_once).lower(A, b).compile()
    return lambda: solve(A, b)


def optional(make, *args):
    try:
        return make(*args)
    except ImportError:
        return None


PEERS = {"SuperLU": superlu, "CHOLMOD, symbolic reused": cholmod, "klujax, symbolic and pivots reused": klu}


# -------------------------------------------------------------------------------------------------------- one case
def analysis_seconds(case, *args):
    """Host analysis: the first trace less a second one, which finds the analysis done."""
    times = []
    for _ in range(2):
        jax.clear_caches()
        start = time.process_time()
        jax.eval_shape(case.value, *args)
        times.append(time.process_time() - start)
    return max(times[0] - times[1], 0.0)


def check(case, matrix, K, right):
    """Largest relative errors: of our wrenches against the peers' solution, of equilibrium."""
    ours = np.asarray(jax.jit(case.wrenches)(case.bonds.position, case.loads))
    theirs = case.wrenches_from(spl.spsolve(matrix, right), K)
    parent, child = case.bonds.network.ends
    total = np.zeros((case.p + 1, 6))
    np.add.at(total, child, ours)
    np.add.at(total, parent, -ours)
    scale = np.abs(ours).max()
    return np.abs(ours - theirs).max() / scale, np.abs(total[:-1] - np.asarray(case.loads)).max() / scale


def single_rows(shape, p, rounds):
    case = Case(shape, p)
    name, args = f"{shape} p={p}", (case.bonds.position, case.loads)
    host = analysis_seconds(case, *args)
    value, seconds = common.compiled(case.value, *args)
    gradient, gradient_seconds = common.compiled(case.value_and_gradient, *args)
    tangent, _ = common.compiled(case.value_and_tangent, *args)
    matrix, K = case.nodal()
    right = np.asarray(case.loads).ravel()
    functions = {"ours": lambda: value(*args), "gradient": lambda: gradient(*args), "tangent": lambda: tangent(*args)}
    functions["block solver"] = block_solver(case, matrix, right)
    functions |= {peer: optional(make, matrix, right) for peer, make in PEERS.items()}
    functions = {peer: function for peer, function in functions.items() if function}
    times = common.cpu_seconds(functions, rounds)
    if p <= DENSE_UP_TO:
        times |= common.cpu_seconds({"dense Gauss": dense(matrix, right)}, 1, 0.0)
    error, residual = check(case, matrix, K, right)
    milli = {peer: 1e3 * t for peer, t in times.items()}
    memory = value.memory_analysis().temp_size_in_bytes / 2**20
    row = lambda metric, *rest, **more: common.row(name, metric, *rest, **more)
    found = [
        row("reactions", milli["ours"], "ms CPU", peer, milli[peer], goal=goal(shape, p, peer))
        for peer in milli
        if peer not in ("ours", "gradient", "tangent", "block solver")
    ]
    found += [
        row("block solver, the peers' matrix", milli["block solver"], "ms CPU", peer, milli[peer])
        for peer in PEERS
        if peer in milli
    ]
    found += [
        row("value and gradient, all joint positions", milli["gradient"], "ms CPU", "value", milli["ours"], "<=2.5"),
        row("value and one tangent, forward mode", milli["tangent"], "ms CPU", "value", milli["ours"]),
        row("host analysis", host, "s CPU"),
        row("compile value", seconds, "s CPU", goal="<5 at 1000, <10 at 10 000"),
        row("compile value and gradient", gradient_seconds, "s CPU"),
        row("temporary memory", memory, "MB"),
        row("residual of equilibrium, relative", residual, "1", goal="<1e-12"),
        row("difference from the nodal solution, relative", error, "1"),
    ]
    return found, (times["ours"], memory)


def goal(shape, p, peer):
    if peer == "dense Gauss":
        return "<=1/300" if p == 1000 else ""
    if p < 10_000 or shape == "ladder":
        return ""
    return "<=1.5" if peer.startswith("CHOLMOD") else "<1"


def growth_rows(shape, points):
    """Exponents of time and memory over p, least squares in logarithms from p = 100."""
    sizes = np.log([p for p in points if p >= 100])
    if len(sizes) < 2:
        return []
    slopes = [np.polyfit(sizes, np.log([points[p][k] for p in points if p >= 100]), 1)[0] for k in (0, 1)]
    asked = "" if shape == "ladder" else "<1.15"
    name = f"{shape} p=100...{max(points)}"
    return [
        common.row(name, "exponent of the time", slopes[0], "1", goal=asked),
        common.row(name, "exponent of the temporary memory", slopes[1], "1", goal="1"),
    ]


# --------------------------------------------------------------------------------------------------------- batches
def batch_rows(shape, p, batch, rounds):
    """Systems with joint positions of their own, in chunks of bounded memory."""
    case = Case(shape, p)
    name = f"{shape} p={p} B={batch}"
    chunk = max(1, min(batch, BATCH_ENTRIES // p))
    noise = 0.01 * np.random.default_rng(2).normal(size=(batch, *case.bonds.position.shape))
    args = (case.bonds.position[None] + noise, jnp.tile(case.loads, (batch, 1, 1)))
    over = lambda function: lambda *xs: jax.lax.map(lambda x: function(*x), xs, batch_size=chunk)
    value, seconds = common.compiled(over(case.value), *args)
    gradient, _ = common.compiled(over(case.value_and_gradient), *args)
    matrix, _ = case.nodal()
    right = np.asarray(case.loads).ravel()
    functions = {"ours": lambda: value(*args), "gradient": lambda: gradient(*args)}
    functions["klujax, symbolic reused"] = optional(klu_batch, matrix, right, batch)
    if p <= 100:
        functions["vmap of jnp.linalg.solve"] = dense_batch(matrix, right, batch)
    times = common.cpu_seconds({k: f for k, f in functions.items() if f}, rounds)
    milli = {peer: 1e3 * t / batch for peer, t in times.items()}
    asked = {"vmap of jnp.linalg.solve": "<=1/15", "klujax, symbolic reused": "<=1/3" if shape == "tree" else "<1"}
    found = [
        common.row(name, "reactions", milli["ours"], "ms CPU per system", peer, milli[peer], asked[peer])
        for peer in asked
        if peer in milli
    ]
    found += [
        common.row(
            name, "value and gradient", milli["gradient"], "ms CPU per system", "value", milli["ours"], "<=2.5"
        ),
        common.row(name, "compile value", seconds, "s CPU"),
        common.row(name, "temporary memory", value.memory_analysis().temp_size_in_bytes / 2**20, "MB"),
    ]
    return found


def main():
    options = common.parser(__doc__, *SHAPES, "batch").parse_args()
    rounds = 2 if options.quick else 5
    found = []
    for shape in SHAPES:
        if not common.wanted(options, shape) or (options.quick and shape not in QUICK_SHAPES):
            continue
        points = {}
        for p in QUICK_SIZES if options.quick else SIZES:
            rows, points[p] = single_rows(shape, p, rounds)
            found += rows
            print(f"{shape} p={p} done", flush=True)
        found += growth_rows(shape, points)
    if common.wanted(options, "batch"):
        for p in (20,) if options.quick else (50, 100, 1000):
            for shape in ("tree",) if options.quick else ("tree", "loops"):
                found += batch_rows(shape, p, 8 if options.quick else 1000, 2 if p == 1000 else rounds)
                print(f"{shape} p={p} batch done", flush=True)
    common.report(found, options)


if __name__ == "__main__":
    main()
