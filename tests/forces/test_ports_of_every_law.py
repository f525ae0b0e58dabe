"""Every force law on every port that it can have, against closed forms of blocks on slides and arms on pins."""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import jaxmbs as mbs
from jaxmbs import forces as F
from jaxmbs.bondgraph import junction_residual
from jaxmbs.dynamics.paper._ports import compliance_effort, resistance_effort, source_effort
from jaxmbs.forces._ports import PosePort
from jaxmbs.friction import BearingFriction
from tests.marks import cases

X, V, T = 0.5, 0.3, 0.4  # where the laws are asked: distance or coordinate [m], its rate [m/s], time [s]
M, HOLD, HOME = 2.0, 60.0, 0.45  # mass of a block [kg], rate [N/m] and free length [m] of the spring that holds it


def oil(x, v, t):
    return 6.0 * jnp.cos(t) - 9.0 * x**2 - 0.4 * v


LAWS = {
    "SpringDamper": F.SpringDamper(40.0, damping=0.7, free_length=0.3, preload=-2.0),
    "Table": F.Table([0.1, 0.9], [-4.0, 8.0], [-1.0, 1.0], [-3.0, 3.0]),
    "PolynomialSpring": F.PolynomialSpring([40.0, -30.0], [0.5, 0.2], lower=0.2, upper=0.3),
    "BumpStop": F.BumpStop(900.0, lower=0.2, upper=0.4, exponent=2.0, damping=0.5),
    "FrictionForce": F.FrictionForce(BearingFriction(1.0, 1.4, 0.1, viscous=0.2), 5.0),
    "AirSpring": F.AirSpring(2e-3, 3e4, 0.4, exponent=1.3, ambient=1e4, length=0.3),
    "Actuator": F.Actuator(oil),
    "PD": F.PD(F.Harmonic(mean=0.6, amplitude=0.1, omega=2.0), kp=30.0, kd=2.0),
}
SOURCES = ("Actuator", "PD")


def stored(name, x):
    """Minus the slope of the stored energy [N], in NumPy."""
    if name == "SpringDamper":
        return -(40.0 * (x - 0.3) - 2.0)
    if name == "Table":
        return -15.0 * (x - 0.1) + 4.0
    if name == "PolynomialSpring":
        d = np.maximum(x - 0.3, 0.0) + np.minimum(x - 0.2, 0.0)
        return -40.0 * d + 30.0 * d**2
    if name == "BumpStop":
        return 900.0 * (np.maximum(0.2 - x, 0.0) ** 2 - np.maximum(x - 0.4, 0.0) ** 2)
    if name == "AirSpring":
        return 2e-3 * (3e4 * (0.4 / (x + 0.1)) ** 1.3 - 1e4)
    return 0.0 * x


def energy(name, x):
    """Stored energy [J]."""
    if name == "SpringDamper":
        return 20.0 * (x - 0.3) ** 2 - 2.0 * (x - 0.3)
    if name == "Table":
        return 7.5 * (x - 0.1) ** 2 - 4.0 * (x - 0.1)
    if name == "PolynomialSpring":
        d = np.maximum(x - 0.3, 0.0) + np.minimum(x - 0.2, 0.0)
        return 20.0 * d**2 - 10.0 * d**3
    if name == "BumpStop":
        return 300.0 * (np.maximum(0.2 - x, 0.0) ** 3 + np.maximum(x - 0.4, 0.0) ** 3)
    if name == "AirSpring":
        return 2e-3 * (3e4 * 0.4 * (((x + 0.1) / 0.4) ** -0.3 - 1.0) / 0.3 + 1e4 * (x - 0.3))
    return 0.0 * x


def rest(name, x, v, t):
    """What is not stored: dampers and sources [N]."""
    if name == "AirSpring":
        return 0.0 * x
    if name == "SpringDamper":
        return -0.7 * v
    if name == "Table":
        return -3.0 * v
    if name == "PolynomialSpring":
        return -0.5 * v - 0.2 * np.abs(v) * v
    if name == "BumpStop":
        return (
            -900.0
            * 0.5
            * (
                np.maximum(x - 0.4, 0.0) ** 2 * np.maximum(v, 0.0)
                + np.maximum(0.2 - x, 0.0) ** 2 * np.minimum(v, 0.0)
            )
        )
    if name == "FrictionForce":
        return -5.0 * (1.0 + 0.4 * np.exp(-(v**2))) * np.tanh(v / 0.1) - 0.2 * v
    if name == "Actuator":
        return 6.0 * np.cos(t) - 9.0 * x**2 - 0.4 * v
    wanted, rate = 0.6 + 0.1 * np.sin(2.0 * t), 0.2 * np.cos(2.0 * t)
    return 30.0 * (wanted - x) + 2.0 * (rate - v)


