"""Craig-Bampton of a large block, transfer functions of few pairs, the gradient of a peak of one.

The block is of 8-node hexahedra, joined by all nodes of one end face; SciPy does the same steps on the same matrices
in the same run: SuperLU of the interior, constraint modes, shift-invert Lanczos with that factor, projection.
Assembly is counted for neither.  Transfer functions: a chain of masses with springs of their own, structural damping.
CPU time throughout, one thread.
"""

import common
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as spl

from jaxmbs.elements import Hexahedron
from jaxmbs.fem import Structure, assemble_blocks
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import receptance

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


# ------------------------------------------------------------------------------------------------- Craig-Bampton
def block(length, width):
    """Nodes, blocks of the stiffness and the mass, nodes of an end face."""
    counts = np.array([length, width, width])
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in counts), indexing="ij"), axis=-1)
    nodes, index = grid.reshape(-1, 3) / width, np.arange(np.prod(counts + 1)).reshape(counts + 1)
    bricks = [index[a : length + a, b : width + b, c : width + c].ravel() for a, b, c in CORNERS]
    structure = Structure(nodes, {"block": (Hexahedron(70e9, 0.3, 2700.0), np.stack(bricks, axis=1))})
    return nodes, *assemble_blocks(structure), tuple(int(i) for i in index[-1].ravel())


def to_scipy(matrix):
    """As a compressed sparse matrix."""
    (n, b), (i, j) = matrix.pattern.shape, matrix.pattern.edges.T
    rows, columns = np.concatenate([np.arange(n), i, j]), np.concatenate([np.arange(n), j, i])
    values = np.concatenate([matrix.diagonal, matrix.upper, np.swapaxes(matrix.upper, 1, 2)])
    local = np.arange(b)
    place = lambda p, axis: np.broadcast_to(b * p[:, None, None] + np.expand_dims(local, axis), values.shape).ravel()
    return sparse.coo_matrix((values.ravel(), (place(rows, 1), place(columns, 0))), shape=(n * b, n * b)).tocsc()


def by_scipy(K, M, outer, num):
    """The reduced stiffness and mass by SuperLU and ARPACK."""
    inner = np.setdiff1d(np.arange(K.shape[0]), outer)
    K_in, M_in = K[inner][:, inner].tocsc(), M[inner][:, inner].tocsc()
    K_across, M_across = K[inner][:, outer], M[inner][:, outer]

    def run():
        lu = spl.splu(K_in, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        S = -lu.solve(K_across.toarray())
        inverse = spl.LinearOperator(K_in.shape, lu.solve)
        values, X = spl.eigsh(K_in, num, M_in, sigma=0.0, OPinv=inverse)
        inertia = M_in @ S + M_across.toarray()
        static = K[outer][:, outer].toarray() + K_across.T @ S
        M_oo = M[outer][:, outer].toarray() + M_across.T @ S + S.T @ inertia
        return static, M_oo, inertia.T @ X, values

    return run


def craig_bampton_rows(quick):
    length, width, num = (6, 3, 4) if quick else (50, 11, 30)
    nodes, K, M, face = block(length, width)
    outer = np.array([3 * i + d for i in face for d in range(3)])
    labels, places = (
        [(str(n), d) for n in range(len(nodes)) for d in "xyz"],
        (tuple(map(str, range(len(nodes)))), nodes),
    )

    def reduced(K, M):
        options = {"interface": outer.tolist(), "coordinates": labels, "positions": places}
        return reduce(LinearSystem(mass=M, stiffness=K, **options), CraigBampton(num))

    ours, seconds = common.compiled(reduced, K, M)
    theirs = by_scipy(to_scipy(K), to_scipy(M), outer, num)
    times = common.cpu_seconds({"ours": lambda: ours(K, M), "SciPy": theirs}, 1 if quick else 2, 0.0)
    found, (static, _, _, values) = ours(K, M), theirs()
    k = len(outer)
    mine = np.asarray(found.stiffness)
    name = f"block of {3 * len(nodes)} coordinates, {k} of the interface, {num} modes"
    return [
        common.row(name, "Craig-Bampton", times["ours"], "s CPU", "SciPy", times["SciPy"], "<=1"),
        common.row(name, "compile", seconds, "s CPU"),
        common.row(name, "temporary memory", ours.memory_analysis().temp_size_in_bytes / 2**20, "MB"),
        common.row(name, "difference of squared frequencies", np.abs(np.diag(mine)[k:] / values - 1).max(), "1"),
        common.row(
            name, "difference of the stiffness", np.abs(mine[:k, :k] - static).max() / np.abs(static).max(), "1"
        ),
    ]


# -------------------------------------------------------------------------------------------- transfer functions
def chain(springs):
    """Stiffness and mass of a chain of unit masses, the first one held by the first spring."""
    K = jnp.diag(springs + jnp.append(springs[1:], 0.0)) - jnp.diag(springs[1:], 1) - jnp.diag(springs[1:], -1)
    return K, jnp.eye(len(springs))


def transfer_rows(quick):
    n, frequencies = (20, 16) if quick else (200, 256)
    K, M = chain(1e4 * (1 + 0.1 * jnp.sin(jnp.arange(float(n)))))
    omega = jnp.linspace(1.0, 150.0, frequencies)
    some, every = (0, n // 2, n - 1), tuple(range(n))

    def of(out, into):
        return jax.jit(lambda K, M, w: receptance(K=K, M=M, omega=w, out=out, into=into, loss=0.02))

    few, all_pairs = of(some, (n - 1,)), of(every, every)
    times = common.cpu_seconds(
        {"few": lambda: few(K, M, omega), "all": lambda: all_pairs(K, M, omega)}, 2 if quick else 5
    )
    name = f"{n} coordinates, {frequencies} frequencies"
    same = np.asarray(all_pairs(K, M, omega))[:, list(some)][:, :, [n - 1]]
    error = np.abs(np.asarray(few(K, M, omega)) - same).max() / np.abs(same).max()
    milli = {k: 1e3 * t for k, t in times.items()}
    return [
        common.row(name, "transfer functions, 3 pairs", milli["few"], "ms CPU", "all pairs", milli["all"], "<=1/5"),
        common.row(name, "difference of the pairs", error, "1"),
    ]


def gradient_rows(quick):
    n, frequencies = (20, 16) if quick else (100, 256)
    springs, omega = 1e4 * (1 + 0.1 * jnp.sin(jnp.arange(float(n)))), jnp.linspace(1.0, 150.0, frequencies)

    def peak(springs):
        return jnp.max(
            jnp.abs(
                receptance(
                    **dict(zip("KM", chain(springs), strict=True)),
                    omega=omega,
                    out=(n - 1,),
                    into=(n - 1,),
                    loss=0.02,
                )
            )
        )

    value, both = jax.jit(peak), jax.jit(jax.value_and_grad(peak))
    times = common.cpu_seconds({"value": lambda: value(springs), "both": lambda: both(springs)}, 2 if quick else 5)
    slope, step = both(springs)[1], 1e-3 * jnp.ones(n)
    secant = (value(springs + step) - value(springs - step)) / 2
    milli = {k: 1e3 * t for k, t in times.items()}
    name = f"peak by {n} springs, {frequencies} frequencies"
    return [
        common.row(name, "value and gradient", milli["both"], "ms CPU", "value", milli["value"], "<=5"),
        common.row(name, "difference from a secant", abs(float(slope @ step / secant) - 1), "1"),
    ]


CASES = {"craig_bampton": craig_bampton_rows, "transfer": transfer_rows, "gradient": gradient_rows}


if __name__ == "__main__":
    common.run_cases(__doc__, CASES)
