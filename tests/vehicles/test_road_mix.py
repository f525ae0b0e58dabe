"""Damage over a mix of roads: by spectra against the formula of narrow bands, by records against rainflow; shares."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import gamma

import jaxmbs as mbs
from jaxmbs import fatigue, vehicles

CURVE = fatigue.SN(1e18, 4.0)
WHEELS = {"road": (0.0, 0.0)}
C, D = (vehicles.RandomRoad.of_class(name) for name in "CD")
WAY = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)


def quarter_car():
    """Tyre and strut of a quarter car; and the strut's force along a diagonal, as a point with three components."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name, mass in (("plate", 1.0), ("wheel", 45.0), ("body", 380.0)):
        b.body(name, mass=mass)
    b.joint("road", mbs.Prismatic("z"), "ground", "plate", drive=mbs.forces.Constant(0.0))
    b.joint("tyre", mbs.Prismatic("z"), "plate", "wheel")
    b.joint("strut", mbs.Prismatic("z"), "wheel", "body")
    b.force("tyre", mbs.SpringDamper(stiffness=200e3), joint="tyre")
    b.force("strut", mbs.SpringDamper(stiffness=22e3, damping=1500.0), joint="strut")
    system = b.build()

    def forces(state, _):
        q, v = state.coordinates, state.velocities
        strut = 22e3 * q[2] + 1500.0 * v[2]
        return jnp.concatenate([jnp.stack([200e3 * q[1], strut]), strut * WAY])

    found = mbs.linearise(system, mbs.State.at(system), inputs=["road"], outputs=forces)
    return dataclasses.replace(found, output_names=("tyre", "strut", "LF x", "LF y", "LF z"))


@pytest.mark.slow
def test_spectra_by_the_formula_of_narrow_bands_and_slopes():
    linear = quarter_car()

    @mbs.jit
    def life(speed, share, factor):
        road = vehicles.RandomRoad(factor * D.level)
        mix = {"C": vehicles.RoadShare(C, speed, 1.0 - share), "D": vehicles.RoadShare(road, 12.0, share)}
        return vehicles.road_mix_damage(linear, mix, WHEELS, CURVE, 1e6, "narrowband")

    found = life(20.0, 0.3, 1.0)
    assert found.points == ("tyre", "strut", "LF") and found.roads == ("C", "D")
    for k, (road, speed, share) in enumerate(((C, 20.0, 0.7), (D, 12.0, 0.3))):
        response = mbs.random_response(linear, vehicles.wheel_inputs(road, speed, WHEELS)[0])
        crossings = np.asarray(response.zero_crossing_rate)[:2]
        rate = crossings * (np.sqrt(2.0) * np.asarray(response.rms)[:2]) ** 4 * gamma(3.0) / 1e18
        np.testing.assert_allclose(found.by_road[k, :2], rate * share * 1e6 / speed, rtol=1e-6)
    np.testing.assert_allclose(found.by_road[:, 2], found.by_road[:, 1], rtol=1e-9)
    np.testing.assert_allclose(np.abs(found.directions[2]), np.abs(WAY), atol=1e-12)
    np.testing.assert_allclose(found.life, 1e6 / found.damage, rtol=1e-12)
    at, h = (20.0, 0.3, 1.0), 1e-4
    slopes = jax.jacfwd(lambda *x: life(*x).damage, (0, 1, 2))(*at)
    for k, slope in enumerate(slopes):
        up, down = (life(*(x + s * h * (i == k) for i, x in enumerate(at))).damage for s in (1, -1))
        np.testing.assert_allclose(slope, (up - down) / (2 * h), rtol=1e-5)


def test_records_by_their_cycles():
    """Ten cycles do ten over N; along a diagonal the same; a record counts as often as it is driven."""
    t = np.linspace(0.0, 1.0, 401)
    wave = 3e3 * np.cos(20 * np.pi * t)
    rough = {"rod": wave, "LF": wave[:, None] * WAY + [10.0, 0.0, 5.0]}
    smooth = {"rod": 0.5 * wave, "LF": 0.5 * wave[:, None] * np.array([0.0, 0.0, 1.0])}
    records = {"rough": vehicles.RoadRecord(rough, 50.0, 0.25), "smooth": vehicles.RoadRecord(smooth, 100.0, 0.75)}
    found = vehicles.road_records_damage(records, CURVE, 4e5)
    once = 10.0 * 3e3**4 / 1e18
    turns = np.array([4e5 * 0.25 / 50.0, 4e5 * 0.75 / 100.0])
    np.testing.assert_allclose(found.by_road[:, 0], turns * once * np.array([1.0, 1 / 16]), rtol=1e-3)
    np.testing.assert_allclose(found.by_road[:, 1], turns * once * np.array([1.0, 0.0]), rtol=1e-3, atol=1e-12)
    assert "rough" in str(found)
    with pytest.raises(mbs.ModelError, match="add up to one"):
        vehicles.road_records_damage({"rough": records["rough"]}, CURVE, 4e5)
    with pytest.raises(mbs.ModelError, match="curves has none of point 'LF'"):
        vehicles.road_records_damage(records, {"rod": CURVE}, 4e5)
    with pytest.raises(mbs.ModelError, match="no point 'LF'"):
        other = records["smooth"]._replace(loads={"rod": wave})
        vehicles.road_records_damage({**records, "smooth": other}, CURVE, 4e5)
