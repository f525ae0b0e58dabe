"""Run-up of a Jeffcott rotor beside an integration of its equation by SciPy."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxmbs as mbs
from jaxmbs import rotors


@pytest.mark.long
@pytest.mark.parametrize("rates", [(0.0, 40.0), (260.0, -40.0)], ids=["run-up", "coast-down"])
def test_jeffcott_through_its_resonance(rates):
    """`m r'' + c r' + k r = m e (W^2 - i W') exp(i angle)` of a disk in the middle of a light shaft."""
    mass, push, (first, faster) = 10.0, 1e-3, rates
    shaft = rotors.Shaft([0.0, 0.5, 1.0], 0.012, density=1e-3)
    light = rotors.Rotor(shaft, [rotors.Disk(1, mass, 1e-7, 0.0)], [rotors.Bearing(k, 1e12, 0.0) for k in (0, 2)])
    stiffness = 48.0 * 2.1e11 * np.pi / 4.0 * 0.012**4 / 1.0**3
    damped = rotors.Rotor(light.shaft, light.disks, [*light.bearings, rotors.Bearing(1, 0.0, 60.0)])
    ts = np.linspace(0.0, 6.0, 12001)
    found = rotors.run_up(damped, lambda t: first + faster * t, {1: push}, ts, substeps=4, modes=4)

    def rate(t, y):
        w, angle = first + faster * t, first * t + 0.5 * faster * t**2
        force = push * (w**2 - 1j * faster) * np.exp(1j * angle)
        r, v = y[0] + 1j * y[1], y[2] + 1j * y[3]
        a = (force - 60.0 * v - stiffness * r) / mass
        return [v.real, v.imag, a.real, a.imag]

    wanted = solve_ivp(rate, (0.0, 6.0), np.zeros(4), "DOP853", ts, rtol=1e-10, atol=1e-14).y[:2]
    np.testing.assert_allclose(found.deflections[:, 1].T, wanted, atol=1e-3 * np.abs(wanted).max())
    assert np.argmax(found.amplitude(1)) not in (0, 12000)
    quick = rotors.run_up(damped, lambda t: first + 2.0 * faster * t, {1: push}, ts[: len(ts) // 2], modes=4)
    assert jnp.max(quick.amplitude(1)) < jnp.max(found.amplitude(1))  # a quicker passage swings less


def test_wrong_arguments_are_refused():
    rotor = rotors.Rotor(rotors.Shaft([0.0, 1.0], 0.01), (), [rotors.Bearing(k, 1e6) for k in (0, 1)])
    for match, given in {
        "equal steps": {"ts": [0.0, 1.0, 3.0]},
        "no station 7": {"unbalance": {7: 1e-3}},
        "substeps": {"substeps": 0},
        "modes": {"modes": 0},
    }.items():
        asked = {"unbalance": {0: 1e-3}, "ts": [0.0, 1.0]} | given
        with pytest.raises(mbs.ModelError, match=match):
            rotors.run_up(rotor, lambda t: 10.0 * t, **asked)
