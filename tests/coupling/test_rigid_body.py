"""Rigid bodies with several points among components: closed forms, levers, a dense model with multipliers, misuse."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import RigidBody, bushing, connect, hinge, rigid_bond
from jaxmbs.errors import ModelError, UnknownNameError
from jaxmbs.reductions import rotate
from tests.coupling.test_network import AXES, PARTS

A, B, MASS, WEIGHT = 0.4, 0.3, 120.0, 120.0 * 9.81
INERTIA = np.diag([4.0, 7.0, 9.0])
FEET = {f"foot{k}": (x, y, 0.0) for k, (x, y) in enumerate(((A, B), (-A, B), (-A, -B), (A, -B)), 1)}
MOUNT = np.array([2e5, 3e5, 8e5])


def on_four_mounts(com=(0.0, 0.0, 0.0), feet=FEET, mass=MASS, inertia=INERTIA):
    block = RigidBody(mass=mass, com=com, inertia=inertia, points=feet)
    ends = {f"mount{k}": [(f"foot{k}", d) for d in "xyz"] for k in range(1, 5)}
    bonds = {name: bushing(("block", end), stiffness=MOUNT, damping=1e-4 * MOUNT) for name, end in ends.items()}
    return connect({"block": block}, bonds)


@pytest.mark.long
def test_modes_of_a_block_on_four_mounts():
    """Feet in the plane of the centre: bounce `4 k/m`, roll `4 k_z b^2/I_x`, yaw `4 (k_x b^2 + k_y a^2)/I_z`."""
    kx, ky, kz = MOUNT
    exact = 4 * np.array(
        [
            *(MOUNT / MASS),
            kz * B**2 / INERTIA[0, 0],
            kz * A**2 / INERTIA[1, 1],
            (kx * B**2 + ky * A**2) / INERTIA[2, 2],
        ]
    )
    net = on_four_mounts()
    assert net.num_rows == 6 and net.label(2) == "block.com z"
    damped = mbs.modes(net)
    np.testing.assert_allclose(np.sort(damped.omega**2)[::2], np.sort(exact), rtol=1e-9)
    np.testing.assert_allclose(np.sort(damped.damping_ratios)[::2], np.sort(0.5e-4 * np.sqrt(exact)), rtol=1e-6)
    report = mbs.check(on_four_mounts(com=(0.1, 0.0, 0.2)))
    np.testing.assert_allclose(report.centre, [0.1, 0.0, 0.2], atol=1e-9)
    np.testing.assert_allclose(report.central_inertia, INERTIA, atol=1e-9)


@jax.jit
def shares(com, feet):
    """Loads that the four mounts put on the block, its weight hanging at the centre of mass."""
    net = on_four_mounts(com, feet)
    found = mbs.reactions(net, mbs.equilibrium(net, {"block.com z": -WEIGHT}))
    return jnp.stack([found[f"mount{k}"].on_first[2] for k in range(1, 5)]), found.ok


@pytest.mark.long
def test_the_weight_is_shared_by_levers():
    """Four equal springs: `W/4 (1 + x c_x/a^2 + y c_y/b^2)`; its slopes by the centre of mass and by the feet."""
    x, y = np.array(list(FEET.values())).T[:2]
    com = jnp.array([0.11, -0.07, 0.0])
    loads, ok = shares(com, FEET)
    assert ok
    np.testing.assert_allclose(loads, WEIGHT / 4 * (1 + x * com[0] / A**2 + y * com[1] / B**2), rtol=1e-9)
    slopes = jax.jacfwd(lambda c: shares(c, FEET)[0])(com)
    np.testing.assert_allclose(slopes[:, 0], WEIGHT / 4 * x / A**2, rtol=1e-9)
    np.testing.assert_allclose(slopes[:, 1], WEIGHT / 4 * y / B**2, rtol=1e-9)
    feet = {name: jnp.asarray(place, float) for name, place in FEET.items()}
    slope = jax.grad(lambda f: jnp.sum(shares(com, f)[0] ** 2))(feet)["foot2"][0]
    moved = [sum(shares(com, {**feet, "foot2": feet["foot2"].at[0].add(h)})[0] ** 2) for h in (1e-4, -1e-4)]
    np.testing.assert_allclose(slope, (moved[0] - moved[1]) / 2e-4, rtol=1e-6)


@pytest.mark.long
def test_modes_by_mass_inertia_and_centre():
    """The slope of all squares of frequencies together, against differences."""

    def total(p):
        spin = jnp.diag(jnp.stack([p[1], 7.0, 9.0]))
        net = on_four_mounts(jnp.stack([p[2], 0.05, p[3]]), FEET, p[0], spin)
        return jnp.sum(jnp.log(mbs.vibration.natural_modes(K=net.stiffness, M=net.mass).values))

    p = jnp.array([MASS, 4.0, 0.1, 0.15])
    slope = jax.jit(jax.grad(total))(p)
    for k in (0, 1, 2, 3):
        h = 1e-5 * jnp.eye(4)[k]
        np.testing.assert_allclose(slope[k], (total(p + h) - total(p - h)) / 2e-5, rtol=1e-4, atol=1e-7)


@pytest.mark.long
def test_a_dropped_block_swings_on_its_mounts():
    """Its own weight from rest: `z = -(m g / 4 k) (1 - cos w t)`; what a mount bears then is `-k z`."""
    block = RigidBody(mass=MASS, inertia=INERTIA, points=FEET)
    bonds = {f"mount{k}": bushing(f"block.foot{k} z", stiffness=[MOUNT[2]]) for k in range(1, 5)}
    bonds["guide"] = hinge("block.foot1", free="z rx ry rz")
    with pytest.raises(ValueError, match="singular"):  # yaw is free
        mbs.equilibrium(connect({"block": block}, bonds), {"block.com z": -WEIGHT, "block.com rz": 1.0})
    omega = np.sqrt(4 * MOUNT[2] / MASS)
    ts = np.linspace(0.0, 2.0 / omega, 5)
    net = connect({"block": block}, bonds)
    motion = mbs.simulate(net, ts=ts, forces={"block.com z": np.full(5, -WEIGHT)}, rtol=1e-9, atol=1e-12)
    z = -WEIGHT / (4 * MOUNT[2]) * (1 - np.cos(omega * ts))
    np.testing.assert_allclose(
        net.expand(motion.displacement)["block"][:, [2, 8, 14]], z[:, None] * [1, 1, 1], atol=1e-9
    )
    loads = mbs.reactions(net, motion)
    assert loads.ok
    np.testing.assert_allclose(loads["mount3"].force[:, 2], -MOUNT[2] * z, atol=1e-6 * WEIGHT)


HINGE = {"left": (0.2, 0.5, 0.1), "right": (0.2, -0.5, 0.1), "strut": (1.2, 0.0, 0.1)}


def hinged(com, points):
    """A flap on a hinge of two bearings along y, its end on a spring: statics determines every load."""
    flap = RigidBody(mass=MASS, com=com, inertia=INERTIA, points=points)
    bonds = {
        "bearing": hinge("flap.left", free="rx ry rz"),
        "guide": hinge("flap.right", free="y rx ry rz"),
        "spring": bushing("flap.strut z", stiffness=[5e4]),
    }
    return connect({"flap": flap}, bonds)


def answers(com, points):
    net = hinged(com, points)
    loads = mbs.reactions(net, mbs.equilibrium(net, {"flap.com z": -WEIGHT}))
    values = mbs.vibration.natural_modes(K=net.stiffness, M=net.mass).values
    return jnp.stack([values[0], *(loads[name].on_first[..., -1 if name == "spring" else 2] for name in loads)])


@pytest.mark.long
def test_a_flap_on_two_bearings_and_a_spring():
    """`w^2 = k l^2 / (I_y + m d^2)`; loads by levers; known and traced places, and slopes by them."""
    com = np.array([0.7, 0.1, 0.2])
    spring = WEIGHT * (com[0] - 0.2) / 1.0
    left = (WEIGHT * com[1] / 0.5 + WEIGHT - spring) / 2
    swing = 5e4 / (INERTIA[1, 1] + MASS * ((com[0] - 0.2) ** 2 + 0.01))
    exact = [swing, left, WEIGHT - spring - left, spring]
    net = hinged(com, HINGE)
    assert net.num_rows == 1 and net.label(0).startswith("flap.com ")
    np.testing.assert_allclose(answers(com, HINGE), exact, rtol=1e-9)
    points = {name: jnp.asarray(place) for name, place in HINGE.items()}
    traced = jax.jit(answers)
    np.testing.assert_allclose(traced(com, points), exact, rtol=1e-9)
    slopes = jax.jit(jax.jacrev(answers))(com, points)
    difference = (traced(com + [1e-5, 0, 0], points) - traced(com - [1e-5, 0, 0], points)) / 2e-5
    np.testing.assert_allclose(slopes[:, 0], difference, rtol=1e-6)
    many = jax.jit(jax.vmap(answers, (0, None)))(np.stack([com, com + 0.1]), points)
    np.testing.assert_allclose(many[0], exact, rtol=1e-9)
    report = net.determinacy()
    assert report.redundant == 0 and report.free_motions == 0


@pytest.mark.long
def test_traced_bonds_that_hold_twice_give_no_number():
    """What is refused where places are known is NaN where they are traced."""
    bonds = {"a": hinge("flap.left", free="rx ry rz"), "b": rigid_bond("flap.right y")}
    with pytest.raises(ModelError, match="bond 'b': other rigid bonds constrain its rigid body already in y"):
        connect({"flap": RigidBody(mass=1.0, points=HINGE)}, bonds)

    @jax.jit
    def mass(points):
        return connect({"flap": RigidBody(mass=1.0, points=points)}, bonds).mass

    points = {name: jnp.asarray(place) for name, place in HINGE.items()}
    assert np.all(np.isnan(mass(points)))

    @jax.jit
    def held(points):
        """Six rows that leave one motion of the flap, beside what can move."""
        parts = {"flap": RigidBody(mass=1.0, points=points), "other": RigidBody(mass=1.0, points={"a": (0, 0, 0)})}
        own = {"a": hinge("flap.left", free="rx ry rz"), "b": hinge("flap.right", free="rx ry rz")}
        return connect(parts, own | {"spring": bushing("other.a x", stiffness=[1.0])}).mass

    assert np.all(np.isnan(held(points)))


POINTS = {"knee": (0.1, 0, 0.4), "top": (0, 0.1, 0.8), "lug": (0, 0.1, 0.8), "arm": (0.3, 0.2, 0.9)}
BOX = {"mass": 0.8, "com": (0.2, 0.1, 0.6), "inertia": np.diag([3e-3, 4e-3, 5e-3])}
CAN = {"mass": 0.3, "com": (0.4, 0.3, 1.0), "inertia": 1e-3}
SOFT = np.diag([3e5, 4e5, 5e5, 90.0, 80.0, 70.0])
OMEGA = 200.0
PUSH = np.random.default_rng(3).normal(size=(3, 6))


def assembled():
    """A box bolted to two nodes of a stage, a can on its hinge, a mast on a bushing and a ball joint."""
    parts = {
        "stage": PARTS["stage"],
        "mast": PARTS["mast"],
        "box": RigidBody(points=POINTS, **BOX),
        "can": RigidBody(points={"ear": POINTS["arm"]}, **CAN),
    }
    bonds = {
        "bolts": rigid_bond("stage.foot"),
        "upper": rigid_bond("box.top", "stage.top"),
        "lower": rigid_bond("stage.knee", "box.knee"),
        "hinge": hinge("can.ear", "box.arm", free="ry", axes=AXES),
        "mount": bushing("box.lug", "mast.root", stiffness=SOFT, axes=AXES),
        "stay": hinge("mast.end", free="rx ry rz"),
    }
    return connect(parts, bonds)


def motion_of(point, com):
    """[E, -r~; 0, E] with r from the centre of mass."""
    x, y, z = np.subtract(point, com)
    return np.block([[np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])], [np.zeros((3, 3)), np.eye(3)]])


def dense_model():
    """Amplitudes of stage, mast, box, can and the bonds' forces on their first ends: multipliers, NumPy."""
    stage, mast, box, can = (slice(0, 18), slice(18, 36), slice(36, 42), slice(42, 48))
    turn, rows = np.kron(np.eye(2), AXES), []
    Z = np.zeros((48, 48))
    for at, s in ((stage, PARTS["stage"]), (mast, PARTS["mast"])):
        Z[at, at] = np.asarray(s.stiffness) - OMEGA**2 * np.asarray(s.mass)
    for at, body in ((box, BOX), (can, CAN)):
        spin = body["inertia"] * np.eye(3)
        Z[at, at] = -(OMEGA**2) * np.block([[body["mass"] * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), spin]])

    def at(part, matrix):
        wide = np.zeros((6, 48))
        wide[:, part] = matrix
        return wide

    def node(part, number):
        return at(slice(part.start + 6 * number, part.start + 6 * number + 6), np.eye(6))

    W = {name: at(box, motion_of(place, BOX["com"])) for name, place in POINTS.items()}
    stretch = turn @ (W["lug"] - node(mast, 0))
    Z += stretch.T @ SOFT @ stretch
    rows = [
        node(stage, 0),
        W["top"] - node(stage, 2),
        node(stage, 1) - W["knee"],
        (turn @ (at(can, motion_of(POINTS["arm"], CAN["com"])) - W["arm"]))[[0, 1, 2, 3, 5]],
        node(mast, 2)[:3],
    ]
    rows = np.concatenate(rows)
    right = np.zeros(48 + len(rows))
    right[can] += PUSH[0]
    right[:48] += W["arm"].T @ PUSH[1] + node(mast, 1).T @ PUSH[2]
    x = np.linalg.solve(np.block([[Z, rows.T], [rows, np.zeros((len(rows), len(rows)))]]), right)
    f = -x[48:]
    forces = {"bolts": f[:6], "upper": f[6:12], "lower": f[12:18], "hinge": np.insert(f[18:23], 4, 0.0)}
    forces |= {"stay": np.r_[f[23:], np.zeros(3)], "mount": -SOFT @ stretch @ x[:48]}
    moved = {"stage": x[stage], "mast": x[mast], "box": np.r_[x[box], *(W[p] @ x[:48] for p in POINTS)]}
    return moved, forces


