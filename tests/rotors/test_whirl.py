"""A rotor of Timoshenko elements on cross-coupled bearings: the numbers of ROSS, another program.

ROSS 2.3.0 (ross-rotordynamics; Timbó and others, Journal of Open Source Software 5 (2020) 2120): six
`ShaftElement(0.25, idl=0 or 0.02, odl=0.05)` of `Material(rho=7810, E=211e9, G_s=81.2e9)`, two
`DiskElement.from_geometry(width=0.07, i_d=0.05, o_d=0.28)` at nodes 2 and 4, two `BearingElement(kxx=1e6, kyy=8e5,
kxy=2e5, kyx=-1e5, cxx=200, cyy=150)` at the ends; `run_modal` and `run_unbalance_response(2, 1e-3, 0, ...)`.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import rotors

SPEEDS = np.array([0.0, 200.0, 500.0])
DAMPED = np.array(
    (
        (94.71878203671413, 94.91732998417456, 289.1366236215584, 291.5457785656201, 762.6663853857139),
        (94.29952919423607, 95.32357481910694, 282.0994473420434, 298.47328625579684, 728.8277879654439),
        (93.44407895991056, 96.11607778567337, 271.28112892135454, 308.9031205936432, 676.0210717591233),
    )
)
RATIOS = np.array(
    (
        (
            -0.019514818129061053,
            0.026969129080789002,
            -0.01885244518930297,
            0.05590928485855798,
            0.008523157709737276,
        ),
        (0.02674071768755786, -0.020221934090887343, 0.06208497688921956, -0.021345585094783178, 0.07173733281910492),
        (0.027563636351585877, -0.022455168600363118, 0.07224602663642546, -0.02613772167297834, 0.07381147046011939),
    )
)
#: At 50, 86, 150 and 400 rad/s, of node 2 along x and y, of node 4 along x and y.
RESPONSE = np.array(
    (
        (4.6984952977889335e-06 + 6.042983762799568e-07j, 2.84740421839827e-07 - 5.319277091263846e-06j),
        (4.1986397510983075e-05 + 2.688479471875647e-05j, 1.0852812934565666e-05 - 6.86323240217955e-05j),
        (-1.813427900243646e-05 + 1.6628135608350972e-06j, 7.13344507964992e-07 + 1.627658505459694e-05j),
        (-3.695194655730438e-05 + 2.882443841830327e-06j, 1.3177547724899295e-06 + 3.2745981937249175e-05j),
        (4.15130739601134e-06 + 5.342435260271802e-07j, 2.51752236848072e-07 - 4.699761355741804e-06j),
        (4.03062352130474e-05 + 2.664076152218358e-05j, 1.0745075010023688e-05 - 6.669593898894546e-05j),
        (-2.4406720257205355e-05 + 6.742295515113849e-07j, 3.4338017611083055e-07 + 2.3648225284582267e-05j),
        (1.2092472460866532e-05 - 2.7398765667087672e-06j, -1.3025593012373972e-06 - 8.068644617962702e-06j),
    )
)


def of_ross(stiffness=1e6):
    shear = 81.2e9
    inner = [0.0, 0.0, 0.0, 0.01, 0.01, 0.01]
    shaft = rotors.Shaft(0.25 * np.arange(7), 0.025, inner, 211e9, 7810.0, poisson=211e9 / (2.0 * shear) - 1.0)
    disks = [rotors.Disk(k, 32.58972765304033, 0.17808928257067666, 0.32956362089137037) for k in (2, 4)]
    K = jnp.stack([jnp.stack([jnp.asarray(stiffness, float), jnp.asarray(2e5)]), jnp.array([-1e5, 8e5])])
    return rotors.Rotor(shaft, disks, [rotors.Bearing(k, K, np.diag([200.0, 150.0])) for k in (0, 6)])


@pytest.mark.slow
def test_roots_and_response_are_those_of_ross():
    found = rotors.whirl_speeds(of_ross(), SPEEDS, 5)
    np.testing.assert_allclose(found.whirl, DAMPED, rtol=1e-8)
    np.testing.assert_allclose(found.damping_ratios, RATIOS, rtol=1e-6)
    np.testing.assert_allclose(found.log_decrements[0, 0], -1.22638573e-01, rtol=1e-8)
    both = rotors.unbalance_response(of_ross(), [50.0, 86.0, 150.0, 400.0], {2: 1e-3}).deflections
    np.testing.assert_allclose(both[:, 2], RESPONSE[:4], rtol=1e-7)
    np.testing.assert_allclose(both[:, 4], RESPONSE[4:], rtol=1e-7)


@pytest.mark.long
def test_whirl_speeds_have_derivatives():
    damped = lambda k: rotors.whirl_speeds(of_ross(k), jnp.array([200.0]), 4).whirl[0]
    slope = mbs.jit(jax.jacrev(damped))(1e6)
    np.testing.assert_allclose(slope, (damped(1e6 + 10.0) - damped(1e6 - 10.0)) / 20.0, rtol=1e-5)


@pytest.mark.long
def test_map_of_critical_speeds():
    """Soft bearings carry a rigid rotor, stiff ones pin it: the map runs from one to the other."""
    rotor, soft = of_ross(), 1e3
    found = rotors.critical_speed_map(rotor, [soft, 1e7, 1e13, 1e14], 4)
    mass = float(jnp.sum(rotor.inertias()[0][:14:2, :14:2])) + 0.0
    np.testing.assert_allclose(found[0, :2], np.sqrt(2.0 * soft / mass), rtol=2e-2)
    assert np.all(np.diff(found, axis=0) >= -1e-6) and np.all(found[3] - found[2] < 1e-4 * found[2])


def by_frequency(station, stiffness, mass):
    """A bearing that carries a mass, as a table by frequency: `k - m w^2`."""
    frequencies = np.linspace(0.0, 2000.0, 201)
    K = (stiffness - mass * frequencies**2)[None, :, None, None] * np.eye(2)[None, None]
    return rotors.BearingTable(station, [0.0], K, np.zeros((1, 201, 2, 2)), frequencies)


@pytest.mark.long
def test_a_bearing_by_frequency_that_is_a_mass():
    """Where nothing damps it is a disk without moments of inertia."""
    shaft = rotors.Shaft([0.0, 0.4, 1.0], 0.02)
    disk = rotors.Disk(1, 8.0, 0.05, 0.09)
    table = rotors.Rotor(shaft, [disk], [by_frequency(0, 4e6, 3.0), rotors.Bearing(2, 6e6)])
    plain = rotors.Rotor(
        shaft, [disk, rotors.Disk(0, 3.0, 0.0, 0.0)], [rotors.Bearing(0, 4e6), rotors.Bearing(2, 6e6)]
    )
    speeds = np.array([0.0, 300.0, 900.0])
    found, wanted = (rotors.whirl_speeds(rotor, speeds, 4) for rotor in (table, plain))
    np.testing.assert_allclose(found.whirl, wanted.whirl, rtol=1e-7)
    np.testing.assert_allclose(found.sense[1:], wanted.sense[1:], atol=1e-6)
    found, wanted = (rotors.unbalance_response(rotor, speeds[1:], {1: 1e-3}) for rotor in (table, plain))
    np.testing.assert_allclose(found.deflections, wanted.deflections, rtol=1e-6)

    def whirl(mass):
        bearings = [by_frequency(0, 4e6, mass), rotors.Bearing(2, 6e6)]
        return rotors.whirl_speeds(rotors.Rotor(shaft, [disk], bearings), [300.0], 3).whirl[0]

    slope = jax.jacfwd(whirl)(3.0)
    np.testing.assert_allclose(slope, (whirl(3.01) - whirl(2.99)) / 0.02, rtol=1e-4)
