"""Chains of components of 24 coordinates: every verb of a network in blocks, SciPy beside, and where blocks pay.

Every component is a free bar: six coordinates at either end and twelve of its own; the chain is held at one end, or
free.  SciPy has the same assembled matrices as sparse ones: SuperLU for statics and harmonics, ARPACK with it for
modes, DOP853 for motions.  Each verb is called as a user calls it; the first call less one run counts as compilation.
CPU time throughout, one thread.
"""

import time

import common
import jax
import jax.numpy as jnp
import numpy as np
import scipy.integrate
import scipy.sparse as sparse
import scipy.sparse.linalg as spl

import jaxmbs as mbs
from jaxmbs.coupling import Components, connect, coupled_response, rigid_bond
from jaxmbs.elements import DIRECTIONS
from jaxmbs.linear import LinearSystem, rigid_motions
from jaxmbs.vibration import harmonic_response

OWN = 12
LABELS = [(node, d) for node in ("left", "right") for d in DIRECTIONS] + [(f"mode {k}", "") for k in range(OWN)]


# ------------------------------------------------------------------------------------------------------ components
def bars(count, seed=0):
    """Masses and stiffnesses (count, 24, 24): no strain energy in the six rigid motions."""
    rng, n = np.random.default_rng(seed), 12 + OWN
    rigid = np.asarray(rigid_motions(jnp.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))).reshape(12, 6)
    rigid = np.concatenate([rigid, np.zeros((OWN, 6))])
    keep = np.eye(n) - rigid @ np.linalg.solve(rigid.T @ rigid, rigid.T)
    A, B = rng.normal(size=(2, count, n, n))
    K = keep @ (A @ A.transpose(0, 2, 1) + n * np.eye(n)) @ keep
    return np.eye(n) + B @ B.transpose(0, 2, 1) / 100, (K + K.transpose(0, 2, 1)) / 2


def chain(M, K, linear_solver="auto", free=False):
    """The network, Rayleigh damped."""
    parts = {}
    for k, (mass, stiffness) in enumerate(zip(M, K, strict=True)):
        places = {"left": (float(k), 0.0, 0.0), "right": (k + 1.0, 0.0, 0.0)}
        options = {"interface": range(12), "coordinates": LABELS, "positions": places}
        parts[f"bar {k}"] = LinearSystem(mass=mass, stiffness=stiffness, damping=0.01 * stiffness, **options)
    bonds = {} if free else {"root": rigid_bond("bar 0.left")}
    bonds |= {f"bolts {k}": rigid_bond(f"bar {k - 1}.right", f"bar {k}.left") for k in range(1, len(parts))}
    return connect(parts, bonds, linear_solver=linear_solver)


def to_scipy(net):
    """Sparse mass, stiffness and damping of a network in blocks, in the order of its rows."""
    (i, j), (n, b) = net.stiffness.pattern.edges.T, net.stiffness.pattern.shape
    at = net.block_rows.numbers
    first, second = np.concatenate([np.arange(n), i, j]), np.concatenate([np.arange(n), j, i])
    rows, columns = (np.broadcast_to(a, (len(first), b, b)) for a in (at[first][:, :, None], at[second][:, None, :]))
    used = (rows >= 0) & (columns >= 0)

    def one(A):
        values = np.concatenate([A.diagonal, A.upper, A.lower_blocks])
        return sparse.coo_array((values[used], (rows[used], columns[used])), (net.num_rows,) * 2).tocsc()

    return tuple(map(one, (net.mass, net.stiffness, net.damping)))


# ------------------------------------------------------------------------------------------------------------ verbs
def first_call(function):
    """Result, and CPU seconds of a first call, less those of a second: tracing and compilation."""
    jax.clear_caches()
    start = time.process_time()
    jax.block_until_ready(function())
    middle = time.process_time()
    result = jax.block_until_ready(function())
    return result, max(0.0, 2 * middle - start - time.process_time())