def effort(name, x, v, t):
    return stored(name, x) + rest(name, x, v, t)


def slope(function, x, h=1e-6):
    return (function(x + h) - function(x - h)) / (2 * h)


def test_every_law_is_here():
    """Those with internal states have a file of their own; of some they follow from their parameters."""
    room = {name: getattr(F, name) for name in F.__all__}
    laws = {name: law for name, law in room.items() if inspect.isclass(law) and issubclass(law, F.AbstractLaw)}
    none = F.AbstractLaw.internal_states
    laws = {name for name, law in laws.items() if law.internal_states is none or name in LAWS}
    own_tests = {
        "BeamElement",
        "BevelGear",
        "Cable",
        "GearPair",
        "WormGear",
    }  # of a shape without load, over several frames
    assert {name for name in laws if not name.startswith("Abstract")} == {*LAWS, *OTHERS, *own_tests}


def blocks(b):
    """For each law a block with it on the joint, one with it between points, and two blocks it acts between."""
    slide = mbs.Prismatic("x")
    for name, law in LAWS.items():
        for part in ("joint", "line", "a", "b"):
            b.body(f"{name}_{part}", M)
            b.joint(f"{name}.{part}", slide, "ground", f"{name}_{part}")
            b.force(f"{name} hold {part}", mbs.SpringDamper(HOLD, free_length=HOME), joint=f"{name}.{part}")
        b.force(f"{name} joint", law, joint=f"{name}.joint")
        b.force(f"{name} line", law, between=(("ground", (0.0, 0.1, 0.0)), (f"{name}_line", (0.0, 0.1, 0.0))))
        b.force(f"{name} pair", law, between=(f"{name}_a", f"{name}_b"))


def state_of(system, x=X, v=V, more=None):
    """The blocks at x with rates v, the pairs from 0.2 on, so that they part by the same; `more`: other joints."""
    at = {name: place for name, (place, _) in (more or {}).items()}
    rates = {name: rate for name, (_, rate) in (more or {}).items()}
    for name in LAWS:
        at |= {f"{name}.joint": x, f"{name}.line": x, f"{name}.a": 0.2, f"{name}.b": 0.2 + x}
        rates |= {f"{name}.joint": v, f"{name}.line": v, f"{name}.a": 0.1, f"{name}.b": 0.1 + v}
    return mbs.State.at(system, at, rates, t=T)


def column(system, joint):
    top = system.topology
    return top.joints[top.joint_index[joint]].first_velocity


def columns(system, name):
    return [column(system, f"{name}.{part}") for part in ("joint", "line", "a", "b")]


def no_gravity():
    return mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def system():
    """Blocks, arms and the other laws."""
    b = no_gravity()
    blocks(b)
    arms(b)
    others(b)
    return b.build()


@pytest.fixture(scope="module")
def state(system):
    pins = {f"{name}.pin": (0.3, 0.8) for name in LAWS}
    return state_of(system, more=pins | {f"{name}.free": (X, V) for name in OTHERS})


@pytest.fixture(scope="module")
def linear(system, state):
    return mbs.linearise(system, state)


@pytest.fixture(scope="module")
def powers(system, state):
    return mbs.bondgraph.bond_powers(system, state)


@pytest.fixture(scope="module")
def answers(system, state):
    """What is asked once for all laws."""
    return _answers(system, state)


@eqx.filter_jit
def _answers(system, state):
    return {
        "accelerations": mbs.forward_dynamics(system, state)[0],
        "potential": mbs.dynamics.potential_energy(system, state),
        "compliance": compliance_effort(system, state),
        "resistance": resistance_effort(system, state),
        "source": source_effort(system, state),
        "stiffness": mbs.stiffness(system, state),
        "reactions": mbs.reactions(system, state),
    }


@pytest.fixture(scope="module")
def few():
    """The blocks alone."""
    b = no_gravity()
    blocks(b)
    return b.build()


def hold(x):
    return -HOLD * (x - HOME)


