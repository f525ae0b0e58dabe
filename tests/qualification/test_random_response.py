"""Random responses against published values, Lyapunov's equation, brute force, and the derivatives of all of them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from jaxmbs.coupling import connect, reactions, rigid_bond
from jaxmbs.errors import ModelError
from jaxmbs.fatigue import psd_table
from jaxmbs.linear import LinearSystem
from jaxmbs.qualification import (
    BaseAcceleration,
    BaseForces,
    BondForces,
    Coordinates,
    RandomForce,
    Recovery,
    WhiteNoise,
    random_response,
)
from jaxmbs.vibration import frequency_response, harmonic_response

from . import read_case

GSFC = psd_table([20.0, 50.0, 800.0, 2000.0], [0.026, 0.16, 0.16, 0.026], "g^2/Hz")
NAMES = ["a z", "b z", "c z"]


def oscillator(f, Q=10.0):
    w = 2 * jnp.pi * f
    return LinearSystem(
        mass=jnp.eye(1),
        stiffness=jnp.reshape(w**2, (1, 1)),
        damping=jnp.reshape(w / Q, (1, 1)),
        coordinates=["m z"],
        positions={"m": (0, 0, 0)},
    )


def chain(springs, dampers=None):
    """Three masses in a row, the first one held by the first spring."""
    D = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])
    K, C = (None if s is None else D.T @ jnp.diag(s) @ D for s in (springs, dampers))
    positions = {"a": (0, 0, 0), "b": (0, 0, 1), "c": (0, 0, 2)}
    mass = jnp.diag(jnp.array([1.0, 2.0, 0.5]))
    return LinearSystem(mass=mass, stiffness=K, damping=C, coordinates=NAMES, positions=positions)


SPRINGS = jnp.array([3e5, 2e5, 1.5e5])
DAMPERS = jnp.array([30.0, 5.0, 12.0])


def test_oscillators_under_the_published_spectrum():
    values = read_case("RV2_gsfc_spectrum_oscillators")
    inputs = {"base": BaseAcceleration(GSFC, "z")}
    for f in (30, 100, 300, 1500):
        found = random_response(oscillator(float(f)), inputs, ["m z"]).rms[0] / 9.80665
        np.testing.assert_allclose(found, values[f"oscillator {f} Hz, Q 10: absolute acceleration g rms"], rtol=1e-12)


@pytest.mark.long
def test_no_grid_misses_a_peak():
    """Oscillators of any quality: twice the points of the quadrature change nothing."""
    inputs = {"base": BaseAcceleration(GSFC, "z")}
    for Q in (0.6, 1e2, 1e5):
        coarse, fine = (random_response(oscillator(97.0, Q), inputs, ["m z"], order=n) for n in (24, 48))
        np.testing.assert_allclose(coarse.moments, fine.moments, rtol=max(1e-12, 1e-15 * Q))  # K - w^2 M rounds


@pytest.mark.long
def test_white_noise_against_scipy():
    system, level = chain(SPRINGS, DAMPERS), 3.0
    found = random_response(
        system,
        {"f": RandomForce(WhiteNoise(level, "force"), {"c z": 1.0})},
        {"x": Coordinates(NAMES, "displacement")},
    )
    M, K, C = (np.asarray(A) for A in (system.mass, system.stiffness, system.damping))
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    B = np.concatenate([np.zeros(3), np.linalg.solve(M, [0, 0, 1.0])])
    P = solve_continuous_lyapunov(A, -np.outer(B, B) * level / 2)
    np.testing.assert_allclose(found.mean_square, np.diag(P)[:3], rtol=1e-8)
    np.testing.assert_allclose(
        found.zero_crossing_rate, np.sqrt(np.diag(P)[3:] / np.diag(P)[:3]) / 2 / np.pi, rtol=1e-7
    )
    assert np.all(np.isinf(found.moments[2, 3])) and np.all(np.isfinite(found.moments[0, 3]))


@pytest.mark.long
def test_closed_form_and_derivative_under_white_acceleration():
    """Miles with his neglected term: `a^2 = pi/2 f Q S (1 + 1 / Q^2)`."""

    def rms(f):
        return random_response(oscillator(f), {"base": BaseAcceleration(WhiteNoise(2.0), "z")}, ["m z"]).rms[0]

    np.testing.assert_allclose(rms(80.0), np.sqrt(np.pi / 2 * 80 * 10 * 2.0 * 1.01), rtol=1e-12)
    np.testing.assert_allclose(jax.grad(rms)(80.0), rms(80.0) / 160, rtol=1e-10)


COHERENT = {("base", "push"): 0.6 * np.exp(0.7j)}


def inputs_of_chain():
    push = psd_table([30.0, 300.0], [4.0, 0.4], "N^2/Hz")
    return {"base": BaseAcceleration(GSFC, "z"), "push": RandomForce(push, {"b z": 2.0})}


@pytest.mark.long
def test_two_coherent_inputs_against_brute_force():
    """Spectra, cross-spectra and RMS from receptances of the library at 200 001 frequencies; coupled damping."""
    system, inputs = chain(SPRINGS, DAMPERS), inputs_of_chain()
    out = {"a": Coordinates("c z"), "x": Coordinates("c z", "displacement")}
    found = random_response(system, inputs, out, coherence=COHERENT)
    f = np.geomspace(20.0, 2000.0, 20_001)
    B = np.asarray(frequency_response(system, 2 * np.pi * f, into=NAMES, out=["c z"]).values)[:, 0]
    H = B @ np.stack([-np.diag(system.mass), [0, 2.0, 0]], 1)
    w2 = (2 * np.pi * f[:, None]) ** 2
    Ha = -w2 * H + np.array([1.0, 0.0])
    Sb, Sp = (np.asarray(i.spectrum.at(f)) for i in inputs.values())
    gamma = COHERENT[("base", "push")]
    cross = gamma * np.sqrt(Sb * Sp)
    S = np.stack([np.stack([Sb + 0j, cross], -1), np.stack([cross.conj(), Sp + 0j], -1)], -2)
    spectra = {k: np.einsum("wi,wij,wj->w", X, S, X.conj()) for k, X in (("a", Ha), ("x", H))}
    some = slice(None, None, 1000)
    np.testing.assert_allclose(found.psd(f[some])[:, 0], spectra["a"].real[some], rtol=1e-9, atol=1e-20)  # isolated
    both = np.einsum("wi,wij,wj->w", Ha, S, H.conj())
    rounding = 1e-15 * np.abs(both).max()  # of the isolated response, a difference of large numbers
    np.testing.assert_allclose(found.cross_spectrum("a", "x", f[some]), both[some], rtol=1e-8, atol=rounding)
    for k, name in enumerate(out):
        np.testing.assert_allclose(found.mean_square[k], np.trapezoid(spectra[name].real, f), rtol=1e-4)
    np.testing.assert_allclose(found.covariance()[0, 1], np.trapezoid(both.real, f), rtol=1e-4)


@pytest.mark.long
def test_cumulative_and_shares():
    found = random_response(chain(SPRINGS), {"base": BaseAcceleration(GSFC, "z")}, ["c z", "a z"], ratios=0.02)
    part = found.cumulative_rms([20.0, 100.0, 2000.0])
    np.testing.assert_allclose(part[2], found.rms, rtol=1e-12)
    lower = psd_table([20.0, 50.0, 100.0], [0.026, 0.16, 0.16], "g^2/Hz")
    below = random_response(chain(SPRINGS), {"base": BaseAcceleration(lower, "z")}, ["c z", "a z"], ratios=0.02)
    np.testing.assert_allclose(part[1], below.rms, rtol=1e-12)
    shares = found.mode_shares()
    assert shares.shape == (2, 3) and shares[0, 0] > 0.5
    assert np.all(found.expected_maximum(60.0) > found.three_sigma)


def gradient_against_differences(function, at, rtol, step=1e-5):
    found = jax.grad(function)(at)
    for k in range(len(at)):
        h = step * abs(float(at[k])) * jnp.eye(len(at))[k]
        secant = (8 * (function(at + h) - function(at - h)) - (function(at + 2 * h) - function(at - 2 * h))) / 12
        np.testing.assert_allclose(found[k], secant / (step * abs(float(at[k]))), rtol=rtol)


@pytest.mark.long
@pytest.mark.parametrize("coupled", [False, True])
def test_gradient_by_every_stiffness(coupled):
    def rms(k):
        system = chain(k, DAMPERS if coupled else None)
        found = random_response(
            system, inputs_of_chain(), ["c z"], coherence=COHERENT, ratios=None if coupled else 0.02
        )
        return found.rms[0]

    gradient_against_differences(jax.jit(rms), SPRINGS, 1e-8, 3e-4)


@pytest.mark.long
def test_gradient_where_frequencies_repeat():
    """Two equal oscillators, coupled by a spring whose stiffness is zero: the pair parts."""

    def rms(k):
        K = jnp.array([[k[0] + k[2], -k[2]], [-k[2], k[1] + k[2]]])
        system = LinearSystem(mass=jnp.eye(2), stiffness=K, coordinates=["a z", "b z"])
        force = RandomForce(psd_table([20.0, 100.0], [1.0, 2.0], "N^2/Hz"), {"a z": 1.0, "b z": 0.3})
        return random_response(system, {"f": force}, ["a z", "b z"], ratios=0.03).rms

    k = jnp.array([9e4, 9e4, 0.0])
    found = jax.jacrev(jax.jit(rms))(k)
    assert found.shape == (2, 3)
    for j in range(3):
        h = 10.0 * jnp.eye(3)[j]
        secant = (8 * (rms(k + h) - rms(k - h)) - (rms(k + 2 * h) - rms(k - 2 * h))) / 12 / 10.0
        np.testing.assert_allclose(found[:, j], secant, rtol=1e-8, atol=1e-15)
    np.testing.assert_allclose(jax.jacfwd(rms)(k), found, rtol=1e-10, atol=1e-18)


def held_chain():
    """A free chain of three masses and a foot at the interface."""
    D = np.array([[-1.0, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1]])
    K, C = (D.T @ np.diag(np.asarray(s)) @ D for s in (SPRINGS, DAMPERS))
    mass = np.diag([0.0, 1.0, 2.0, 0.5])  # a mass at the ground would be no load of the bond
    labels = ["foot z", *NAMES]
    positions = {name: (0, 0, k) for k, name in enumerate(("foot", "a", "b", "c"))}
    return LinearSystem(
        mass=mass, stiffness=K, damping=C, coordinates=labels, interface=["foot"], positions=positions
    )


@pytest.mark.long
def test_moved_coordinates_and_moved_ground_agree():
    """The same chain, on a moved foot, on a moved ground, and bonded to a moved ground: loads and motions agree."""
    free, ground = held_chain(), chain(SPRINGS, DAMPERS)
    out = {"a": Coordinates("c z"), "x": Coordinates("c z", "displacement")}
    moved = random_response(free, {"base": BaseAcceleration(GSFC, "z", at="interface")}, out | {"foot": BaseForces()})
    still = random_response(
        ground,
        {"base": BaseAcceleration(GSFC, "z")},
        out | {"spring": Recovery(lambda x: 3e5 * x[:1]), "row": Recovery(jnp.array([[3e5, 0.0, 0.0]]))},
    )
    np.testing.assert_allclose(moved.rms[:2], still.rms[:2], rtol=1e-8)
    np.testing.assert_allclose(still.rms[2], still.rms[3], rtol=1e-12)
    net = connect({"chain": free}, {"bolt": rigid_bond("chain.foot", "ground")})
    bolted = random_response(
        net,
        {"base": BaseAcceleration(GSFC, "z")},
        {"a": Coordinates("chain.c z"), "bolt": BondForces("bolt"), "stress": BondForces("bolt", factor=2e4)},
    )
    np.testing.assert_allclose(bolted.rms[:2], np.asarray(moved.rms)[[0, 2]], rtol=1e-8)
    np.testing.assert_allclose(bolted.rms[2], 2e4 * bolted.rms[1], rtol=1e-12)
    with pytest.raises(ModelError, match="a factor of shape"):
        random_response(net, {"base": BaseAcceleration(GSFC, "z")}, {"bolt": BondForces("bolt", factor=[1.0, 2.0])})


@pytest.mark.long
def test_loads_of_bonds_under_a_force():
    """PSD of a bond's load against `reactions` of a harmonic response, with a loss factor."""
    net = connect({"chain": held_chain()}, {"bolt": rigid_bond("chain.foot", "ground")})
    force = RandomForce(psd_table([20.0, 500.0], [1.0, 1.0], "N^2/Hz"), {"chain.b z": 1.0})
    found = random_response(net, {"f": force}, {"bolt": BondForces()}, loss=0.03)
    f = np.array([25.0, 61.0, 340.0])
    answer = harmonic_response(net, 2 * np.pi * f, {"chain.b z": 1.0}, loss=0.03)
    loads = reactions(net, answer)["bolt"].on_first[:, 0]
    np.testing.assert_allclose(found.psd(f)[:, 0], np.abs(loads) ** 2, rtol=1e-9)