@pytest.mark.long
def test_every_bond_of_rigid_bodies_against_a_dense_model():
    """Bolted, hinged about a turned axis and on a bushing, harmonically shaken; with known and with traced places."""
    push = {"can.com": PUSH[:1], "box.arm": PUSH[1:2], "mast.middle": PUSH[2:]}

    def shaken(net):
        response = mbs.vibration.harmonic_response(net, jnp.array([OMEGA]), push)
        return net.expand(response.displacement), mbs.reactions(net, response)

    net = assembled()
    moved, forces = dense_model()
    for found, loads in (shaken(net), jax.jit(lambda: shaken(assembled()))()):
        assert loads.ok
        for name, x in moved.items():
            np.testing.assert_allclose(found[name][0], x, atol=1e-8 * np.max(np.abs(x)), err_msg=name)
        for name, f in forces.items():
            np.testing.assert_allclose(loads[name].on_first[0], f, atol=1e-7 * np.max(np.abs(f)), err_msg=name)
            np.testing.assert_allclose(loads[name].on_second, -loads[name].on_first)
    H = mbs.frequency_response(net, [OMEGA], into=["can.com x"], out=["box.arm z"]).values
    rows, labels = net.outputs("box.arm z")
    unit = mbs.vibration.harmonic_response(net, [OMEGA], {"can.com x": 1.0})
    np.testing.assert_allclose(H[:, 0, 0], np.asarray(unit.displacement) @ np.asarray(rows[0]), rtol=1e-9)
    assert labels == ("box.arm z",)
    report = net.determinacy()
    assert report.redundant == 9 and report.free_motions == 1
    assert all(report.determinate["hinge"]) and not any(report.determinate["upper"])
    assert "com" in repr(RigidBody(points=POINTS, **BOX)) and "box" in repr(net)


