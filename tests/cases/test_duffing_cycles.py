"""PO1, Duffing's oscillator: three cycles at one frequency, one of them unstable; multipliers, backbone, derivatives.

The numbers are those of shooting (DOP853, variational equations), confirmed by harmonic balance with 25 harmonics to
5e-14; the backbone by the complete elliptic integral.
"""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from tests.cycles.oscillators import duffing

SYSTEM = duffing()
#: By solution: frequency [rad/s], a start near it; displacement and speed at t = 0, greatest displacement, modulus of
#: the largest multiplier, amplitude of the third harmonic.
CYCLES = {
    "at 0.5": (0.5, (0.0, 0.0)),
    "at 1": (1.0, (0.0, 0.0)),
    "upper at 1.5": (1.5, (0.65, 2.4)),
    "lower at 1.5": (1.5, (-0.24, 0.04)),
    "middle at 1.5": (1.5, (-0.8, 2.27)),
    "at 2.5": (2.5, (0.0, 0.0)),
}
NUMBERS = np.array(
    (
        (0.3778355513379028, 0.012107527841015873, 0.37852628497829216, 0.5334880910911034, 0.005612096507122591),
        (0.8743097636294433, 0.30639922518711066, 0.9220285752903552, 0.7304026910486434, 0.012724400352161134),
        (0.6456392218610797, 2.482733210622525, 1.893171678065377, 0.8110386974860323, 0.04708838232057929),
        (-0.24080597801370532, 0.044266368749201784, 0.24260223976143655, 0.811038697486036, 9.279881797489718e-05),
        (-0.8031737196256444, 2.27072076974095, 1.7837080771074498, 1.405432109299246, 0.039103542517922044),
        (-0.05702720731559443, 0.006790976382608206, 0.05709186210974755, 0.8819113782981765, 4.209882271020088e-07),
    )
)
#: Of the greatest displacement of the upper one, by each number.
SLOPES = {
    "m": 1.4048351846599656,
    "c": -2.3922730067393867,
    "k": -0.635771197990261,
    "k3": -1.6153389090185117,
    "F": 0.9261092279401936,
}
#: Amplitude [m] and frequency [rad/s] of free motions without losses.
BACKBONE = {0.5: 1.0456649109245686, 1.0: 1.170781465960041, 2.0: 1.5691058028693223, 4.0: 2.6040081905309402}


def cycle(frequency, start, **numbers):
    system = duffing(w=frequency, like=SYSTEM, **numbers)
    state = mbs.State.at(SYSTEM, x=start[0], velocities={"x": start[1]})
    return system, mbs.periodic(system, 2.0 * np.pi / frequency, state)


def greatest(system, found):
    return mbs.motion.peak(system, found, lambda s: s.coordinates[0]).value


@pytest.mark.slow
@pytest.mark.parametrize(("name", "numbers"), list(zip(CYCLES, NUMBERS, strict=True)))
def test_cycle(name, numbers):
    (frequency, start), (x0, v0, peak, multiplier, third) = CYCLES[name], numbers
    system, found = cycle(frequency, start)
    x = np.asarray(found.states.coordinates[:-1, 0])
    np.testing.assert_allclose(x[0], x0, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.states.velocities[0, 0], v0, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(greatest(system, found), peak, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(abs(found.multipliers[0]), multiplier, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(2.0 * abs(np.fft.rfft(x)[3]) / len(x), third, atol=1e-8)
    product = np.exp(-0.1 * 2.0 * np.pi / frequency)  # Liouville
    np.testing.assert_allclose(np.prod(np.asarray(found.multipliers)).real, product, rtol=1e-9)
    assert bool(found.stable) == (name != "middle at 1.5") and found.ok


@pytest.mark.long
def test_slopes_of_the_greatest_displacement():
    given = {"m": 1.0, "c": 0.1, "k": 1.0, "k3": 0.5, "F": 0.3}
    found = mbs.jit(jax.grad(lambda d: greatest(*cycle(1.5, (0.65, 2.4), **d))))(given)
    for name, slope in SLOPES.items():
        np.testing.assert_allclose(found[name], slope, rtol=1e-6, atol=1e-6, err_msg=name)


@pytest.mark.long
def test_backbone():
    system = duffing(c=0.0, F=0.0, like=SYSTEM)
    for amplitude, frequency in BACKBONE.items():
        state, held = mbs.State.at(SYSTEM, x=amplitude), ["x", "rate of x"]
        found = mbs.periodic(system, 2.0 * np.pi / (1.02 * frequency), state, free="period", held=held)
        np.testing.assert_allclose(2.0 * np.pi * found.frequency, frequency, rtol=1e-10)
        assert not found.stable and not found.is_singular  # one of many, told by what is held