@pytest.mark.long
def test_von_mises_of_a_plane_stress():
    inputs = {"base": BaseAcceleration(GSFC, "z")}
    rows = jnp.array([[1.0, 0, 0], [-0.3, 0.2, 0], [0.1, 0, 0.4]])
    found = random_response(chain(SPRINGS), inputs, {"s": Recovery(rows, ["xx", "yy", "xy"])}, ratios=0.02)
    P = np.asarray(found.covariance())
    exact = P[0, 0] + P[1, 1] - P[0, 1] + 3 * P[2, 2]
    np.testing.assert_allclose(found.von_mises_rms(["s xx", "s yy", "s xy"]) ** 2, exact, rtol=1e-12)


@pytest.mark.long
def test_faults_have_names():
    system, inputs = chain(SPRINGS), inputs_of_chain()
    kilohertz = {"base": BaseAcceleration(psd_table([1e-5, 2e-5], [1.0, 1.0], "g^2/Hz"), "z")}
    with pytest.warns(UserWarning, match="far below the first mode .* are their frequencies in Hz"):
        random_response(system, kilohertz, ["c z"], ratios=0.02)
    with pytest.raises(ModelError, match="not damped"):
        random_response(system, inputs, ["c z"])
    with pytest.raises(ModelError, match="positive semidefinite"):
        random_response(system, inputs, ["c z"], coherence={("base", "push"): 1.1}, ratios=0.02)
    with pytest.raises(ModelError, match="push"):
        random_response(system, inputs, ["c z"], coherence={("base", "pull"): 0.5}, ratios=0.02)
    with pytest.raises(ModelError, match="spectrum must be of force"):
        RandomForce(GSFC, {"c z": 1.0})
    with pytest.raises(ModelError, match="absolute displacements"):
        white = {"base": BaseAcceleration(WhiteNoise(1.0), "z")}
        random_response(system, white, {"x": Coordinates("c z", "displacement", relative=False)}, ratios=0.02)