def verb_rows(name, verb, ours, theirs, difference, rounds):
    """Rows of one verb: run beside the peer, compilation, difference."""
    found, seconds = first_call(ours)
    times = common.cpu_seconds({"ours": ours} | ({"SciPy": theirs} if theirs else {}), rounds, 0.0)
    peer = ("SciPy", times["SciPy"]) if theirs else (None, None)
    rows = [
        common.row(name, verb, times["ours"], "s CPU", *peer, "<=2"),
        common.row(name, f"{verb}, compile", seconds, "s CPU"),
    ]
    if theirs:
        rows.append(common.row(name, f"{verb}, difference", difference(found, theirs()), "1"))
    print(f"{verb} done", flush=True)
    return rows


def relative(ours, theirs):
    return float(np.max(np.abs(np.asarray(ours) - theirs)) / np.max(np.abs(theirs)))


def static_rows(name, net, matrices, forces, rounds):
    load, K = np.asarray(net.load(forces)), matrices[1]
    answer = mbs.equilibrium(net, forces)
    options = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}}
    return verb_rows(
        name,
        "equilibrium",
        lambda: mbs.equilibrium(net, forces),
        lambda: spl.splu(K, **options).solve(load),
        lambda a, b: relative(a.displacement, b),
        rounds,
    ) + verb_rows(name, "reactions", lambda: mbs.reactions(net, answer), None, None, rounds)


def harmonic_rows(name, net, matrices, forces, rounds):
    (M, K, C), load, omega = matrices, np.asarray(net.load(forces)), np.linspace(0.01, 1.0, 8)
    answer = harmonic_response(net, omega, forces)
    last = f"bar {len(net.names) - 1}.right"

    def scipy():
        return np.stack([spl.splu((K + 1j * w * C - w**2 * M).tocsc()).solve(load.astype(complex)) for w in omega])

    def transfer():
        return mbs.frequency_response(net, omega, [f"{last} y"], [f"{last} z"]).values

    return (
        verb_rows(
            name,
            "harmonic_response, 8 frequencies",
            lambda: harmonic_response(net, omega, forces),
            scipy,
            lambda a, b: relative(a.displacement, b),
            rounds,
        )
        + verb_rows(name, "frequency_response, 8 frequencies", transfer, None, None, rounds)
        + verb_rows(name, "reactions over frequencies", lambda: mbs.reactions(net, answer), None, None, rounds)
    )


def mode_rows(name, net, matrices, rounds, free=False):
    M, K, _ = matrices
    num = 12

    def scipy():
        shift = -1e-6 if free else 0.0
        lu = spl.splu((K - shift * M).tocsc())
        inverse = spl.LinearOperator(K.shape, lu.solve)
        return np.sort(spl.eigsh(K, num, M, sigma=shift, OPinv=inverse, return_eigenvectors=False))

    elastic = slice(6 if free else 0, None)
    return verb_rows(
        name,
        f"modes, {num}",
        lambda: mbs.modes(net, num, damped=False),
        scipy,
        lambda a, b: float(np.max(np.abs(np.asarray(a.values)[elastic] / b[elastic] - 1))),
        rounds,
    )


def motion_rows(name, net, matrices, rounds):
    M, K, C = matrices
    n, ts = net.num_rows, np.linspace(0.0, 2.0, 21)
    force = {f"bar {len(net.names) - 1}.right y": np.sin(3 * ts)}
    row = int(np.argmax(np.abs(np.asarray(net.load({next(iter(force)): 1.0})))))
    answer = mbs.simulate(net, ts=ts, forces=force)

    def scipy():
        lu = spl.splu(M)

        def rate(t, y):
            f = -(K @ y[:n]) - C @ y[n:]
            f[row] += np.interp(t, ts, force[next(iter(force))])
            return np.concatenate([y[n:], lu.solve(f)])

        options = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-12, "t_eval": ts, "max_step": ts[1]}
        return scipy_motion(rate, ts, n, options)

    steps = int(answer.num_steps)
    return verb_rows(
        name,
        f"simulate, {steps} steps",
        lambda: mbs.simulate(net, ts=ts, forces=force),
        scipy,
        lambda a, b: relative(a.displacement[-1], b),
        rounds,
    ) + verb_rows(name, "reactions of the motion", lambda: mbs.reactions(net, answer), None, None, rounds)


