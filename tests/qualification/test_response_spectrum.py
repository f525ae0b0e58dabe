"""Response-spectrum method: oscillators, published coefficients, SciPy's modes, missing mass, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import eigh

from jaxmbs.coupling import cqc_correlation
from jaxmbs.errors import ModelError
from jaxmbs.linear import LinearSystem
from jaxmbs.qualification import (
    BaseAcceleration,
    BaseForces,
    Coordinates,
    Recovery,
    response_spectrum,
    shock_spectrum,
)

FLAT = [0.1, 1e3], [3.0, 3.0]
SLOPING = [1.0, 20.0, 100.0], [2.0, 9.0, 4.0]
SPRINGS = jnp.array([3e3, 2e3, 1.5e3])
MASSES = np.array([1.0, 2.0, 0.5])
PAIR = jnp.array([9e3, 9e3, 0.0])


def chain(springs):
    D = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])
    positions = {"a": (0, 0, 0), "b": (0, 0, 1), "c": (0, 0, 2)}
    K = D.T @ jnp.diag(springs) @ D
    return LinearSystem(mass=jnp.diag(MASSES), stiffness=K, coordinates=["a z", "b z", "c z"], positions=positions)


def outputs(springs):
    return {"x": Coordinates("c z", "displacement"), "a": Coordinates("c z"), "foot": Recovery(springs[0] * ROW)}


ROW = jnp.array([[1.0, 0.0, 0.0]])


def test_published_correlations_of_five_modes():
    """Wilson, Der Kiureghian and Bayo (1981), table of a building with 5 % damping."""
    found = np.asarray(cqc_correlation(np.array([13.87, 13.93, 43.99, 44.19, 54.42]), np.full(5, 0.05)))
    published = [0.998, 0.006, 0.006, 0.004, 0.006, 0.006, 0.004, 0.998, 0.180, 0.186]
    np.testing.assert_allclose(found[np.triu_indices(5, 1)], published, atol=7e-4)  # of frequencies with four digits


def table(f):
    return np.exp(np.interp(np.log(f), np.log(SLOPING[0]), np.log(SLOPING[1])))


@pytest.mark.long
def test_every_combination_against_modes_of_scipy():
    system = chain(SPRINGS)
    values, X = eigh(np.asarray(system.stiffness), np.diag(MASSES))
    w, gamma = np.sqrt(values), X.T @ MASSES
    R = np.stack([X[2] / values, -X[2], SPRINGS[0] * X[0] / values]) * -gamma * table(w / 2 / np.pi)
    rho = np.asarray(cqc_correlation(w, np.full(3, 0.02)))
    big = np.max(np.abs(R), axis=1)
    expected = {
        "abs": np.sum(np.abs(R), axis=1),
        "srss": np.sqrt(np.sum(R**2, axis=1)),
        "cqc": np.sqrt(np.einsum("ok,kl,ol->o", R, rho, R)),
        "nrl": big + np.sqrt(np.sum(R**2, axis=1) - big**2),
    }
    for combine, peaks in expected.items():
        found = response_spectrum(system, SLOPING, outputs(SPRINGS), combine, ratios=0.02, unit="m/s^2")
        np.testing.assert_allclose(found.peaks, peaks, rtol=1e-10)
    np.testing.assert_allclose(found.effective_masses, gamma**2, rtol=1e-10)
    np.testing.assert_allclose(found.effective_masses.sum(), MASSES.sum(), rtol=1e-12)
    np.testing.assert_allclose(found.frequencies, w / 2 / np.pi, rtol=1e-12)
    assert "100 % of the mass" in str(found)


@pytest.mark.long
def test_missing_mass_is_static():
    """Below a flat spectrum the signed modes and the missing part sum to the static answer."""
    static = 3.0 * np.sum(MASSES)
    for num in (1, 2, 3):
        found = response_spectrum(chain(SPRINGS), FLAT, outputs(SPRINGS), "abs", ratios=0.02, num=num, unit="m/s^2")
        total = found.modal.sum(axis=0) + found.missing
        np.testing.assert_allclose(total[1:], [3.0, -static], rtol=1e-10)
        np.testing.assert_allclose(found.effective_masses.sum() + found.missing_mass, MASSES.sum(), rtol=1e-12)
    np.testing.assert_array_equal(found.missing, 0.0)


@pytest.mark.long
def test_moved_foot_has_its_own_mass_among_the_missing():
    K, M = np.array([[4e3, -4e3], [-4e3, 4e3]]), np.diag([0.7, 2.0])
    system = LinearSystem(
        mass=M, stiffness=K, coordinates=["foot z", "m z"], positions={"foot": (0, 0, 0), "m": (0, 0, 1)}
    )
    source = BaseAcceleration(None, "z", at=["foot z"])
    found = response_spectrum(system, FLAT, {"foot": BaseForces()}, source=source, ratios=0.02, unit="m/s^2")
    np.testing.assert_allclose(found.modal[0, 0], 6.0, rtol=1e-12)
    np.testing.assert_allclose(found.missing, 2.1, rtol=1e-12)
    np.testing.assert_allclose(found.peaks, np.hypot(6.0, 2.1), rtol=1e-12)


@pytest.mark.long
def test_oscillator_under_its_own_shock_spectrum():
    """The peak of one oscillator is its shock spectrum, of any kind."""
    pulse, step, w = 50 * np.sin(np.pi * np.arange(201) / 200), 1e-4, 2 * np.pi * 40.0
    system = LinearSystem(mass=[[2.0]], stiffness=[[2 * w**2]], coordinates=["m z"], positions={"m": (0, 0, 0)})
    f = np.array([20.0, 40.0, 80.0])
    for kind in ("relative displacement", "pseudo velocity"):
        shock = shock_spectrum(pulse, step, f, 10.0, kind)
        out = {"x": Coordinates("m z", "displacement"), "v": Coordinates("m z", "velocity")}
        found = response_spectrum(system, shock, out, ratios=0.05)
        x = shock.maximax[1] / (1.0 if kind == "relative displacement" else w)
        np.testing.assert_allclose(found.peaks, [x, w * x], rtol=1e-12)
    in_g = response_spectrum(system, ([1.0, 100.0], [2.0, 2.0]), ["m z"], unit="g", ratios=0.05)
    np.testing.assert_allclose(in_g.peaks, 2 * 9.80665, rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("combine", ["srss", "cqc", "nrl", "abs"])
def test_gradient_by_every_stiffness(combine):
    def peaks(k):
        return response_spectrum(chain(k), SLOPING, outputs(k), combine, ratios=0.02, num=2, unit="m/s^2").peaks

    found = jax.jacrev(jax.jit(peaks))(SPRINGS)
    np.testing.assert_allclose(jax.jacfwd(peaks)(SPRINGS), found, rtol=1e-10)
    for k in range(3):
        h = 0.3 * np.eye(3)[k]
        secant = (
            8 * (peaks(SPRINGS + h) - peaks(SPRINGS - h)) - (peaks(SPRINGS + 2 * h) - peaks(SPRINGS - 2 * h))
        ) / 3.6
        np.testing.assert_allclose(found[:, k], secant, rtol=1e-7)
    many = jnp.stack([SPRINGS, 1.1 * SPRINGS])
    np.testing.assert_allclose(jax.vmap(peaks)(many)[1], peaks(many[1]), rtol=1e-12)


def pair_peak(k, combine="cqc"):
    """Two equal oscillators coupled by a spring of stiffness zero: the pair parts."""
    K = jnp.array([[k[0] + k[2], -k[2]], [-k[2], k[1] + k[2]]])
    positions = {"a": (0, 0, 0), "b": (0, 0, 1)}
    system = LinearSystem(
        mass=jnp.diag(jnp.array([1.0, 1.0])), stiffness=K, coordinates=["a z", "b z"], positions=positions
    )
    source = BaseAcceleration(None, {"a z": 1.0, "b z": 0.3})
    return response_spectrum(
        system, SLOPING, {"x": Coordinates("a z", "displacement")}, combine, source, ratios=0.05, unit="m/s^2"
    ).peaks[0]


@pytest.mark.long
def test_gradient_where_frequencies_repeat():
    found = jax.grad(pair_peak)(PAIR)
    np.testing.assert_allclose(jax.jacfwd(pair_peak)(PAIR), found, rtol=1e-10)
    for k in range(3):
        h = 20.0 * np.eye(3)[k]
        secant = (
            8 * (pair_peak(PAIR + h) - pair_peak(PAIR - h)) - (pair_peak(PAIR + 2 * h) - pair_peak(PAIR - 2 * h))
        ) / 240
        np.testing.assert_allclose(found[k], secant, rtol=1e-5)
    # two oscillators at different places have a peak that depends on the choice of modes
    with pytest.raises(Exception, match="no derivative"):
        jax.block_until_ready(jax.grad(lambda k: pair_peak(k, "srss"))(PAIR))


@pytest.mark.long
def test_faults():
    system = chain(SPRINGS)
    with pytest.raises(ModelError) as error:
        response_spectrum(system, ([2.0, 1.0], [1.0, 1.0]), ["c z"], "sum", unit="ft")
    assert len(error.value.faults) == 3
    with pytest.raises(ModelError, match="below the spectrum"):
        response_spectrum(system, ([50.0, 100.0], [1.0, 1.0]), ["c z"], ratios=0.02, unit="m/s^2")
    with pytest.raises(ModelError, match="relative"):
        response_spectrum(
            system, FLAT, {"x": Coordinates("c z", "displacement", relative=False)}, ratios=0.02, unit="m/s^2"
        )
    with pytest.raises(ModelError, match="3 modes"):
        response_spectrum(system, FLAT, ["c z"], ratios=0.02, num=4, unit="m/s^2")
    with pytest.raises(ModelError, match="damped modes"):
        response_spectrum(system, FLAT, ["c z"], "cqc", unit="m/s^2")


def test_a_table_without_a_unit_is_told():
    with pytest.warns(DeprecationWarning, match="response_spectrum: no unit"):
        told = response_spectrum(chain(SPRINGS), FLAT, ["c z"], ratios=0.02)
    np.testing.assert_array_equal(
        told.peaks, response_spectrum(chain(SPRINGS), FLAT, ["c z"], ratios=0.02, unit="m/s^2").peaks
    )