@pytest.mark.long
@pytest.mark.parametrize("ratios", [(1e-4, 0.3, 1e-5, 0.2), (1e-5, 1e-2, 1e-3, 0.7)])
def test_twice_the_order_changes_nothing_at_close_poles_of_unlike_damping(ratios):
    omega = 2 * np.pi * np.array([100.0, 100.3, 400.0, 401.0])
    names = ["a x", "b x", "c x", "d x"]
    labels = [tuple(name.split()) for name in names]
    system = LinearSystem(
        mass=np.eye(4),
        stiffness=np.diag(omega**2),
        damping=np.diag(2 * np.array(ratios) * omega),
        coordinates=labels,
    )
    table = psd_table([20, 50, 800, 2000], [0.026, 0.16, 0.16, 0.026], unit="g^2/Hz")
    inputs = {"base": BaseAcceleration(table, dict.fromkeys(names, 1.0))}
    found, finer = (random_response(system, inputs, names, order=order).rms for order in (24, 48))
    np.testing.assert_allclose(found, finer, rtol=2e-12)


@pytest.mark.long
def test_moved_coordinates_by_name_under_jit():
    def rms(stiffness):
        K = stiffness * jnp.array([[1.0, -1.0], [-1.0, 1.0]])
        system = LinearSystem(mass=jnp.eye(2), stiffness=K, coordinates=[("base", "z"), ("top", "z")])
        source = BaseAcceleration(psd_table([20.0, 2000.0], [0.1, 0.1], "g^2/Hz"), {"base z": 1.0}, "base")
        return random_response(system, {"base": source}, ["top z"], ratios=0.05).rms[0]

    assert np.isclose(jax.jit(rms)(1e5), rms(1e5), rtol=1e-12)


