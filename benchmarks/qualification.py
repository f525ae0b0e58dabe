"""Random response, shock spectrum, rainflow and life by frequency with gradients, beside pyYeti and rainflow.

The random response is that of the Craig-Bampton block of `substructures`, moved at its 432 interface
coordinates: RMS of the loads there under five inputs, by the thickness of 50 slices across its length, each of which
scales stiffness and mass of its slice in the basis of the reduction.  CPU time throughout, one thread, without
compiling; the reduction is counted for neither.
"""

import warnings

import common
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
import scipy.sparse.linalg as spl
from substructures import block, chain, to_scipy

from jaxmbs.fatigue import SN, psd_table, rainflow, spectral_damage
from jaxmbs.linear import LinearSystem
from jaxmbs.qualification import (
    BaseAcceleration,
    BaseForces,
    Recovery,
    random_response,
    shock_spectrum,
    stress_spectrum,
)

RATIO = 0.02


def levels():
    """Spectrum of accelerations of GSFC-STD-7000."""
    return psd_table([20.0, 50.0, 800.0, 2000.0], [0.026, 0.16, 0.16, 0.026], "g^2/Hz")


# ------------------------------------------------------------------------------------------------ random response
def slices(length, width, num):
    """Stiffness and mass (slices, n, n) of every slice in the Craig-Bampton basis, and rigid motions (outer, 5)."""
    nodes, K, M, face = block(length, width)
    K, M = to_scipy(K), to_scipy(M)
    outer = np.array([3 * i + d for i in face for d in range(3)])
    inner = np.setdiff1d(np.arange(len(nodes) * 3), outer)
    lu = spl.splu(K[inner][:, inner].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    inverse = spl.LinearOperator((len(inner),) * 2, lu.solve)
    X = spl.eigsh(K[inner][:, inner], num, M[inner][:, inner], sigma=0.0, OPinv=inverse)[1]
    T = np.zeros((K.shape[0], len(outer) + num))
    T[outer, np.arange(len(outer))] = 1.0
    T[inner] = np.hstack([-lu.solve(K[inner][:, outer].toarray()), X])
    _, own_K, own_M, _ = block(1, width)  # all slices are alike
    per, shape = 3 * (width + 1) ** 2, (2, length, T.shape[1], T.shape[1])
    found = np.empty(shape)
    for i, A in enumerate(map(to_scipy, (own_K, own_M))):
        for k in range(length):
            part = T[k * per : (k + 2) * per]
            found[i, k] = part.T @ (A @ part)
    r = nodes[list(face)] - nodes[list(face)].mean(axis=0)
    axes = np.eye(3)
    motions = [np.tile(e, len(r)) for e in axes] + [np.cross(e, r).ravel() for e in axes[:2]]
    return found, np.stack(motions, axis=1)


def random_rows(quick):
    length, width, num = (6, 3, 4) if quick else (50, 11, 30)
    (K, M), motions = slices(length, width, num)
    outer = len(motions)
    names = [(str(k), d) for k in range(outer // 3) for d in "xyz"] + [(f"mode {k}", "x") for k in range(num)]
    table = levels()
    base = [f"{node} {d}" for node, d in names[:outer]]
    inputs = {
        f"input {i}": BaseAcceleration(table, dict(zip(base, motions[:, i].tolist(), strict=True)), base)
        for i in range(motions.shape[1])
    }

    def rms(thickness, K, M):
        # sums as products of a vector and a matrix, whose gradient XLA has as one
        whole_K, whole_M = ((thickness @ A.reshape(length, -1)).reshape(A.shape[1:]) for A in (K, M))
        system = LinearSystem(mass=whole_M, stiffness=whole_K, coordinates=names)
        return random_response(system, inputs, {"base": BaseForces()}, ratios=RATIO).rms

    def total(thickness, K, M):
        found = rms(thickness, K, M)
        return jnp.sum(found**2), found

    ones, K, M = jnp.ones(length), jnp.asarray(K), jnp.asarray(M)
    value, _ = common.compiled(rms, ones, K, M)
    both, seconds = common.compiled(jax.value_and_grad(total, has_aux=True), ones, K, M)
    loop = frequency_loop(np.asarray(K.sum(0)), np.asarray(M.sum(0)), motions, table, 40 if quick else 4000)
    run = {"value": lambda: value(ones, K, M), "both": lambda: both(ones, K, M), "loop": loop}
    times = common.cpu_seconds(run, 1 if quick else 3, 0.0)
    (_, found), slope = both(ones, K, M)
    step = 1e-4 * jnp.sin(1.0 + jnp.arange(length))
    secant = (jnp.sum(value(ones + step, K, M) ** 2) - jnp.sum(value(ones - step, K, M) ** 2)) / 2
    theirs = loop()
    name = f"{outer} interface loads, {num} modes, {motions.shape[1]} inputs, {length} thicknesses"
    return [
        common.row(name, "RMS", times["value"], "s CPU", "pyYeti's loop", times["loop"], "<=1"),
        common.row(name, "RMS and gradient", times["both"], "s CPU", goal="<2"),
        common.row(name, "compile", seconds, "s CPU"),
        common.row(name, "difference of the RMS", np.abs(found - theirs).max() / theirs.max(), "1"),
        common.row(name, "difference from a secant", abs(float(slope @ step / secant) - 1), "1"),
    ]


def frequency_loop(K, M, motions, table, points):
    """Loads of the interface by pyYeti's solutions in the frequency domain, areas under their spectra."""
    from pyyeti import ode

    outer = len(motions)
    inner = slice(outer, None)
    squares, X = scipy.linalg.eigh(K[inner, inner], M[inner, inner])
    f = np.geomspace(20.0, 2000.0, points)
    G = np.exp(np.interp(np.log(f), np.log(table.frequencies), np.log(table.levels)))
    across, rigid = M[:outer, inner] @ X, M[:outer, :outer] @ motions

    def run():
        solver = ode.SolveUnc(np.ones(len(squares)), 2 * RATIO * np.sqrt(squares), squares)
        density = np.zeros((outer, points))
        for i in range(motions.shape[1]):
            load = -(across.T @ motions[:, i])[:, None] * np.ones(points)
            acceleration = solver.fsolve(load, f).a
            density += np.abs(across @ acceleration + rigid[:, i, None]) ** 2 * G
        return np.sqrt(np.trapezoid(density, f, axis=1))

    return run


# ---------------------------------------------------------------------------------------------------- time series
def noise(samples):
    """A signal of filtered noise."""
    white = np.random.default_rng(7).normal(size=samples)
    return np.convolve(white, np.hanning(9), "same")


def shock_rows(quick):
    from pyyeti import srs

    samples, count, rate = (2000, 10, 2e4) if quick else (1_000_000, 200, 2e4)
    signal, f = noise(samples), np.geomspace(10.0, 2000.0, count)
    given = jnp.asarray(signal)

    def maximax(signal):
        return shock_spectrum(signal, 1 / rate, f, 10.0).maximax

    def total(signal):
        found = maximax(signal)
        return jnp.sum(found), found

    value, _ = common.compiled(maximax, given)
    both, seconds = common.compiled(jax.value_and_grad(total, has_aux=True), given)
    theirs = lambda: srs.srs(signal, rate, f, 10.0, ic="zero", parallel="no", rolloff="none", time="total")
    run = {"value": lambda: value(given), "both": lambda: both(given), "theirs": theirs}
    times = common.cpu_seconds(run, 1 if quick else 3, 0.0)
    name = f"{samples} samples, {count} oscillators"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        difference = np.abs(np.asarray(value(given)) / np.ravel(theirs()) - 1).max()
    return [
        common.row(name, "shock spectrum", times["value"], "s CPU", "pyYeti", times["theirs"], "<=1"),
        common.row(name, "value and gradient", times["both"], "s CPU", "value", times["value"], "<=3"),
        common.row(name, "compile", seconds, "s CPU"),
        common.row(name, "difference of the spectrum", difference, "1"),
    ]


def rainflow_rows(quick):
    import rainflow as peer

    samples = 2000 if quick else 1_000_000
    signal = noise(samples)
    given = jnp.asarray(signal)

    def power(signal):
        cycles = rainflow(signal)
        return jnp.sum(cycles.counts * cycles.ranges**3)

    value, _ = common.compiled(power, given)
    both, seconds = common.compiled(jax.value_and_grad(power), given)
    theirs = lambda: sum(n * r**3 for r, _, n, _, _ in peer.extract_cycles(signal))
    run = {"value": lambda: value(given), "both": lambda: both(given), "theirs": theirs}
    times = common.cpu_seconds(run, 1 if quick else 3, 0.0)
    name = f"{samples} samples"
    return [
        common.row(name, "rainflow", times["value"], "s CPU", "rainflow", times["theirs"], "<=0.25 s"),
        common.row(name, "value and gradient", times["both"], "s CPU", "value", times["value"]),
        common.row(name, "compile", seconds, "s CPU"),
        common.row(name, "difference of the sum of cubes", abs(float(value(given)) / theirs() - 1), "1"),
    ]


# ------------------------------------------------------------------------------------------------------- designs
def design_rows(quick):
    n, count = (4, 3) if quick else (10, 1000)
    table, sn = levels(), SN(1e32, 4.0)

    def life(springs):
        K, M = chain(springs)
        system = LinearSystem(mass=M, stiffness=K, coordinates=[(str(k), "z") for k in range(n)])
        source = {"base": BaseAcceleration(table, {f"{k} z": 1.0 for k in range(n)})}
        stress = Recovery(lambda x: springs[0] * x[:1], ["z"])
        response = random_response(system, source, {"stress": stress}, ratios=RATIO)
        return jnp.log(spectral_damage(stress_spectrum(response, "stress z"), sn, "dirlik"))

    designs = 1e6 * (1 + 0.2 * np.random.default_rng(3).uniform(-1, 1, (count, n)))
    designs = jnp.asarray(designs)
    both, seconds = common.compiled(jax.vmap(jax.value_and_grad(life)), designs, often=True)
    value, _ = common.compiled(jax.vmap(life), designs, often=True)
    run = {"value": lambda: value(designs), "both": lambda: both(designs)}
    times = common.cpu_seconds(run, 1 if quick else 3, 0.0)
    step = designs * 1e-5
    secant = (value(designs + step) - value(designs - step)) / 2
    slope = jnp.sum(both(designs)[1] * step, axis=1)
    name = f"{count} designs of {n} springs, Dirlik"
    return [
        common.row(name, "value and gradient", times["both"], "s CPU", "value", times["value"], "<10 s"),
        common.row(name, "compile", seconds, "s CPU"),
        common.row(name, "difference from a secant", np.abs(slope / secant - 1).max(), "1"),
    ]


CASES = {"random": random_rows, "shock": shock_rows, "rainflow": rainflow_rows, "designs": design_rows}


if __name__ == "__main__":
    common.run_cases(__doc__, CASES)
