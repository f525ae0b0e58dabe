"""Efforts of force elements as signals: control of a force, in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks
from jaxmbs.errors import ModelError

PULL = 25.0  # [N]


def hoist(integral=40.0, more=lambda b: None):
    """A load on a spring and a damper below a hook that a controller of the pull moves."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("load", mass=2.0)
    b.body("hook", mass=0.5)
    b.joint("slide", mbs.Prismatic("z"), "ground", "load")
    b.joint("lift", mbs.Prismatic("z"), "ground", "hook", parent_frame=(0, 0, 1.0))
    b.force("rope", mbs.SpringDamper(2e3, 60.0, free_length=0.8), between=("load", "hook"))
    b.force("floor", mbs.SpringDamper(1e4, 200.0), joint="slide")
    b.force("brake", mbs.SpringDamper(0.0, 50.0), joint="lift")
    b.force("motor", mbs.Actuator(0.0), joint="lift")
    b.measure("pull", force="rope")
    b.block("error", blocks.Function(lambda u, t: -(PULL + u)), reads="pull")
    b.block("pi", blocks.PI(1.0, integral), reads="error", drives="motor")
    more(b)
    return b


@pytest.fixture(scope="module")
def motion():
    system = hoist().build()
    return system, mbs.simulate(system, mbs.State.at(system), t1=3.0)


def test_the_signal_is_the_effort_of_the_law(motion):
    system, moved = motion
    q, v = system.coordinates(moved.states), system.velocities(moved.states)
    length = 1.0 + q["lift"] - q["slide"]
    wanted = -(2e3 * (length - 0.8) + 60.0 * (v["lift"] - v["slide"]))
    np.testing.assert_allclose(mbs.signals(system, moved)["pull"], wanted, atol=1e-9)


def test_the_force_is_held(motion):
    system, moved = motion
    np.testing.assert_allclose(mbs.signals(system, moved)["pull"][-1], -PULL, rtol=1e-4)
    weight, carried = 2.0 * 9.81, PULL
    np.testing.assert_allclose(system.coordinates(moved.end)["slide"], (carried - weight) / 1e4, rtol=1e-3)


@pytest.mark.long
def test_gradient_by_a_gain():
    first = hoist().build()

    def overshoot(k):
        system = hoist(k).build(like=first)
        moved = mbs.simulate(system, mbs.State.at(system), t1=0.2)
        return jnp.sum(mbs.signals(system, moved)["pull"] ** 2)

    gradient = jax.grad(overshoot)(40.0)
    np.testing.assert_allclose(gradient, (overshoot(40.01) - overshoot(39.99)) / 0.02, rtol=1e-5)


def bushing_system():
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("engine", mass=10.0, inertia=0.1)
    b.joint("float", mbs.Free(), "ground", "engine")
    b.force(
        "mount", mbs.Bushing([1e4, 2e4, 3e4, 10.0, 10.0, 10.0], [100.0] * 3 + [1.0] * 3), between=("ground", "engine")
    )
    b.measure("load", force="mount")
    b.measure("vertical", force="mount", axis="z")
    return b.build()


@pytest.mark.slow
def test_a_bushing_has_its_load_in_its_axes():
    system = bushing_system()
    rest = mbs.equilibrium(system, mbs.State.at(system)).state
    found = mbs.signals(system, rest)
    own = mbs.reactions(system, rest).law("mount").effort
    np.testing.assert_allclose(found["load"], own, atol=1e-12)
    np.testing.assert_allclose(np.abs(found["vertical"]), 98.1, rtol=1e-9)


def test_an_element_with_states():
    """A spring in line with a damper: its force is the state's."""

    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("mass", mass=1.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "mass")
    b.force("maxwell", mbs.forces.Maxwell(stiffness=100.0, damping=5.0), joint="slide")
    b.measure("effort", force="maxwell")
    system = b.build()
    moved = mbs.simulate(system, mbs.State.at(system, velocities={"slide": 1.0}), t1=1.0)
    own = mbs.reactions(system, moved).law("maxwell").effort
    np.testing.assert_allclose(mbs.signals(system, moved)["effort"], own[..., 0] if own.ndim > 1 else own, atol=1e-12)


@pytest.mark.parametrize(
    "measure, words",
    [
        ({"force": "roap"}, "no force element 'roap': did you mean 'rope'"),
        ({"force": "motor"}, "block 'pi' drives 'motor', whose effort follows from it"),
        ({"force": "rope", "of": "position"}, "is 'effort', got 'position'"),
        ({"force": "rope", "joint": "lift"}, "give one of a function, joint=, force="),
        ({"force": "rope", "axis": "w"}, "axis is 'x', 'y' or 'z'"),
    ],
)
def test_what_is_no_signal(measure, words):
    with pytest.raises(ModelError, match=words):
        hoist(more=lambda b: b.measure("wrong", **measure)).build()


def test_a_function_is_refused_the_effort_of_what_a_block_drives():
    def more(b):
        b.measure("drive", lambda at: at.effort("motor"))

    with pytest.raises(ModelError, match="a field that a block drives has no value of its own"):
        hoist(more=more).build()


def test_a_model_file_keeps_it(tmp_path):
    b = mbs.SystemBuilder()
    b.body("load", mass=2.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "load")
    b.force("floor", mbs.SpringDamper(1e4, 200.0), joint="slide")
    b.measure("floor load", force="floor")
    mbs.save_model(b, tmp_path / "m.json")
    system = mbs.load_model(tmp_path / "m.json").build()
    np.testing.assert_allclose(mbs.signals(system, mbs.State.at(system, slide=0.01))["floor load"], -100.0)
