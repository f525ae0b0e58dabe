"""Measures and blocks in groups: many act as one by one, and a group costs what one block costs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks, forces
from jaxmbs import hydraulics as H

RNG = np.random.default_rng(3)
GAINS = RNG.uniform(1.0, 5.0, (4, 3))


def arms(members, every=None):
    """Hinged bodies, each with a control loop of its own: a filter of its speed, a PI with a target, a limit."""
    b = mbs.SystemBuilder()
    for k in members:
        kp, ki, target = GAINS[k]
        b.body(f"arm{k}", mass=1.0 + k, com=(0.3, 0.0, 0.0), inertia=0.1)
        b.joint(f"pin{k}", mbs.Revolute("y"), "ground", f"arm{k}")
        b.force(f"motor{k}", forces.Motor(0.0, 1.0, 0.1, 0.2), joint=f"pin{k}")
        b.measure(f"speed{k}", joint=f"pin{k}", of="velocity")
        b.block(f"filter{k}", blocks.FirstOrder(0.1 + 0.05 * k), reads=f"speed{k}")
        b.block(f"loop{k}", blocks.PI(kp, ki, target), reads=f"filter{k}", drives=f"motor{k}", every=every)
    return b.build()


def motion_of(members, every=None):
    system = arms(members, every)
    return mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 0.5, 6))


@pytest.mark.long
@pytest.mark.parametrize("every", [None, 0.05], ids=["continuous", "sampled"])
def test_many_loops_move_as_each_alone(every):
    together = motion_of(range(4), every)
    for k in range(4):
        alone = motion_of([k], every)
        for name in (f"loop{k}.integral", f"filter{k}.value", f"motor{k}.current"):
            np.testing.assert_allclose(
                together.states.internal[name], alone.states.internal[name], rtol=1e-6, atol=1e-8
            )


def seen(members):
    """Signals and accelerations at a state with all of them moving."""
    system = arms(members)
    internal = {f"loop{k}.integral": 0.3 + k for k in members} | {f"filter{k}.value": 0.1 * (k + 1) for k in members}
    state = mbs.State.at(system, velocities={f"pin{k}": 0.5 - k for k in members}, internal=internal)
    return mbs.signals(system, state), mbs.forward_dynamics(system, state)[0]


def test_many_loops_act_as_each_alone():
    together, accelerations = seen([0, 1])
    for k in range(2):
        alone, own = seen([k])
        assert set(alone) == {f"speed{k}", f"filter{k}", f"loop{k}"}
        for name, value in alone.items():
            np.testing.assert_allclose(together[name], value, atol=1e-14)
        np.testing.assert_allclose(accelerations[k], own[0], atol=1e-13)


def test_blocks_of_one_structure_are_one_group():
    system = arms(range(4))
    assert [group.names for group in system.blocks] == [
        tuple(f"filter{k}" for k in range(4)),
        tuple(f"loop{k}" for k in range(4)),
    ]
    assert [group.names for group in system.measures] == [tuple(f"speed{k}" for k in range(4))]


@pytest.mark.long
def test_an_input_of_one_block_of_a_group_is_its_own():
    system = arms(range(2))
    field = mbs.motion.vector_field(system, inputs=["loop1.target"], outputs=["loop0", "loop1"])
    y = field.start(mbs.State.at(system))
    slope = jax.jacfwd(lambda value: field.outputs(0.0, y, value))(jnp.array([0.3]))
    np.testing.assert_allclose(slope[:, 0], [0.0, GAINS[1, 0]], atol=1e-12)


def read_chains(members):
    """Two chains with measures of every kind, of some of them."""
    b = mbs.SystemBuilder()
    for k in range(2):
        b.body(f"link{k}", mass=1.0, inertia=0.1)
        b.body(f"rod{k}", mass=1.0, inertia=0.1)
        b.joint(f"hinge{k}", mbs.Revolute("y"), "ground", f"link{k}", parent_frame=(0.0, 0.5 * k, 0.0))
        b.joint(f"ball{k}", mbs.Spherical(), f"link{k}", f"rod{k}", parent_frame=(1.0, 0.0, 0.2))
    for k in members:
        b.measure(f"angle {k}", joint=f"hinge{k}")
        b.measure(f"turn {k}", joint=f"ball{k}", of="velocity")
        for of in ("position", "velocity", "angular velocity"):
            b.measure(f"{of} {k}", on=(f"rod{k}", (0.1, 0.2, 0.3 * k)), of=of)
            b.measure(f"{of} along {k}", on=f"rod{k}", of=of, axis="y")
        for of in ("position", "velocity", "angular velocity", "distance", "distance rate"):
            b.measure(f"{of} between {k}", between=(f"rod{k}", (f"link{1 - k}", (0.2, 0.1, 0.0))), of=of)
        b.measure(f"own {k}", lambda at, k=k: at.position(f"rod{k}") * at.coordinates[f"hinge{k}"])
    system = b.build()
    turn = {"hinge0": 0.3, "hinge1": -0.4, "ball0": [0.7, 0.5, -0.1, 0.5], "ball1": [0.1, 0.7, 0.7, 0.1]}
    rates = {"hinge0": 0.7, "hinge1": 0.2, "ball0": [0.4, -0.1, 0.3], "ball1": [-0.2, 0.6, 0.1]}
    return mbs.signals(system, mbs.State.at(system, turn, velocities=rates))


@pytest.mark.slow
def test_readings_of_many_are_those_of_each_alone():
    together = read_chains([0, 1])
    for k in range(2):
        alone = read_chains([k])
        assert len(alone) == 14
        for name, value in alone.items():
            np.testing.assert_allclose(together[name], value, atol=1e-14, err_msg=name)


def network(joined):
    """Volumes that orifices join in pairs, without a tank: the oil that they take up together stays."""
    b = mbs.SystemBuilder()
    b.body("mass", mass=1.0, inertia=0.1)
    b.joint("pin", mbs.Revolute("z"), "ground", "mass")
    for k in range(5):
        b.hydraulic(f"v{k}", H.Volume(1e-3 * (1 + k), pressure=1e6 * (k + 1)))
    for k, (i, j) in enumerate(joined):
        b.hydraulic(f"o{k}", H.Orifice(1e-6 * (1 + k)), ports={"a": f"v{i}", "b": f"v{j}"})
    return b.build()


def test_nodes_with_any_number_of_ports_are_one_group_and_keep_the_oil():
    joined = [(0, 1), (0, 2), (0, 3), (4, 1), (2, 1), (3, 4)]
    system = network(joined)
    assert [group.names for group in system.blocks] == [
        tuple(f"v{k}" for k in range(5)),
        tuple(f"o{k}" for k in range(6)),
    ]
    motion = mbs.simulate(system, mbs.State.at(system), ts=[0.0, 0.01, 0.02])
    capacity = np.array([float(H.Volume(1e-3 * (1 + k)).capacity(1e6)) for k in range(5)])
    oil = np.stack([motion.states.internal[f"v{k}.p"] for k in range(5)], axis=1) @ capacity
    np.testing.assert_allclose(oil, oil[0], rtol=1e-9)
    flows = mbs.signals(system, motion.states)
    drop = motion.states.internal["v4.p"] - motion.states.internal["v1.p"]
    np.testing.assert_allclose(flows["o3"], jax.vmap(H.Orifice(4e-6).flow)(drop), rtol=1e-12)
