"""Orbits are drawn as the shaft moves, and where it moves backward they say so."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from jaxmbs import errors, rotors, viz


def response():
    """Of a rotor on bearings whose directions differ: between its two critical speeds the whirl is backward."""
    shaft = rotors.Shaft(np.linspace(0.0, 1.0, 3), 0.02)
    stiffness = [[2e6, 3e5], [3e5, 6e5]]
    rotor = rotors.Rotor(
        shaft, [rotors.Disk(1, 8.0, 0.02, 0.03)], [rotors.Bearing(k, stiffness, 20.0) for k in (0, 2)]
    )
    return rotors.unbalance_response(rotor, np.linspace(60.0, 500.0, 45), {1: 1e-4 + 5e-5j})


def test_ellipses_are_the_path_of_the_shaft():
    found = response()
    orbit = found.orbit(1)
    backward = int(np.argmin(orbit.minor))
    assert orbit.minor[backward] < 0.0
    speeds = [orbit.speeds[0], orbit.speeds[backward]]
    ax = viz.plot_orbits(orbit, at=speeds)
    for line, k in zip(ax.lines, (0, backward), strict=True):
        t = np.linspace(0.0, 2.0 * np.pi, 7)
        x, y = (np.asarray(found.deflections)[k, 1, None, :] * np.exp(1j * t)[:, None]).real.T
        drawn = np.asarray(line.get_xydata())
        away = np.min(np.hypot(drawn[:, :1] - x, drawn[:, 1:] - y), axis=0)
        assert np.max(away) < 0.02 * orbit.major[k]
        turn = np.sign(drawn[0, 0] * drawn[1, 1] - drawn[0, 1] * drawn[1, 0])
        assert turn == orbit.sense[k] and ("backward" in line.get_label()) == (k == backward)
    assert len(viz.plot_orbits(orbit).lines) in (4, 5)
    plt.close("all")


def test_wrong_arguments_are_refused():
    with pytest.raises(errors.ModelError, match="orbit="):
        viz.plot_orbits(response())
    with pytest.raises(errors.ModelError, match="between 60 and 500"):
        viz.plot_orbits(response().orbit(1), at=[20.0])