parametrise = pytest.mark.parametrize("name", LAWS)


@pytest.mark.long
@parametrise
def test_accelerations_of_blocks(system, answers, name):
    joint, line, a, b = (float(answers["accelerations"][i]) for i in columns(system, name))
    force = effort(name, X, V, T)
    np.testing.assert_allclose(M * np.array([joint, line]), force + hold(X), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(M * np.array([a, b]), [hold(0.2) - force, hold(0.2 + X) + force], rtol=1e-12)


@pytest.mark.long
def test_stored_energy(answers):
    held = sum(HOLD / 2 * (x - HOME) ** 2 for x in (X, X, 0.2, 0.2 + X))
    struts = sum(energy(name, strut(0.3)[0]) for name in LAWS)
    springs = sum(3 * energy(name, X) + held for name in LAWS)
    np.testing.assert_allclose(answers["potential"], springs + struts + 25.0 * X**2, rtol=1e-12)


@pytest.mark.long
@parametrise
def test_efforts_by_cause(system, answers, name):
    at_rest = rest(name, X, 0.0, T)
    parts = {
        "compliance": (stored(name, X), [hold(X), hold(X), hold(0.2), hold(0.2 + X)]),
        "resistance": (rest(name, X, V, T) - at_rest, 0.0),
        "source": (at_rest, 0.0),
    }
    for cause, (force, held) in parts.items():
        found = np.asarray(answers[cause])[columns(system, name)]
        np.testing.assert_allclose(found, force * np.array([1, 1, -1, 1]) + held, rtol=1e-10, atol=1e-10)


@pytest.mark.long
@parametrise
def test_stiffness_by_cause(system, answers, name):
    mine, found = columns(system, name), answers["stiffness"]
    alone = np.diag([1.0, 1.0, 1.0, 1.0])
    alone[2, 3] = alone[3, 2] = -1.0
    springs = -slope(lambda x: stored(name, x), X) * alone + HOLD * np.eye(4)
    close = dict(rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(found.elastic[np.ix_(mine, mine)], springs, **close)
    np.testing.assert_allclose(found.antagonistic[np.ix_(mine, mine)], 0.0, **close)
    sources = -slope(lambda x: rest(name, x, 0.0, T), X) * alone
    np.testing.assert_allclose(found.sources[np.ix_(mine, mine)], sources, **close)


@pytest.mark.long
@parametrise
def test_linear_equations(system, linear, name):
    mine = columns(system, name)
    alone = np.diag([1.0, 1.0, 1.0, 1.0])
    alone[2, 3] = alone[3, 2] = -1.0
    K = -slope(lambda x: effort(name, x, V, T), X) * alone + HOLD * np.eye(4)
    C = -slope(lambda v: effort(name, X, v, T), V) * alone
    np.testing.assert_allclose(linear.stiffness[np.ix_(mine, mine)], K, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(linear.damping[np.ix_(mine, mine)], C, rtol=1e-6, atol=1e-6)


@pytest.mark.long
@parametrise
@pytest.mark.parametrize("port", ["joint", "line", "pair", "strut"])
def test_power_in_the_bond_graph(powers, name, port):
    """What is stored runs into C, what is spent into R or out of Se; junctions pass everything on."""
    into, element, x, v = powers.ports(), f"{name} {port}", X, V
    if port == "strut":
        x, v = strut(0.3)[0], strut(0.3)[2] * 0.8
    at = "R" if name not in SOURCES else "Se"

    def power(kind):
        """Of its ports of a kind, which has parts of its own where it is made of several."""
        own = lambda port: port == f"{kind}:{element}" or port.startswith(f"{kind}:{element}.")
        return [value for port, value in into.items() if own(port)]

    assert bool(power("C")) == bool(stored(name, x))
    assert bool(power(at)) == bool(rest(name, x, v, T))
    np.testing.assert_allclose(sum(power("C")), -stored(name, x) * v, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(sum(power(at)), -rest(name, x, v, T) * v, rtol=1e-10, atol=1e-12)


@pytest.mark.long
def test_bonds_lose_nothing(powers):
    assert max(float(abs(value)) for value in junction_residual(powers).values()) < 1e-10


@pytest.mark.long
@pytest.mark.parametrize("name", ["Force", "Torque", "Wrench", "Bushing", "GeneralisedEffort"])
def test_power_of_other_laws(powers, name):
    parts = (value for port, value in powers.ports().items() if port.partition(":")[2] == f"{name} law")
    np.testing.assert_allclose(-sum(parts), OTHERS[name][2] * V, rtol=1e-12)


@pytest.mark.long
@parametrise
def test_slides_carry_what_stands_on_them(answers, name):
    """Along a slide the laws on its joint alone: what acts between points passes it by."""
    carried = {"joint": effort(name, X, V, T) + hold(X), "line": hold(X), "a": hold(0.2), "b": hold(0.2 + X)}
    for part, along in carried.items():
        found = answers["reactions"][f"{name}.{part}"].force
        np.testing.assert_allclose(found, [along, 0.0, 0.0], rtol=1e-10, atol=1e-10)


@pytest.mark.long
def test_equilibrium(few):
    """Every block stands where its law and the spring that holds it balance, at the laws' time."""
    found = mbs.equilibrium(few, state_of(few, 0.15, 0.0))
    for name in LAWS:
        joint, line, a, b = (float(found.state.coordinates[i]) for i in columns(few, name))
        alone = brentq(lambda x, name=name: effort(name, x, 0.0, T) + hold(x), 0.01, 2.0, xtol=1e-14)
        np.testing.assert_allclose([joint, line], alone, atol=1e-8)

        def apart(x, name=name):  # both blocks are pushed from home by the same
            return effort(name, x, 0.0, T) - HOLD * x / 2

        np.testing.assert_allclose(b - a, abs(brentq(apart, 0.0, 2.0, xtol=1e-14)), atol=1e-8)
        np.testing.assert_allclose((a + b) / 2, HOME, atol=1e-8)


@pytest.fixture(scope="module")
def motion(few):
    return mbs.simulate(few, state_of(few), ts=T + np.linspace(0.0, 0.25, 6))


@pytest.mark.long
@parametrise
def test_motion_is_the_same_on_joint_and_line(few, motion, name):
    joint, line, *_ = np.asarray(motion.states.coordinates)[:, columns(few, name)].T
    np.testing.assert_allclose(joint, line, atol=1e-8)
    work = motion.diagnostics.work
    np.testing.assert_allclose(work[f"{name} joint"], work[f"{name} line"], atol=1e-7)
    if name not in SOURCES:
        assert np.all(np.diff(work[f"{name} line"]) <= 1e-12)


@pytest.mark.long
def test_motion_keeps_its_account(motion):
    np.testing.assert_allclose(motion.diagnostics.energy_residual, 0.0, atol=1e-6)


@jax.jit
def mixed(numbers, system, state):
    """A sum of accelerations and stored energy with general weights, as a function of the laws' numbers."""
    laws, psi, u = numbers
    system = eqx.tree_at(lambda s: [g.law for g in s.forces], system, laws)
    state = eqx.tree_at(lambda s: (s.coordinates, s.velocities), state, (psi, u))
    a = mbs.forward_dynamics(system, state)[0]
    return jnp.cos(jnp.arange(len(a), dtype=a.dtype)) @ a + mbs.dynamics.potential_energy(system, state)


gradient_of_mixed = jax.jit(jax.grad(mixed))


@pytest.mark.long
def test_gradients_against_differences(few):
    state = state_of(few, 0.55)
    numbers = [g.law for g in few.forces], state.coordinates, state.velocities
    found = jax.tree.leaves(gradient_of_mixed(numbers, few, state))
    leaves, tree = jax.tree.flatten(numbers)
    for k, (leaf, slopes) in enumerate(zip(leaves, found, strict=True)):
        bounded = jnp.where(jnp.isfinite(leaf), leaf, 0.0)
        step = jax.random.normal(jax.random.key(k), leaf.shape) * (1.0 + jnp.abs(bounded)) * 1e-6
        ends = [mixed(jax.tree.unflatten(tree, [*leaves[:k], leaf + s, *leaves[k + 1 :]]), few, state)
                for s in (step, -step)]  # fmt: skip
        np.testing.assert_allclose(jnp.sum(slopes * step), (ends[0] - ends[1]) / 2, rtol=2e-5, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("v", [0.0, 0.3])
def test_points_that_coincide(few, v):
    """No direction, so no force between points, and every derivative is finite."""
    state = state_of(few, 0.0, v)
    numbers = [g.law for g in few.forces], state.coordinates, state.velocities
    a = np.asarray(mbs.forward_dynamics(few, state)[0])
    for name in LAWS:
        held = [hold(0.0), hold(0.2), hold(0.2)]
        np.testing.assert_allclose(M * a[columns(few, name)[1:]], held, rtol=1e-12)
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(gradient_of_mixed(numbers, few, state)))
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(mbs.stiffness(few, state)))


@pytest.mark.parametrize("name", cases(LAWS, long=["Table"]))
def test_derivatives_where_points_coincide(name):
    """Of the law itself: force and energy between points, to second order."""

    def both(law, d, v):
        return jnp.sum(law.line_force(d, v, T)) + law.line_potential(d, T)

    for derivative in (jax.grad(both, (0, 1, 2)), jax.hessian(both, (1, 2))):
        found = jax.jit(derivative)(LAWS[name], jnp.zeros(3), jnp.array([0.1, 0.2, 0.3]))
        assert all(np.isfinite(x).all() for x in jax.tree.leaves(found))


ARM, ANCHOR, MASS, INERTIA = 0.4, np.array([0.5, -0.4]), 1.5, 0.05


def arms(b):
    """For each law an arm on a pin with it as a strut from the ground to its tip; centre of mass at the tip."""
    for name, law in LAWS.items():
        b.body(f"{name}_arm", MASS, com=(ARM, 0.0, 0.0), inertia=INERTIA)
        b.joint(f"{name}.pin", mbs.Revolute("z"), "ground", f"{name}_arm")
        b.force(f"{name} strut", law, between=(("ground", (*ANCHOR, 0.0)), (f"{name}_arm", (ARM, 0.0, 0.0))))


def strut(q):
    """Length of the strut, its unit vector to the tip, and its lever dl/dq."""
    d = ARM * np.array([np.cos(q), np.sin(q)]) - ANCHOR
    n = d / np.linalg.norm(d)
    return np.linalg.norm(d), n, ARM * n @ np.array([-np.sin(q), np.cos(q)])


@pytest.mark.long
@parametrise
def test_struts_by_virtual_power(system, answers, name):
    """`I q'' = F dl/dq`; the pin carries what the strut leaves of the mass's acceleration."""
    shares = answers["stiffness"]
    q, rate, i = 0.3, 0.8, column(system, f"{name}.pin")
    length, n, arm = strut(q)
    force = effort(name, length, arm * rate, T)
    q_ddot = force * arm / (INERTIA + MASS * ARM**2)
    np.testing.assert_allclose(answers["accelerations"][i], q_ddot, rtol=1e-8)
    along, across = np.array([np.cos(q), np.sin(q)]), np.array([-np.sin(q), np.cos(q)])
    pull = MASS * ARM * (q_ddot * across - rate**2 * along) - force * n
    np.testing.assert_allclose(
        np.abs(answers["reactions"][f"{name}.pin"].force), [*np.abs(pull), 0.0], rtol=1e-7, atol=1e-9
    )

    def generalised_forces(q):
        length, _, arm = strut(q)
        return effort(name, length, 0.0, T) * arm

    K = (shares.elastic + shares.antagonistic + shares.sources)[i, i]
    np.testing.assert_allclose(K, -slope(generalised_forces, q), rtol=1e-7, atol=1e-6)
    curvature = -slope(lambda x: stored(name, x), length)
    np.testing.assert_allclose(shares.elastic[i, i], curvature * arm**2, rtol=1e-7, atol=1e-7)


def wind(rotation, position, angular_velocity, velocity, t):
    return -3.0 * velocity, jnp.zeros(3)


def push(coordinates, velocities, t):
    return jnp.zeros_like(velocities).at[-1].set(5.0 * t)  # its block is the last


OTHERS = {  # law, ports, effort on its coordinate at X, V, T, share of it that is stored
    "Force": (F.Force((4.0, 7.0, 0.0)), {"on": "block"}, 4.0, 0.0),
    "Torque": (F.Torque((0.1, 0.2, 1.5)), {"on": "block"}, 1.5, 0.0),
    "Wrench": (F.Wrench(wind), {"on": "block"}, -3.0 * V, 0.0),
    "Bushing": (F.Bushing((50.0, 9.0), (2.0, 0.0)), {"between": ("ground", "block")}, -50.0 * X - 2.0 * V, 50.0),
    "GeneralisedEffort": (F.GeneralisedEffort(push), {}, 5.0 * T, 0.0),
}


def others(b):
    """One freedom for each, a slide or, for the torque, a pin."""
    for name, (law, port, *_) in OTHERS.items():
        b.body(name, M, inertia=M)
        b.joint(f"{name}.free", mbs.Revolute("z") if name == "Torque" else mbs.Prismatic("x"), "ground", name)
        where = {key: name if value == "block" else ("ground", name) for key, value in port.items()}
        b.force(f"{name} law", law, **where)


@pytest.mark.long
@pytest.mark.parametrize("name", OTHERS)
def test_other_laws(system, answers, name):
    *_, force, stiffness = OTHERS[name]
    i = column(system, f"{name}.free")
    np.testing.assert_allclose(M * answers["accelerations"][i], force, rtol=1e-12)
    np.testing.assert_allclose(answers["stiffness"].elastic[i, i], stiffness, atol=1e-12)


@pytest.mark.parametrize("angle", [pytest.param(0.0, marks=pytest.mark.long), 0.3, 2.0])
def test_what_a_bushing_stores_is_its_wrench_at_rest(angle):
    """The wrench and its slope, of which the elastic share of the stiffness is made."""
    law = F.Bushing(np.array([60.0, 70.0, 80.0, 3.0, 4.0, 5.0]), (2.0, 1.0), preload=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3))
    c, s, rest = np.cos(angle), np.sin(angle), jnp.zeros(3)
    R, d = jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), jnp.array([0.1, -0.2, 0.3])
    spin = jnp.array([[0.0, -0.4, 0.2], [0.4, 0.0, -0.1], [-0.2, 0.1, 0.0]]) @ R
    stored = lambda R, d: PosePort().stored_effort(law, (R, d), jnp.zeros(6), T)
    found, wanted = (
        jax.jit(lambda *moved, wrench=wrench: jax.jvp(wrench, (R, d), moved))(spin, jnp.array([0.3, 0.1, -0.2]))
        for wrench in (stored, lambda R, d: jnp.concatenate(law.wrench(R, d, rest, rest, T)[::-1]))
    )
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-12)


