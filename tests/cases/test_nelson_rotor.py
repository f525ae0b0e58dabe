"""RO1, the rotor of Nelson and McVaugh (1976): whirl and critical speeds, unbalance response, orbits.

Numbers by exact transfer matrices of Rayleigh beams (whirl and critical speeds, unbalance) and by 72 cubic elements
(orthotropic bearings), which agree with each other to 1e-6; those of 18 cubic elements are of the same matrices.
"""

import numpy as np
import pytest

from jaxmbs import rotors

RPM = 60.0 / (2.0 * np.pi)
STATIONS = np.array(
    (
        0.0,
        0.0127,
        0.0508,
        0.0762,
        0.0889,
        0.1016,
        0.1067,
        0.1143,
        0.127,
        0.1346,
        0.1651,
        0.1905,
        0.2286,
        0.2667,
        0.287,
        0.3048,
        0.315,
        0.3454,
        0.3581,
    )
)
INNER = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0152, 0.0178, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0152))
OUTER = np.array(
    (
        0.0051,
        0.0102,
        0.0076,
        0.0203,
        0.0203,
        0.033,
        0.033,
        0.025400000000000002,
        0.025400000000000002,
        0.012700000000000001,
        0.012700000000000001,
        0.0152,
        0.0152,
        0.012700000000000001,
        0.012700000000000001,
        0.0381,
        0.0203,
        0.0203,
    )
)
DISK = rotors.Disk(4, 1.401, 0.00136, 0.00203)
UNBALANCE = 1.401 * 0.000635
ORTHOTROPIC = np.array([[3.503e7, -8.756e6], [-8.756e6, 3.503e7]])
#: Elements of nearly one length.
DIVISIONS = [int(k) for k in np.ceil(np.diff(STATIONS) / 0.01)]
#: Speed [rev/min] -> whirl speed [1/min], forward 1, backward -1.
WHIRL = {
    0.0: (
        (16269.36959952394, 1.0),
        (16269.36959952394, -1.0),
        (47706.245089784425, -1.0),
        (47706.24508978442, 1.0),
        (76218.08344952842, 1.0),
        (76218.08344952845, -1.0),
    ),
    20000.0: (
        (15244.693584967436, -1.0),
        (17303.833299875507, 1.0),
        (46979.240620955454, -1.0),
        (48383.48391753978, 1.0),
        (72279.43393264775, -1.0),
        (80384.61850625486, 1.0),
    ),
    70000.0: (
        (12828.737811910105, -1.0),
        (19826.665054614707, 1.0),
        (44914.30415156896, -1.0),
        (49895.65565358915, 1.0),
        (63974.6068194488, -1.0),
        (90900.90215572392, 1.0),
    ),
}
#: Forward, backward [1/min]; then those of 18 elements.
CRITICAL = np.array(
    (
        (17156.81787318516, 49297.57833477648, 95819.84922329603),
        (15474.808061256794, 45953.26591496872, 64732.07681846664),
    )
)
CRITICAL_18 = np.array(
    (
        (17156.832633833164, 49297.76591908867, 95831.88599695185),
        (15474.817033988225, 45953.38278933316, 64733.03969669152),
    )
)
#: Speed [rev/min], deflection of the disk along the unbalance [m], forces of the bearings [N].
RESPONSE = np.array(
    (
        (5000.0, 3.6916833013646455e-05, 433.938105963003, 167.84007244250637),
        (10000.0, 0.00020440838840729767, 2418.605257717728, 951.8883329333124),
        (16000.0, 0.0026448033084891494, 31718.84514065452, 12998.991974994291),
        (20000.0, -0.0014967046179222105, 18169.477257401977, 7773.847308896141),
        (40000.0, -0.0004694544793611724, 6186.877495347891, 5596.079298481495),
    )
)
#: Speed [rev/min], half axes of the disk's orbit [m].
ORBITS = np.array(
    (
        (10000.0, 0.0003418406474633602, 0.00019724442173279589),
        (16000.0, 0.006065613298558427, 0.001234827065907264),
        (20000.0, 0.0012943919313397935, 0.000942444560099341),
    )
)


def nelson_mcvaugh(stiffness=4.378e7, damping=0.0, divisions=DIVISIONS):
    shaft = rotors.Shaft(STATIONS, OUTER, INNER, 2.078e11, 7806.0, divisions=divisions)
    return rotors.Rotor(shaft, [DISK], [rotors.Bearing(k, stiffness, damping) for k in (10, 14)])


@pytest.mark.long
def test_whirl_speeds():
    found = rotors.whirl_speeds(nelson_mcvaugh(), np.array(list(WHIRL)) / RPM)
    for k, rows in enumerate(WHIRL.values()):
        values, senses = np.array(sorted(rows)).T
        np.testing.assert_allclose(found.whirl[k] * RPM, values, rtol=1e-6)
        if k:  # at rest either sense is as good
            np.testing.assert_allclose(found.sense[k], senses, atol=1e-6)
    np.testing.assert_allclose(found.damping_ratios, 0.0, atol=1e-9)


@pytest.mark.long
def test_critical_speeds():
    for divisions, wanted, rtol in ((DIVISIONS, CRITICAL, 1e-6), (1, CRITICAL_18, 1e-7)):
        found = rotors.critical_speeds(nelson_mcvaugh(divisions=divisions))
        for forward, speeds in zip((True, False), wanted, strict=True):
            np.testing.assert_allclose(found.of_sense(forward) * RPM, speeds, rtol=rtol)


@pytest.mark.slow
def test_unbalance_response():
    found = rotors.unbalance_response(nelson_mcvaugh(), RESPONSE[:, 0] / RPM, {4: UNBALANCE})
    np.testing.assert_allclose(found.deflections[:, 4, 0].real, RESPONSE[:, 1], rtol=1e-6)
    for k in (0, 1):
        np.testing.assert_allclose(found.bearing_orbit(k).major, RESPONSE[:, 2 + k], rtol=1e-6)
    bearings = ORTHOTROPIC, 1.752e3
    orbit = rotors.unbalance_response(nelson_mcvaugh(*bearings), ORBITS[:, 0] / RPM, {4: UNBALANCE}).orbit(4)
    np.testing.assert_allclose(orbit.major, ORBITS[:, 1], rtol=1e-6)
    np.testing.assert_allclose(orbit.minor, ORBITS[:, 2], rtol=1e-6)
