"""Results that laws give of themselves, and forces for arrows, against statics."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs.dynamics._element_reports import element_arrows, element_reports

M, G = 3.0, 9.81


class Foot(F.AbstractBodyLaw):
    """A load (3,) in world axes at a frame, as of a tyre on the ground."""

    load: jax.Array = eqx.field(converter=lambda x: jnp.asarray(x, float))

    def wrench(self, rotation, position, angular_velocity, velocity, t):
        return self.load, jnp.zeros(3)

    def report(self, rotation, position, *_):
        return {"height": F.Reading(position[2], "m")}

    def arrows(self, rotation, position, *_):
        return F.Arrows(position[None], self.load[None])


class Peg(F.AbstractPoseLaw):
    """A load (3,) in the axes of the first frame on the second one."""

    load: jax.Array = eqx.field(converter=lambda x: jnp.asarray(x, float))

    def wrench(self, rotation, displacement, angular_velocity, velocity, t):
        return self.load, jnp.zeros(3)

    def arrows(self, rotation, displacement, *_):
        return F.Arrows(displacement[None], self.load[None])


def placed(law, **place):
    """A body on a slide along the world's z, 0.5 above (1, 2, 0)."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("load", M)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(1.0, 2.0, 0.0))
    b.frame("turned", "ground", (1.0, 0.0, 0.0), mbs.rotations.from_axis_angle("z", np.pi / 2))
    b.force("own", law, **place)
    b.force("other", mbs.Force((0, 0, 1.0)), on="load")
    system = b.build()
    return system, mbs.State.at(system, lift=0.5)


def test_a_load_at_a_frame():
    system, state = placed(Foot((1.0, 2.0, 3.0)), on="load")
    report = element_reports(system, state)
    assert set(report.results) == {"own"} and report.results["own"]["height"].unit == "m"
    np.testing.assert_allclose(report.results["own"]["height"].value, 0.5)
    points, forces = element_arrows(system, state)["own"]
    np.testing.assert_allclose(points, [[1.0, 2.0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(forces, [[1.0, 2.0, 3.0]])


def test_a_load_between_frames_is_turned_into_the_world():
    system, state = placed(Peg((1.0, 2.0, 3.0)), between=("turned", "load"))
    points, forces = element_arrows(system, state)["own"]
    np.testing.assert_allclose(points, [[1.0, 2.0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(forces, [[-2.0, 1.0, 3.0]], atol=1e-12)
    assert element_reports(system, state).results == {}
    assert "no force element" in repr(element_reports(system, state))


def hoist(**rope):
    """A load on a rope over a fixed wheel to the ground, as long as the motion of the load stretches it by its
    weight, or inextensible."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("load", M)
    b.joint("lift", mbs.Prismatic("z"), "ground", "load", parent_frame=(0.2, 0, -1.0))
    wheel = F.Sheave(("ground", (0, 0, 0)), 0.2, axis="y", side="+")
    path = [F.Attachment(("ground", (-0.2, 0, -1.0))), wheel, F.Attachment("load")]
    b.cable("rope", path, **rope)
    system = b.build()
    return system, mbs.State.at(system)


ROPES = {
    "elastic": {"stiffness": 1e5, "free_length": 2.0 + 0.2 * np.pi - M * G / 1e5, "transition": 1e-9},
    "inextensible": {"inextensible": True, "free_length": 2.0 + 0.2 * np.pi},
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROPES)
def test_a_rope_carries_the_weight(kind):
    system, state = hoist(**ROPES[kind])
    said = mbs.dynamics.element_reports(system, state).results["rope"]
    np.testing.assert_allclose(said["tension"].value, M * G, rtol=1e-6)
    np.testing.assert_allclose(said["length"].value, 2.0 + 0.2 * np.pi, rtol=1e-9)
    np.testing.assert_allclose(said["wrap about"].value, [0.0, np.pi, 0.0], atol=1e-9)
    points, forces = element_arrows(system, state)["rope"]
    np.testing.assert_allclose(points, [[-0.2, 0, -1.0], [0, 0, 0], [0.2, 0, -1.0]], atol=1e-9)
    np.testing.assert_allclose(forces[:, 2], [M * G, -2 * M * G, M * G], rtol=1e-6)


@pytest.mark.slow
def test_they_go_along_a_motion_and_have_slopes():
    system, state = hoist(**ROPES["elastic"])
    states = jax.tree.map(lambda x: jnp.stack([x, x]), state)
    several = mbs.dynamics.element_reports(system, states)
    assert several.results["rope"]["tension"].value.shape == (2,) and "2 times" in repr(several)
    assert several.to_pandas().shape[0] == 2

    def tension(lift):
        return element_reports(system, mbs.State.at(system, lift=lift)).results["rope"]["tension"].value

    np.testing.assert_allclose(jax.grad(tension)(0.0), -1e5, rtol=1e-6)