def scipy_motion(rate, ts, n, options):
    """Displacements at the end."""
    return scipy.integrate.solve_ivp(rate, (ts[0], ts[-1]), np.zeros(2 * n), **options).y[:n, -1]


def chain_rows(quick):
    count, rounds = (6, 1) if quick else (500, 3)
    M, K = bars(count)
    name = f"chain of {count} components"
    start = time.process_time()
    net = chain(M, K, "multifrontal")
    rows = [common.row(name, "connect, first call", time.process_time() - start, "s CPU")]
    start = time.process_time()
    net = chain(M, K, "multifrontal")
    rows.append(common.row(name, "components and connect", time.process_time() - start, "s CPU", goal="<=2"))
    matrices = to_scipy(net)
    forces = {f"bar {count - 1}.right y": 1.0, "bar 1.right z": -0.5}
    rows += static_rows(name, net, matrices, forces, rounds)
    rows += harmonic_rows(name, net, matrices, forces, rounds)
    rows += mode_rows(name, net, matrices, rounds)
    rows += motion_rows(name, net, matrices, rounds)
    rows += coupled_rows(name, M, K, net, forces, rounds)
    return rows


def coupled_rows(name, M, K, net, forces, rounds):
    """The same static response by node numbers: groups of components given as arrays."""
    count = len(K)
    nodes = tuple((k - 1, k) for k in range(count))
    load = np.zeros((count, 6))
    load[-1, 1], load[1, 2] = 1.0, -0.5
    group = Components(nodes, jnp.asarray(K), jnp.zeros(K.shape[:2]))
    response = jax.jit(lambda g, f: coupled_response([g], f))
    last = np.asarray(mbs.equilibrium(net, forces).displacement @ net.outputs(f"bar {count - 1}.right")[0].T)
    found, seconds = first_call(lambda: response(group, jnp.asarray(load)))
    times = common.cpu_seconds({"ours": lambda: response(group, jnp.asarray(load))}, rounds, 0.0)
    return [
        common.row(name, "coupled_response", times["ours"], "s CPU", goal="<=2"),
        common.row(name, "coupled_response, compile", seconds, "s CPU"),
        common.row(name, "coupled_response, difference", relative(found.interface[-1], last), "1"),
    ]


def free_rows(quick):
    count, rounds = (6, 1) if quick else (500, 3)
    net = chain(*bars(count), "multifrontal", free=True)
    name, forces = f"free chain of {count} components", {f"bar {count - 1}.right y": 1.0, "bar 1.right z": -0.5}
    relief = verb_rows(name, "equilibrium, free", lambda: mbs.equilibrium(net, forces, free=True), None, None, rounds)
    return relief + mode_rows(name, net, to_scipy(net), rounds, free=True)


# ------------------------------------------------------------------------------------------------------- break-even
def break_even_rows(quick):
    """Loads of bonds at rest and 12 modes, in blocks and dense, compiled; the peer is dense."""
    rows = []
    for count in (4, 6) if quick else (6, 12, 18, 24, 48):
        M, K = bars(count)
        name = f"{count} bonds, {18 * count} coordinates"
        for verb, function in (("reactions of equilibrium", _static_loads), ("12 modes", _lowest_values)):
            run = {kind: _compiled(function, M, K, kind) for kind in ("dense", "multifrontal")}
            times = common.cpu_seconds(run, 1 if quick else 5)
            milli = {k: 1e3 * t for k, t in times.items()}
            rows.append(common.row(name, verb, milli["multifrontal"], "ms CPU", "dense", milli["dense"]))
        print(f"{count} bonds done", flush=True)
    return rows


def _compiled(function, M, K, kind):
    """Function without arguments that runs the program from the stiffnesses of the components on."""
    program = jax.jit(lambda K: function(chain(M, K, kind)))
    return lambda: program(jnp.asarray(K))


def _static_loads(net):
    answer = mbs.equilibrium(net, {f"bar {len(net.names) - 1}.right y": 1.0})
    return mbs.reactions(net, answer)["root"].on_first


def _lowest_values(net):
    return mbs.modes(net, 12, damped=False).values


CASES = {"chain": chain_rows, "free": free_rows, "break_even": break_even_rows}


if __name__ == "__main__":
    common.run_cases(__doc__, CASES)
