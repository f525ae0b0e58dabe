"""A rotor with shear, a hollow part and cross-coupled bearings beside ROSS 2.3.0: roots and response to unbalance."""

import numpy as np
import pytest

from jaxmbs import rotors

pytestmark = pytest.mark.long

E, G = 211e9, 81.2e9
#: By speed [rad/s]: damped natural frequencies [rad/s] and damping ratios.
ROOTS = {
    0.0: (
        (94.71878203671413, 94.91732998417456, 289.1366236215584, 291.5457785656201, 762.6663853857139),
        (
            -0.019514818129061053,
            0.026969129080789002,
            -0.01885244518930297,
            0.05590928485855798,
            0.008523157709737276,
        ),
    ),
    200.0: (
        (94.29952919423607, 95.32357481910694, 282.0994473420434, 298.47328625579684, 728.8277879654439),
        (0.02674072, -0.020221934090887343, 0.06208497688921956, -0.021345585094783178, 0.07173733181910492),
    ),
    500.0: (
        (93.44407895991056, 96.11607778567337, 271.28112892135454, 308.9031205936432, 676.0210717591233),
        (0.027563636351585877, -0.022455168600363118, 0.07224602663642546, -0.02613772167297834, 0.07381147046011939),
    ),
}
SPEEDS = (50.0, 86.0, 150.0, 400.0)
#: By station: complex deflections [m] along x and y at these speeds, of 1e-3 kg m at station 2.
RESPONSES = {
    2: (
        (
            4.6984952977889335e-06 + 6.042983762799568e-07j,
            4.1986397510983075e-05 + 2.688479471875647e-05j,
            -1.813427900243646e-05 + 1.6628135608350972e-06j,
            -3.695194655730438e-05 + 2.882443841830327e-06j,
        ),
        (
            2.84740421839827e-07 - 5.319277091263846e-06j,
            1.0852812934565666e-05 - 6.86323240217955e-05j,
            7.13344507964992e-07 + 1.627658505459694e-05j,
            1.3177547724899295e-06 + 3.2745981937249175e-05j,
        ),
    ),
    4: (
        (
            4.15130739601134e-06 + 5.342435260271802e-07j,
            4.03062352130474e-05 + 2.664076152218358e-05j,
            -2.4406720257205355e-05 + 6.742295515113849e-07j,
            1.2092472460866532e-05 - 2.7398765667087672e-06j,
        ),
        (
            2.51752236848072e-07 - 4.699761355741804e-06j,
            1.0745075010023688e-05 - 6.669593898894546e-05j,
            3.4338017611083055e-07 + 2.3648225284582267e-05j,
            -1.3025593012373972e-06 - 8.068644617962702e-06j,
        ),
    ),
}


def rotor():
    hollow = [0.0, 0.0, 0.0, 0.01, 0.01, 0.01]
    shaft = rotors.Shaft(0.25 * np.arange(7), 0.025, hollow, E, 7810.0, poisson=E / (2.0 * G) - 1.0)
    disks = [rotors.Disk(k, 32.58972765304033, 0.17808928257067666, 0.32956362089137037) for k in (2, 4)]
    spring, damper = [[1e6, 2e5], [-1e5, 0.8e6]], [[200.0, 0.0], [0.0, 150.0]]
    return rotors.Rotor(shaft, disks, [rotors.Bearing(k, spring, damper) for k in (0, 6)])


def test_roots_over_the_speed():
    found = rotors.whirl_speeds(rotor(), list(ROOTS), 5)
    for k, (frequencies, ratios) in enumerate(ROOTS.values()):
        np.testing.assert_allclose(found.whirl[k], frequencies, rtol=1e-9)
        np.testing.assert_allclose(found.damping_ratios[k], ratios, rtol=1e-7, atol=1e-9)


def test_response_to_unbalance():
    found = rotors.unbalance_response(rotor(), SPEEDS, {2: 1e-3}).deflections
    for station, (x, y) in RESPONSES.items():
        np.testing.assert_allclose(found[:, station], np.stack([x, y], axis=1), rtol=1e-8, atol=1e-14)