@pytest.mark.long
def test_the_block_of_a_mechanism():
    """The same block on the same bushings in a `SystemBuilder`, its centre off the middle."""
    com, feet = (0.1, -0.05, 0.2), {**FEET, "foot1": (A, B, 0.1)}
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("block", mass=MASS, com=com, inertia=INERTIA)
    b.joint("free", mbs.Free(), "ground", "block")
    for name, place in feet.items():
        law = mbs.Bushing([*MOUNT, 0.0, 0.0, 0.0])
        b.force(name, law, between=(("ground", place), ("block", place)))
    system = b.build()
    found = mbs.modes(system, mbs.State.at(system)).omega
    bonds = {name: bushing(("block", [(name, d) for d in "xyz"]), stiffness=MOUNT) for name in feet}
    net = connect({"block": RigidBody(mass=MASS, com=com, inertia=INERTIA, points=feet)}, bonds)
    np.testing.assert_allclose(mbs.modes(net).omega, np.sort(found)[::2], rtol=1e-8)


@pytest.mark.long
def test_turned_and_moved_bodies():
    """A block turned or moved with its mounts has the same frequencies; its points turn with it."""
    block = RigidBody(mass=MASS, com=(0.1, 0.0, 0.2), inertia=INERTIA, points=FEET)
    mounts = {name: bushing(("block", [(name, d) for d in "xyz"]), stiffness=[2e5] * 3) for name in FEET}
    exact = mbs.modes(connect({"block": block}, mounts)).omega
    for other in (rotate(block, AXES), block.translate((1.0, 2.0, 3.0))):
        np.testing.assert_allclose(mbs.modes(connect({"block": other}, mounts)).omega, exact, rtol=1e-9)
    np.testing.assert_allclose(rotate(block, AXES).outputs("foot1 z")[0][0, :3], [0, 0, 1], atol=1e-12)


