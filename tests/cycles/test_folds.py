"""Cycles in closed form around a fold: `x = cos t + xi` with `xi^2 = p`, whose slope by p is `1 / (2 xi)`.

The multipliers are `exp(2 pi r)`, `r^2 + c r + 2 xi = 0`: one of them is 1 at the fold.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.cycles._folds import FoldProbe

from .oscillators import slide

C = 0.5


class Folded(eqx.Module):
    """`p - (x - cos t)^2` and what `cos t` needs to be a motion."""

    p: jax.Array

    def __call__(self, x, v, t):
        return self.p - (x - jnp.cos(t)) ** 2 - jnp.cos(t) - C * jnp.sin(t) - C * v


@pytest.mark.long
def test_fold_and_lost_lanes_of_a_batch():
    """Slopes are right up to where they are refused, NaN beside the fold and beyond it, each lane by its status."""
    like = slide(1.0, None, law=mbs.Actuator(Folded(jnp.asarray(0.0))))

    def answer(d):
        def place(p):
            near = mbs.State.at(like, x=1.0 + d["near"])
            system = slide(1.0, like, law=mbs.Actuator(Folded(p)))
            cycle = mbs.periodic(system, 2.0 * np.pi, near, throw=False)
            return cycle.states.coordinates[0, 0] - 1.0, (cycle.is_singular, cycle.multipliers, cycle.result)

        return jax.value_and_grad(place, has_aux=True)(d["p"])

    xi = np.array([0.1, -0.1, 1e-3, -1e-3, 1e-6, -1e-6, 0.0])
    p, near = jnp.asarray([*xi**2, -1e-4, -0.1]), jnp.asarray([*(1.1 * xi[:-1]), 1e-3, 1e-3, 0.1])
    found = mbs.batch(answer, {"p": p, "near": near}, progress=False)
    (x, (is_singular, multipliers, results)), slope = found.values
    assert [int(s) for s in found.status] == [0] * 4 + [mbs.Status.NOT_FINITE] * 5  # their slopes
    assert [int(s) for s in results] == [0] * 7 + [mbs.Status.NO_CYCLE] * 2
    np.testing.assert_allclose(x[:4], xi[:4], rtol=1e-9, atol=1e-10)  # as near as the search ends
    np.testing.assert_allclose(x[4:7], xi[4:7], atol=1e-7)
    np.testing.assert_allclose(slope[:4], 0.5 / xi[:4], rtol=1e-6)
    assert np.all(np.isnan(slope[4:])) and np.all(np.isnan(x[7:])) and np.all(np.isnan(multipliers[7:]))
    assert list(is_singular[:7]) == [False] * 4 + [True] * 3
    roots = np.exp(2.0 * np.pi * (-C / 2.0 + np.sqrt(C**2 / 4.0 - 2.0 * xi[:4] + 0j)))
    np.testing.assert_allclose(np.abs(multipliers[:4, 0]), np.abs(roots), rtol=1e-8)


@pytest.mark.long
def test_a_fold_is_told_by_name():
    like = slide(1.0, None, law=mbs.Actuator(Folded(jnp.asarray(0.0))))
    with pytest.warns(UserWarning, match="at a fold, and has no derivatives"):
        found = mbs.periodic(like, 2.0 * np.pi, mbs.State.at(like, x=1.001))
    assert found.is_singular and not found.stable


def test_a_probe_looks_at_both_sides():
    """Of a least singular value `2 x` beside a fold at x = 0, and of one with a kink on its lower side."""
    for x, bend_below in ((1e-3, 2.0), (1e-3, 50.0)):
        least = lambda y, x=x, b=bend_below: jnp.asarray(2.0 * x + (2.0 if y >= x else b) * (y - x))
        probe, place = FoldProbe.none(jnp.zeros(1)), x
        probe = probe.after(jnp.asarray(False), least(x), least(x), jnp.ones(1))
        places = []
        while probe.is_wanted(least(x)):
            place = x + float(probe.displacement[0])
            places.append(place)
            probe = probe.after(jnp.asarray(True), least(x), least(place), jnp.ones(1))
        assert len(places) == 2 and places[0] - x == x - places[1] > 0.0
        np.testing.assert_allclose(probe.bend, bend_below, rtol=1e-6)
        share = 1e-2 * 2.0 * x / bend_below
        assert not probe.is_at_fold(least(x), jnp.asarray(0.9 * share))
        assert probe.is_at_fold(least(x), jnp.asarray(1.1 * share))
    assert FoldProbe.none(jnp.zeros(1)).is_at_fold(jnp.asarray(1e-8), jnp.asarray(0.0))
    assert not FoldProbe.none(jnp.zeros(1)).is_wanted(jnp.asarray(0.1))
