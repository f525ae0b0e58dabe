"""Flows of a four-way valve against the law of each edge."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import hydraulics as H

PRESSURES = jnp.array([2e7, 1e5, 8e6, 5e6])  # p, t, a, b


def edge(drop, opening=1.0):
    return 1e-3 * opening * np.sqrt(drop / 3.5e6)


def test_rated_flow_at_the_rated_drop():
    valve = H.Valve(1e-3, 3.5e6)
    flows = valve.flows(jnp.array([1e7, 0.0, 1e7 - 3.5e6, 3.5e6]), 1.0)
    np.testing.assert_allclose(flows, [-1e-3, 1e-3, 1e-3, -1e-3], rtol=1e-12)


@pytest.mark.parametrize("spool", [0.6, -0.6])
def test_the_sign_of_the_spool_chooses_the_edges(spool):
    p, t, a, b = np.asarray(PRESSURES)
    flows = H.Valve(1e-3, 3.5e6).output(jnp.append(PRESSURES, spool), {}, 0.0)
    inward, outward = (edge(p - a, 0.6), edge(b - t, 0.6)) if spool > 0 else (edge(p - b, 0.6), edge(a - t, 0.6))
    to_a, to_b = (inward, -outward) if spool > 0 else (-outward, inward)
    np.testing.assert_allclose(flows, [-inward, outward, to_a, to_b], rtol=1e-5)
    np.testing.assert_allclose(jnp.sum(flows), 0.0, atol=1e-18)


def test_deadband_stroke_and_open_centre():
    valve = H.Valve(1e-3, 3.5e6, overlap=0.1)
    np.testing.assert_array_equal(valve.flows(PRESSURES, 0.05), 0.0)
    np.testing.assert_allclose(valve.openings(0.55), [0.5, 0.5, 0.0, 0.0])
    np.testing.assert_allclose(valve.openings(3.0), [1.01, 1.01, 0.0, 0.0])
    np.testing.assert_allclose(H.Valve(1e-3, 3.5e6, overlap=-0.1).openings(0.0), np.full(4, 0.1 / 1.1))


@pytest.mark.long
def test_slopes_by_spool_and_parameters():
    def into_a(valve, spool):
        return valve.flows(PRESSURES, spool)[2] * 1e3

    valve = H.Valve([1e-3, 2e-3, 1e-3, 2e-3], 3.5e6, overlap=0.05)
    by_valve = jax.grad(into_a)(valve, 0.4)
    h = 1e-6
    for name in ("overlap", "rated_drop", "laminar"):
        value = getattr(valve, name)
        step = h * (1.0 if name == "overlap" else 1e6)
        moved = [into_a(H.Valve(**(vars(valve) | {name: value + sign * step})), 0.4) for sign in (1, -1)]
        np.testing.assert_allclose(getattr(by_valve, name), (moved[0] - moved[1]) / (2 * step), rtol=1e-5)
    slope = jax.grad(into_a, 1)(valve, 0.055)  # in the rounding
    np.testing.assert_allclose(slope, (into_a(valve, 0.055 + h) - into_a(valve, 0.055 - h)) / (2 * h), rtol=1e-6)


def test_faults():
    assert len(H.Valve([1.0, 1.0], 0.0, 1.0, 0.0, 0.0).faults()) == 5
