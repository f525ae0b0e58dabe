"""Structures updated to tests: modes that cross, damping, transfer functions from a file, and pairs in doubt."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs import experiment, io
from jaxmbs.errors import ModelError
from jaxmbs.experiment import MeasuredModes

N = 4  # masses on a line, each free along y and z
NAMES = [f"{k} {axis}" for axis in "yz" for k in range(N)]
CHANNELS = ("1 y", "3 y", "1 z", "3 z")
PLACES = [NAMES.index(name) for name in CHANNELS]
TRUTH = {"y": 900.0, "z": 1500.0, "tip": 0.7}
FIRST = {"y": 1600.0, "z": 1000.0, "tip": 1.0}  # the lines along y and z change places
LINE = 2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)
LINE[-1, -1] = 1.0


def matrices(u, xp=np):
    """Stiffness and mass: two lines of springs with the same masses, the last one unknown."""
    K = xp.zeros((2 * N, 2 * N))
    if xp is np:
        K = scipy.linalg.block_diag(u["y"] * LINE, u["z"] * LINE)
    else:
        K = jax.scipy.linalg.block_diag(u["y"] * LINE, u["z"] * LINE)
    light = np.ones(N)
    light[-1] = 0.0
    m = light + u["tip"] * (1 - light)
    return K, xp.diag(xp.concatenate([m, m]))


def model(u):
    K, M = matrices(u, jnp)
    C = u.get("damper", None)
    return mbs.LinearSystem(mass=M, stiffness=K, coordinates=NAMES, damping=None if C is None else C * K)


def measured():
    """Six modes by SciPy, with shapes of any sign and size at four channels."""
    values, shapes = scipy.linalg.eigh(*matrices(TRUTH))
    scale = np.array([1.0, -2.0, 0.5, 3.0, -1.0, 1.0])
    return MeasuredModes(np.sqrt(values[:6]) / (2 * np.pi), shapes[PLACES, :6] * scale, CHANNELS)


@pytest.mark.long
def test_modes_that_cross_find_their_partners():
    found = experiment.update(model, FIRST, modes=measured())
    for name, value in TRUTH.items():
        np.testing.assert_allclose(found.identification.unknowns[name], value, rtol=1e-8)
    assert found.ok and found.pairs.tolist() == list(range(6))
    np.testing.assert_allclose(found.frequencies[1], measured().frequencies, rtol=1e-9)
    np.testing.assert_allclose(found.mac[1], 1.0, atol=1e-12)
    assert np.all(found.mac[0] < 1 - 1e-4) and "MAC after" in str(found)


@pytest.mark.long
def test_the_derivative_of_the_residuals():
    """The Jacobian at the first values against differences: pairs are constants."""
    found = experiment.update(model, FIRST, modes=measured(), steps=1)
    x, h = found.identification, 1e-4
    assert x.jacobian.shape == (6 + 24, 3)

    def frequencies(u):
        return np.sqrt(scipy.linalg.eigh(*matrices(u), eigvals_only=True)[:6])

    u = {name: float(value) for name, value in x.unknowns.items()}
    for k, name in enumerate(x.names):
        step = h * u[name]
        up, down = (frequencies(u | {name: u[name] + s}) for s in (step, -step))
        expected = (up - down) / (2 * step) / (2 * np.pi) / measured().frequencies / 0.005
        np.testing.assert_allclose(x.jacobian[:6, k], expected, rtol=1e-6, atol=1e-9)


@pytest.mark.long
def test_frequencies_alone_leave_a_direction_unseen():
    """Of all stiffnesses and masses only the ratio counts."""

    def scaled(u):
        K, M = matrices(TRUTH)
        return mbs.LinearSystem(mass=u["mass"] * M, stiffness=u["stiffness"] * K, coordinates=NAMES)

    found = experiment.update(scaled, {"mass": 1.0, "stiffness": 1.2}, modes=MeasuredModes(measured().frequencies))
    (direction,) = found.identification.unseen
    assert set(direction.coefficients) == {"mass", "stiffness"} and not found.ok
    assert np.all(np.isnan(found.mac)) and found.doubtful == ()


@pytest.mark.long
def test_damping_ratios_are_fitted():
    """Stiffness-proportional damping: ratios `c w / 2` in closed form."""
    modes = measured()
    ratios = 0.5 * 2e-3 * 2 * np.pi * modes.frequencies
    tested = MeasuredModes(modes.frequencies, modes.shapes, CHANNELS, ratios)
    found = experiment.update(model, FIRST | {"damper": 1e-3}, modes=tested)
    for name, value in (TRUTH | {"damper": 2e-3}).items():
        np.testing.assert_allclose(found.identification.unknowns[name], value, rtol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("residual", ["logarithm", "difference"])
@pytest.mark.parametrize("kind", ["receptance", "accelerance"])
def test_transfer_functions_from_a_file(tmp_path, kind, residual):
    """A universal file of SciPy's matrices, with noise; the unknowns within four standard errors, from near."""
    K, M = matrices(TRUTH)
    w = 2 * np.pi * np.linspace(0.5, 12.0, 60)
    rng = np.random.default_rng(3)
    full = np.linalg.inv(K * (1 + 2e-3j * w[:, None, None]) - w[:, None, None] ** 2 * M)[:, PLACES][:, :, PLACES[1:3]]
    full = full * (1 + 0.02 * (rng.normal(size=full.shape) + 1j * rng.normal(size=full.shape)))
    full = full * (-(w[:, None, None] ** 2) if kind == "accelerance" else 1.0)
    full[:, :2, 1] = full[:, 2:, 0] = 1e-9  # lines along y and z do not meet
    io.write_uff(tmp_path / "test.uff", mbs.linear.TransferFunctions(w, full, CHANNELS, CHANNELS[1:3], kind))
    frf = io.read_uff(tmp_path / "test.uff", **({"kind": kind} if kind != "receptance" else {}))
    values = np.array(frf.values)
    values[:, :2, 1] = values[:, 2:, 0] = np.nan
    near = {"y": 950.0, "z": 1450.0, "tip": 0.75, "damper": 1.7e-3}
    found = experiment.update(model, near, frf=frf.with_values(values), frf_deviation=0.02, residual=residual)
    errors = found.identification
    assert found.ok and 0.8 < errors.chi_squared / errors.freedom < 1.2
    for name, value in (TRUTH | {"damper": 2e-3}).items():
        assert abs(errors.unknowns[name] - value) < 4 * errors.standard_error(name) < 0.02 * value