def test_outputs_say_their_units():
    """Each output its own, of rotations and of loads too; one that nobody gave is left out."""
    names = [("box", d) for d in ("x", "y", "z", "rx", "ry", "rz")]
    box = LinearSystem(
        mass=np.eye(6), stiffness=1e4 * np.eye(6), coordinates=names, positions={"box": (0.0, 0.0, 0.0)}
    )
    table = psd_table([10.0, 100.0], [1.0, 1.0], unit="(m/s^2)^2/Hz")
    out = {
        "z": Coordinates("box z"),
        "turn": Coordinates("box rz", "velocity"),
        "gap": Coordinates("box x", "displacement"),
        "own": Recovery(jnp.eye(6)[:1]),
        "strain": Recovery(jnp.eye(6)[:1], unit="-"),
    }
    found = random_response(box, {"base": BaseAcceleration(table, "z")}, out, ratios=0.05)
    assert found.units == ("m/s^2", "rad/s", "m", "", "-")
    rows = {line.split()[0]: line.split()[-2] for line in str(found).splitlines()[2:]}
    assert rows == {"z": "m/s^2", "turn": "rad/s", "gap": "m", "own": "-", "strain": "-"}
    data = found.to_xarray()
    assert data["rms"].attrs["units"] == "by output" and list(data["unit"].values) == list(found.units)