@pytest.mark.long
def test_a_rigid_body_beside_measured_components():
    """A stage known by transfer functions at its nodes, a box on two of them."""
    omega = np.array([50.0, 200.0])
    nodes = ["top", "knee"]
    clamped = connect({"own": PARTS["stage"]}, {"clamp": rigid_bond("own.foot")})
    own = mbs.frequency_response(clamped, omega, into=[f"own.{n}" for n in nodes], out=[f"own.{n}" for n in nodes])
    labels = [label.partition(".")[2] for label in own.outputs]
    stage = mbs.linear.TransferFunctions(omega, own.values, labels, labels)
    box = RigidBody(points=POINTS, **BOX)
    bolts = {"upper": rigid_bond("stage.top", "box.top"), "lower": rigid_bond("stage.knee", "box.knee")}
    net = connect({"stage": stage, "box": box}, bolts)
    model = connect({"stage": PARTS["stage"], "box": box}, bolts | {"clamp": rigid_bond("stage.foot")})
    asked = {"into": ["box.arm x"], "out": ["stage.knee y", "box.com z"]}
    found, exact = (mbs.frequency_response(one, omega, **asked).values for one in (net, model))
    np.testing.assert_allclose(found, exact, rtol=1e-6)


@pytest.mark.long
def test_two_welded_bodies_share_a_push_by_mass():
    """Inertia relief of what has no stiffness at all; their mass, centre and inertia together."""
    parts = {
        "one": RigidBody(mass=1.0, inertia=0.1, points={"face": (1.0, 0.0, 0.0)}),
        "two": RigidBody(mass=2.0, com=(1.5, 0.0, 0.0), inertia=0.2, points={"face": (1.0, 0.0, 0.0)}),
    }
    net = connect(parts, {"weld": rigid_bond("one.face", "two.face")})
    report = mbs.check(net)
    np.testing.assert_allclose(report.centre, [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.diag(report.central_inertia), [0.3, 1.8, 1.8], rtol=1e-12)
    loads = mbs.reactions(net, mbs.equilibrium(net, {"one.com x": 3.0}, free=True))
    np.testing.assert_allclose(loads["weld"].on_first, [-2.0, 0, 0, 0, 0, 0], atol=1e-12)
    assert loads.ok and mbs.modes(net).num_rigid == 6


def test_a_rigid_link_without_mass():
    """A mass beyond a lever on two springs: `1/k = (1 + s)^2 / k_1 + s^2 / k_2`, s the overhang over the arm."""
    arm, overhang, k, m = 0.5, 0.3, np.array([4e4, 7e4]), 3.0
    points = {"near": (arm, 0, 0), "far": (0, 0, 0), "end": (arm + overhang, 0, 0)}

    @jax.jit
    def squares(m):
        parts = {
            "lever": RigidBody(mass=0.0, points=points),
            "mass": RigidBody(mass=m, com=points["end"], points={"own": points["end"]}),
        }
        bonds = {
            "one": bushing("lever.near z", stiffness=k[:1]),
            "two": bushing("lever.far z", stiffness=k[1:]),
            "rail": bushing(("lever", [("far", d) for d in ("x", "y", "rx", "rz")]), stiffness=[1e4] * 4),
            "pin": bushing("lever.end", "mass.own", stiffness=[1e9] * 3 + [1.0] * 3),
        }
        net = connect(parts, bonds)
        return mbs.modes(net).omega ** 2, net.mass

    s = overhang / arm
    found, mass = squares(m)
    assert mass.shape == (12, 12)
    stiffness = 1 / ((1 + s) ** 2 / k[0] + s**2 / k[1] + 1e-9)
    assert np.min(np.abs(found / (stiffness / m) - 1)) < 1e-6


BODY = RigidBody(mass=1.0, points={"a": (0, 0, 0), "b": (1, 0, 0), "c": (0, 1, 0)})
FAULTS = {
    "no node": ({"m": rigid_bond("box.d")}, "bond 'm': interface of 'box': there is no coordinate or node 'd'"),
    "centre": (
        {"m": rigid_bond("box.com z")},
        "bond 'm': interface of 'box': there is no coordinate or node 'com z'",
    ),
    "twice": (
        {"m": rigid_bond("box.a"), "n": rigid_bond("box.b")},
        "bond 'n': other rigid bonds constrain its rigid body already in x",
    ),
    "all": ({"m": rigid_bond("box.a")}, "the bonds constrain every component completely, no motion is left"),
    "apart": ({"m": rigid_bond("box.b", "other.a")}, "box.b and other.a are 1 m apart"),
    "in line": (
        {"m": hinge("box.a", free="rx ry rz"), "n": hinge("box.b", free="y z rx ry rz")},
        "bond 'n': other rigid bonds constrain its rigid body already in x",
    ),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_bonds_that_cannot_be(kind):
    bonds, said = FAULTS[kind]
    parts = {"box": BODY, "other": BODY} if kind == "apart" else {"box": BODY}
    with pytest.raises(ModelError) as error:
        connect(parts, bonds)
    assert said in str(error.value)


def test_bodies_that_cannot_be():
    """All faults in one report; names of points that are not there."""
    with pytest.raises(ModelError) as error:
        RigidBody(
            mass=-1.0,
            inertia=(1.0, 1.0, 9.0),
            points={"com": (0, 0, 0), "b": (1.0, 2.0), "c": (np.nan, 0, 0), "d": (0, "x", 0), 3: (0, 0, 0)},
        )
    told = str(error.value)
    for said in (
        "mass is -1.0",
        "break A + B >= C",
        "cannot be called 'com'",
        "point 'b' must be three numbers",
        "point 'c' must be three finite numbers",
        "point 'd' must be three finite numbers",
        "must be a string, not 3",
    ):
        assert said in told
    with pytest.raises(ModelError, match="points must be places by name"):
        RigidBody(mass=1.0, points={})
    with pytest.raises(UnknownNameError, match="'a y'"):
        BODY.outputs("a yy")
