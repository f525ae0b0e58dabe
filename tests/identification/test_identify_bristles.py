"""FR3's bristles from a noisy record of a mass that sticks and slips; and a bushing from its transfer function."""

import diffrax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs.friction import LuGre
from jaxmbs.identification import identify

TRUTH = {"limit": 1.0, "stiffness": 1e5, "ratio": 1.5}
FIRST = {"limit": 1.03, "stiffness": 7e4, "ratio": 1.46}


@pytest.mark.long
def test_bristles_from_a_noisy_record():
    """Creep of micrometres and the first slip: sliding effort, stiffness of the bristles, breakaway."""

    def build(u, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("mass", mass=1.0)
        b.joint("x", mbs.Prismatic("x"), "ground", "mass")
        b.force("spring", mbs.PD(mbs.Ramp(0.0, 0.1), kp=2.0), joint="x")
        law = F.FrictionForce(LuGre(u["limit"], u["stiffness"], 316.2, 0.4, u["ratio"] * u["limit"]))
        b.force("friction", law, joint="x")
        return b.build(like=like)

    like, ts = build(FIRST), np.unique(np.r_[np.linspace(0.0, 7.4, 150), np.linspace(7.4, 9.0, 50)])

    def record(u):
        system = build(u, like)
        options = dict(rtol=1e-8, atol=1e-10, solver=diffrax.Kvaerno5(), gradient="forward")
        return mbs.simulate(system, mbs.State.at(system, x=0.0), ts=ts, **options).states.coordinates[:, 0]

    clean = np.asarray(record(TRUTH))
    noisy = clean + 1e-6 * np.random.default_rng(5).normal(size=len(ts))
    found = identify(record, noisy, FIRST, deviations=1e-6)
    assert found.ok and 0.7 < found.chi_squared / found.freedom < 1.3
    for name, value in TRUTH.items():
        assert abs(found.unknowns[name] - value) < 4 * found.standard_error(name) < 0.05 * value


@pytest.mark.long
def test_a_bushing_from_the_transfer_function_of_a_mounted_mass():
    """Stiffness and damping along three axes by `linearise` and `frequency_response`, from noisy receptances."""

    def system_of(u, like=None):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("mass", mass=4.0, inertia=(0.02, 0.03, 0.04))
        b.joint("free", mbs.Free(), "ground", "mass")
        law = mbs.Bushing((u["kx"], u["ky"], u["kz"], 80.0, 90.0, 70.0), (u["cx"], u["cy"], u["cz"], 0.1, 0.1, 0.1))
        b.force("mount", law, between=("ground", "mass"))
        return b.build(like=like)

    truth = {"kx": 2e4, "ky": 3e4, "kz": 5e4, "cx": 40.0, "cy": 30.0, "cz": 60.0}
    first = {"kx": 1.6e4, "ky": 3.6e4, "kz": 4e4, "cx": 60.0, "cy": 50.0, "cz": 30.0}
    like = system_of(first)
    w = 2 * np.pi * np.geomspace(3.0, 60.0, 30)
    names = ["free x", "free y", "free z"]

    def receptances(u):
        system = system_of(u, like)
        linear = mbs.linearise(system, mbs.State.at(system)).system
        return mbs.frequency_response(linear, w, into=names, out=names).values[:, np.arange(3), np.arange(3)]

    clean = np.asarray(receptances(truth))
    exact = 1 / (np.array([2e4, 3e4, 5e4]) - 4.0 * w[:, None] ** 2 + 1j * w[:, None] * np.array([40.0, 30.0, 60.0]))
    np.testing.assert_allclose(clean, exact, rtol=1e-9)
    rng = np.random.default_rng(1)
    noise = 0.01 * np.abs(exact)
    noisy = exact + noise * (rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape))
    found = identify(receptances, noisy, first, deviations=noise)
    assert found.ok
    for name, value in truth.items():
        assert abs(found.unknowns[name] - value) < 4 * found.standard_error(name) < 0.1 * value
