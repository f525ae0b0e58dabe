"""Arrows of the loads of cables, in pictures and scenes."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.forces import Attachment, Sheave
from jaxmbs.viz._element_arrows import arrows_along
from tests.viz.scenes.test_shape_solids import numbers

M, G = 3.0, 9.81


def hoist(closed=False):
    """A load on a rope over a fixed wheel, or a belt of two wheels."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("load", M)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(0.2, 0, -1.0))
    wheel = Sheave(("ground", (0, 0, 0)), 0.2, axis="y", side="+")
    if closed:
        other = Sheave(("load", (-0.2, 0, 0)), 0.2, axis="y", side="+")
        b.cable("rope", [wheel, other], stiffness=1e4, free_length=3.0, closed=True)
    else:
        path = [Attachment(("ground", (-0.2, 0, -1.0))), wheel, Attachment("load")]
        free = 2.0 + 0.2 * np.pi - M * G / 1e5
        b.cable("rope", path, stiffness=1e5, free_length=free, transition=1e-9)
    return b.build()


@pytest.mark.long
def test_arrows_of_a_cable():
    """The wheel carries twice the weight, either end once; the arrows begin on the rope."""
    system = hoist()
    state = mbs.State.at(system)
    place, force = (part[0] for part in arrows_along(system, state)["rope"])
    weight = np.array([0.0, 0.0, M * G])
    np.testing.assert_allclose(force, [weight, -2 * weight, weight], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(place, [[-0.2, 0, -1.0], [0, 0, 0], [0.2, 0, -1.0]], atol=1e-12)
    (stage,) = viz.scene(system, state, loads=True, limits={"rope": 100.0}).data["objects"]
    assert stage["arrows"]["names"] == ["rope"] * 3 and stage["arrows"]["limits"] == [100.0] * 3
    np.testing.assert_allclose(numbers(stage["arrows"]["force"], 3, 3), force, rtol=1e-6, atol=1e-4)
    drawn, plain = (
        viz.plot_mechanism(system, state, "xz", ax=Figure().add_subplot(), loads=loads) for loads in (True, False)
    )
    assert len(drawn.lines) == len(plain.lines) + 3


@pytest.mark.long
def test_arrows_of_a_belt():
    system = hoist(closed=True)
    state = mbs.State.at(system)
    place, force = (part[0] for part in arrows_along(system, state)["rope"])
    np.testing.assert_allclose(place, [[0, 0, 0], [0, 0, -1.0]], atol=1e-12)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-9)