@pytest.mark.long
def test_a_mode_without_partner_is_in_doubt():
    modes = measured()
    wrong = np.array(modes.shapes)
    wrong[:, 2] = (1.0, 0.0, 0.0, -1.0)
    found = experiment.update(model, TRUTH, modes=MeasuredModes(modes.frequencies, wrong, CHANNELS))
    assert 2 in found.doubtful and not found.ok and "similar shape" in str(found)


FAULTS = {
    "nothing": (lambda: experiment.update(model, FIRST), "measured modes, transfer functions, or both"),
    "residual": (lambda: experiment.update(model, FIRST, modes=measured(), residual="ratio"), "'logarithm' or"),
    "noise": (lambda: experiment.update(model, FIRST, modes=measured(), shape_deviation=0.0), "shape_deviation"),
    "rigid": (lambda: MeasuredModes([0.0, 1.0]), "leave rigid modes out"),
    "shapes": (lambda: MeasuredModes([1.0, 2.0], np.ones((3, 2)), ("a", "b")), "2 channels"),
}


@pytest.mark.parametrize("name", list(FAULTS))
def test_faults(name):
    call, message = FAULTS[name]
    with pytest.raises(ModelError, match=message):
        call()
    with pytest.raises(mbs.UnknownNameError):
        experiment.update(model, FIRST, modes=MeasuredModes([1.0], np.ones((1, 1)), ("9 x",)))