REFUSED = [
    (F.BumpStop(1.0, lower=-0.1, upper=0.2), "line", "BumpStop between two points: lower is a distance"),
    (F.BumpStop(1.0, upper=-0.2), "line", "BumpStop between two points: upper is a distance"),
    (F.PD(-0.1, kp=1.0), "line", "PD between two points: target is a distance"),
    (F.Table([-0.2, -0.1], [1.0, 2.0]), "line", "Table between two points: x_points are distances"),
    *((law, "same", "both frames are on 'block', so their distance is constant") for law in LAWS.values()),
    (F.Bushing((1.0, 1.0)), "same", "both frames are on 'block'"),
    *((law, "ball", "joint 'ball' does not have exactly one coordinate") for law in LAWS.values()),
    *((law, "on", f"{type(law).__name__} takes between=... or joint=..., got on") for law in LAWS.values()),
    (F.Bushing((1.0, 1.0)), "joint", "Bushing takes between=..., got joint"),
    (F.Force((1.0, 0.0, 0.0)), "joint", "Force takes on=..., got joint"),
    (F.GeneralisedEffort(push), "line", "GeneralisedEffort takes no port, got between"),
]
PORTS = {
    "line": {"between": ("ground", "block")},
    "same": {"between": ("block", ("block", (0.1, 0.0, 0.0)))},
    "joint": {"joint": "slide"},
    "ball": {"joint": "ball"},
    "on": {"on": "block"},
}


@pytest.mark.parametrize("law, port, message", REFUSED)
def test_what_has_no_meaning_is_refused(law, port, message):
    b = mbs.SystemBuilder()
    b.body("block", M)
    b.body("bob", M, inertia=0.1)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    b.joint("ball", mbs.Spherical(), "block", "bob")
    b.force("strut", law, **PORTS[port])
    with pytest.raises(mbs.ModelError, match="force 'strut': " + message.replace("(", r"\(")):
        b.build()


def test_edges_on_a_joint_may_be_negative():
    b = mbs.SystemBuilder()
    b.body("block", M)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    for i, law in enumerate((F.BumpStop(1.0, lower=-0.2, upper=-0.1), F.PD(-0.1, kp=1.0), F.Table([-2, -1], [1, 2]))):
        b.force(f"law {i}", law, joint="slide")
    assert b.faults() == []
