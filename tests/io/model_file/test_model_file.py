"""Model files: every class of the library and random systems come back bit by bit; what has no name is refused."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import jsonschema
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import jaxmbs as mbs
from jaxmbs import blocks, elements, fem, forces, joints, linear, reductions
from jaxmbs.builder._assemble_system import assemble_system
from jaxmbs.builder._build import _cut_loops
from tests import random_systems as rs
from tests.elements.test_elements import CASES
from tests.forces import test_applied as test_loads
from tests.forces import test_forces as test_scalar_laws
from tests.forces import test_signals
from tests.joints.test_joints import EXAMPLES
from tests.reductions.test_reductions import REDUCTIONS

LAMINATE = elements.Laminate(
    [1e-3, 2e-3],
    [0.1, -0.7],
    [elements.orthotropic(8.0, 2.0, 0.25, 1.0)] * 2,
    [np.eye(2)] * 2,
    [0.5, 1.0],
    bottom=1 / 3,
)


def gearing(a, b):
    return a - 2.0 * b * b


def rolled(psi, u, t):
    return u[:1]


MORE = {
    "laminate": LAMINATE,
    "section of a laminate": LAMINATE.section(),
    "distance": mbs.joints.Distance(0.1 + 0.2),
    "plane": mbs.joints.PointOnPlane(),
    "line": mbs.joints.PointOnLine(),
    "sphere": mbs.joints.RollingSphere(1 / 3),
    "disk": mbs.joints.RollingDisk(0.2, "x"),
    "knife": mbs.joints.KnifeEdge("y"),
    "tool": mbs.joints.FramePath(mbs.forces.Spline([0.0, 1.0, 2.0], np.eye(3)), (0.0, 0.0, 0.1), ("x", "y", "rz")),
    "coupler": mbs.Coupler({"a": 1.0, "b": -0.7}, 0.1),
    "cam": mbs.Coupler({"a": 1.0, "b": 0.0}, function=gearing),
    "rows": mbs.joints.PositionRows(gearing),
    "slips": mbs.joints.VelocityRows(rolled),
    "partial": mbs.Actuator(jax.tree_util.Partial(test_scalar_laws.torque_curve, jnp.array(2.0))),
    "cyclic": reductions.Cyclic(12, 2, {"left": "right"}),
    "mirror": reductions.Mirror("x"),
    "physical": reductions.Unreduced(),
    "characteristic": reductions.Characteristic(4),
    "limit": mbs.Limit("bearing", "load", upper=np.array([4e3, np.inf])),
    "bushing": mbs.Bushing((3.0, 20.0), np.arange(6.0), np.ones(6) / 3),
    "piece of a beam": mbs.forces.BeamElement(np.diag(np.arange(1.0, 7.0)), [0.3, 0, 0, 0, 0, 0.1], 0.01),
    "section": mbs.forces.BeamSection(np.arange(1.0, 7.0), 2.0, [0.3, 0.1, 0.2]),
    "effort": mbs.forces.GeneralisedEffort(gearing),
    "controller": blocks.PID(
        2.0, 0.1 + 0.2, target=mbs.Harmonic(1.0, 0.5, 3.0), limit=(-1.0, 2.0), tracking=0.3, kd=0.1, filter=0.05
    ),
    "integral": blocks.PI(2.0, 1 / 3, 0.1),
    "lag": blocks.FirstOrder(1 / 3, 2.0),
    "filter": blocks.TransferFunction([1.0, 0.0], [1 / 3, 1.0]),
    "space": blocks.StateSpace(-np.eye(2) / 3, np.ones((2, 1)), np.ones((1, 2)), np.zeros((1, 1))),
    "delay": blocks.Delay(1 / 3, pade=4),
    "mixer": blocks.Function(gearing),
    "clip": blocks.Saturation(-np.inf, 1 / 3),
    "curve": blocks.LookUp([0.0, 1 / 3, 2.0], [0.0, 1.0, 5.0]),
    "ramp limit": blocks.RateLimit(1 / 3, 2.0, 0.02),
    "move": mbs.forces.Trapezoid(0.3, 1 / 3, 2.0, 0.1 + 0.2),
    "rise": mbs.forces.CamRise(0.3, 1 / 3, "modified sine"),
    "chirp": mbs.forces.Chirp(1.0, 2.0, 1 / 3, is_logarithmic=True),
    "sines": mbs.forces.Multisine([1.0, 1 / 3], 0.1 + 0.2),
    "maxwell": mbs.forces.Maxwell(40.0, 0.1 + 0.2),
    "zener": mbs.forces.Zener(40.0, 0.3, 7.0, 0.1),
    "rubber": mbs.forces.Prony(3.0, [40.0, 2.0], [0.1 + 0.2, 5.0], 0.1),
    "mount of rubber": mbs.forces.PronyBushing(np.arange(1.0, 7.0), np.ones((2, 6)), [0.3, 5.0]),
    "bristles": mbs.forces.FrictionForce(mbs.friction.LuGre(1.0, 1e5, 300.0, 0.4, 1.5)),
    "pin friction": mbs.friction.SmoothCoulomb(1 / 3),
    "drawer friction": mbs.friction.BrownMcPhee(0.3, 0.4),
    "bearing": mbs.friction.BearingFriction(0.3, viscous=1 / 3, seal=0.1),
    "joint bristles": mbs.friction.LuGre(0.3, 1e5, 1 / 3, 0.1),
    "yielding": mbs.forces.ElastoPlastic(1e4, 200.0, 0.05, 3.0, 0.1),
    "motor": mbs.forces.Motor(mbs.Ramp(0.0, 3.0), 1.5, 0.05, 0.3, ratio=2.0),
    "jack": mbs.forces.HydraulicCylinder((4e-3, 3e-3), (1e-3, 2e-3), 1.5e9, 0.5, 2e-6, 2e7, varying=True),
    "gas": mbs.forces.AirSpring(2e-3, 6e5, 0.15, length=0.4),
    "orifice": mbs.hydraulics.Orifice(2e-6, 0.6, 850.0, 5e3),
    "valve": mbs.hydraulics.Valve([1e-3, 2e-3, 1e-3, 2e-3], 3.5e6, 0.1 / 3),
    "relief valve": mbs.hydraulics.ReliefValve(1e7, 1e-9),
    "check valve": mbs.hydraulics.CheckValve(1e-3, 5e5, 1e5),
    "pump": mbs.hydraulics.Pump(1e-5, 1e-12),
    "oil line": mbs.hydraulics.Line(2.0, 0.012, loss=1.5),
    "volume": mbs.hydraulics.Volume(1e-3, pressure=1e6),
    "accumulator": mbs.hydraulics.Accumulator(2e-3, 5e6, 1.2),
    "tank": mbs.hydraulics.Tank(1e5),
    "cable": mbs.forces.Cable(
        *(("point", "sheave", "point"), [0.1], [[0.0, 0.6, 0.8]], (0, 2, 0)),
        **{"axial_stiffness": 3e5, "free_length": mbs.Ramp(1.0, 0.1), "friction": [0.1, 0.2, 0.3], "slack": False},
    ),
    "rope": mbs.forces.InextensibleCable(
        ("point", "sheave", "point"), [0.1], [[0.0, 0.6, 0.8]], (1,), free_length=0.3
    ),
    "tendon": mbs.forces.PathForce(
        *(("point", "point"), np.zeros(0), np.zeros((0, 3)), np.zeros(0)), law=mbs.forces.Maxwell(40.0, 3.0)
    ),
    "curved": mbs.forces.PolynomialSpring([40.0, 0.1 / 3], [0.5], 0.2, 0.3),
    "cones": mbs.forces.BevelGear((20, 60), 2e-3, 0.35, 1e8, 1e3, 1e-5),
    "worm": mbs.forces.WormGear(2, 30, 2e-3, 0.1 / 3, True, 0.35, 0.1, 1e-2, 1e8, 1e3, 1e-5),
    "gears": mbs.forces.GearPair((20, 60), 2e-3, 0.35, 0.1, True, 1e8, 1e3, 1e-5),
    "pose": mbs.Pose((1.0, 2.0, 3.0)),
    "touch": mbs.contact.Contact(
        mbs.contact.SphereOnPlane(0.1 + 0.2),
        mbs.contact.HuntCrossley(2e8),
        mbs.friction.SmoothCoulomb(0.3),
        wear=1e-14,
    ),
    "touch of bristles": mbs.contact.Contact(
        mbs.contact.SphereOnPlane(0.3), mbs.contact.HuntCrossley(2e8), mbs.friction.LuGre(0.3, 1e5, 1 / 3)
    ),
    "spheres": mbs.contact.SphereOnSphere(0.1, 0.3),
    "tube": mbs.contact.SphereInCylinder(0.1, 0.3),
    "cylinder": mbs.contact.CylinderOnPlane(0.1, 0.3),
    "journal": mbs.contact.JournalInBush(0.1, 0.3, 0.7, 3),
    "roller": mbs.contact.RollerOnCurve(mbs.contact.ClosedCurve(np.random.default_rng(1).normal(size=(9, 2))), 0.3),
    "road": mbs.contact.WheelOnRoad(mbs.contact.HeightField([0.0, 0.3], [[0.1, 0.2], [0.3, 0.7]], [0.1, 0.7]), 0.3),
}
THINGS = {
    **{f"joint {name}": kind for name, kind in EXAMPLES.items()},
    **{f"law {name}": law for laws in (test_scalar_laws.LAWS, test_loads.LAWS) for name, law in laws.items()},
    **{f"signal {name}": signal for name, signal in test_signals.SIGNALS.items()},
    **{f"element {name}": element for name, (element, _, _) in CASES.items()},
    **{f"reduction {name}": method for name, (method, _) in REDUCTIONS.items()},
    **MORE,
}


@pytest.fixture(scope="module", autouse=True)
def names():
    for name, item in {
        "gearing": gearing,
        "rolled": rolled,
        "torque curve": test_scalar_laws.torque_curve,
        "gain": test_scalar_laws.Gain,
        "drag": test_loads.drag,
        "drag class": test_loads.Drag,
        "turning": test_loads.turning,
    }.items():
        mbs.io.register(name, item)


def again(thing, folder):
    mbs.save_model(thing, folder / "model.json")
    return mbs.load_model(folder / "model.json")


def same(one, other):
    """Equal structure, and equal numbers to the last bit."""
    leaves = [jax.tree.flatten(x) for x in (one, other)]
    assert leaves[0][1] == leaves[1][1]
    for a, b in zip(leaves[0][0], leaves[1][0], strict=True):
        assert np.asarray(a).dtype == np.asarray(b).dtype
        np.testing.assert_array_equal(a, b)
    return True


def test_every_thing_comes_back(tmp_path):
    found = again(THINGS, tmp_path)
    assert list(found) == list(THINGS)
    for name, thing in THINGS.items():
        if dataclasses.is_dataclass(thing) and name == "limit":
            np.testing.assert_array_equal(found[name].upper, thing.upper)
        else:
            assert same(thing, found[name]), name


def test_an_element_with_internal_states_comes_back(tmp_path):
    """Their names, units and order are those of the laws, so that a state of the one is one of the other."""
    b = mbs.SystemBuilder()
    b.body("block", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("rubber", mbs.forces.Maxwell(40.0, 3.0), joint="x")
    b.force("mount", mbs.forces.Maxwell(50.0, 2.0), joint="x")
    system, found = b.build(), again(b, tmp_path).build()
    assert found.topology == system.topology and [r.name for r in found.topology.internal] == [
        "rubber.stretch",
        "mount.stretch",
    ]
    state = mbs.State.at(system, x=0.1, internal={"mount.stretch": 0.2})
    np.testing.assert_array_equal(mbs.forward_dynamics(found, state)[0], mbs.forward_dynamics(system, state)[0])


def test_a_file_of_before_has_other_names(tmp_path):
    b = mbs.SystemBuilder()
    b.body("block", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("rub", mbs.forces.FrictionForce(mbs.friction.LuGre(0.3, 1e4), 5.0), joint="x")
    path = tmp_path / "model.json"
    mbs.io.save_model(b, path)
    path.write_text(path.read_text(encoding="utf-8").replace("FrictionForce", "BristleForce"), encoding="utf-8")
    assert mbs.io.load_model(path).build().topology == b.build().topology


def test_a_hydraulic_circuit_comes_back(tmp_path):
    b = mbs.SystemBuilder()
    b.body("block", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("jack", mbs.forces.HydraulicCylinder((4e-3, 3e-3), (1e-3, 2e-3), 1.5e9), joint="x")
    b.hydraulic("supply", mbs.hydraulics.Tank(2e7))
    b.hydraulic("tank", mbs.hydraulics.Tank())
    ways = {"p": "supply", "t": "tank", "a": "jack.p0", "b": "jack.p1"}
    b.hydraulic("valve", mbs.hydraulics.Valve(1e-3, 3.5e6), ports=ways, signal=mbs.Step(0.1, 0.2))
    assert same(b.build(), again(b, tmp_path).build())


def test_measures_and_blocks_come_back(tmp_path):
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.5, 0.0, 0.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.force("motor", mbs.forces.Motor(0.0, 1.0, 0.1, 0.2), joint="pin")
    b.measure("angle", joint="pin")
    b.measure("height", on=("arm", (1.0, 0.0, 0.0)), axis="z")
    b.measure("gap", between=("ground", "arm"), of="distance")
    b.block(
        "sum",
        blocks.StateSpace([[-1.0]], [[0.0, 0.0, 1.0]], [[2.0]], [[1.0, 2.0, 1 / 3]]),
        reads=("angle", "height", mbs.Harmonic(0.1, 0.2, 3.0)),
    )
    b.block("loop", blocks.PI(2.0, 1 / 3, 0.1), reads="sum", drives="motor")
    system, found = b.build(), again(b, tmp_path).build()
    state = mbs.State.at(system, pin=0.1, internal={"loop.integral": 0.3})
    assert mbs.signals(found, state) == mbs.signals(system, state) and len(mbs.signals(found, state)) == 5
    assert [drives for group in found.blocks for drives in group.drives] == [(), ("motor.voltage",)]


def test_every_class_is_tried():
    tried = {type(thing) for thing in THINGS.values()} | {
        reductions.Reduced,
        reductions.SymmetrySubspace,
        reductions.VirtualMotions,
        forces.ElementBond,
        forces.Margin,
        forces.Reading,
    }
    for room in (forces, blocks, mbs.hydraulics, joints, elements, reductions):
        for name in room.__all__:
            kind = getattr(room, name)
            if isinstance(kind, type) and dataclasses.is_dataclass(kind) and not name.startswith("Abstract"):
                assert kind in tried, name


def test_structures_and_matrices(tmp_path):
    beam = elements.Beam(8.0, 4.0, 2.0, 1.0, 1.0, 2.0, density=0.1)
    nodes = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (2.0, 0.1, 0.0)}
    parts = {"one": (beam, [("a", "b")]), "each": ([beam, beam], [("a", "b"), ("b", "c")])}
    structure = fem.Structure(nodes, parts, held={"a": "all", "c": "y rx"})
    assert same(structure, again(structure, tmp_path))
    matrices = linear.LinearSystem(
        mass=np.eye(2), stiffness=np.diag([1.0, 3.0]), coordinates=["a", "b"], interface=["b"]
    )
    assert same(matrices, again(matrices, tmp_path))


KINDS = st.sampled_from(sorted(set(EXAMPLES) - {"Weld"}))


@pytest.mark.long
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    seed=st.integers(0, 10**6), kinds=st.lists(KINDS, min_size=1, max_size=6), name=st.text(min_size=1, max_size=8)
)
def test_random_systems_come_back(tmp_path, seed, kinds, name):
    check_one(tmp_path, seed, kinds, name)


def test_a_random_system_comes_back(tmp_path):
    check_one(tmp_path, 7, ["Universal", "Free", "Screw", "Planar"], 'é"x\n')


def check_one(tmp_path, seed, kinds, name):
    builder = random_builder(seed, [EXAMPLES[kind] for kind in kinds], name)
    if builder.faults():
        return  # a name that is taken
    other = again(builder, tmp_path)
    systems = [assemble_system(b.declared, _cut_loops(b.declared, set())) for b in (builder, other)]
    assert same(*systems) and systems[0].topology == systems[1].topology


def random_builder(seed, kinds, name):
    """A random tree with a frame, forces on a joint, between points and on a body, a drive and a loop."""
    random, b = np.random.default_rng(seed), mbs.SystemBuilder(rs.GRAVITY)
    links = rs.random_links(seed, kinds)
    for k, link in enumerate(links):
        b.body(f"b{k}", mass=link.mass, com=tuple(link.com), inertia=link.inertia)
    b.body(name, np.float64(random.uniform(1, 2)), inertia=(1.0, 1.0, 1.5), position=random.normal(size=3))
    for k, link in enumerate(links):
        parent = "ground" if link.parent < 0 else f"b{link.parent}"
        b.joint(f"j{k}", link.kind, parent, f"b{k}", rs.as_pose(link.parent_frame), tuple(link.child_frame[1]))
    b.frame("eye", "b0", random.normal(size=3))
    b.joint("turn", mbs.Revolute(random.normal(size=3)), "ground", name, at=random.normal(size=3))
    b.joint("tie", mbs.Spherical(), "ground", name, at=random.normal(size=3))
    b.drive("turn", mbs.forces.Harmonic(amplitude=random.uniform(), omega=3))
    b.force(
        "spring", mbs.SpringDamper(*random.uniform(size=3)), between=("eye", (name, tuple(random.normal(size=3))))
    )
    b.force("stop", mbs.BumpStop(1e4, lower=-random.uniform()), joint="turn")
    b.force("wind", mbs.Force(random.normal(size=3), axes="body"), on=name)
    b.constraint("rod", mbs.joints.Distance(random.uniform(1, 2)), between=("ground", "eye"))
    return b


@pytest.mark.long
def test_an_elastic_body_comes_back(tmp_path):
    from tests.misuse.zoo import Zoo

    b = mbs.SystemBuilder()
    b.elastic("arm", Zoo().frame.body, motions={"b": mbs.Prismatic("z")}, position=(0.1, 0.2, 0.3))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm.a")
    other = again(b, tmp_path)
    assert same(*(assemble_system(x.declared, _cut_loops(x.declared, set())) for x in (b, other)))


def test_a_file_keeps_the_schema(tmp_path):
    schema = mbs.io.model_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    check = jsonschema.Draft202012Validator(schema)
    for thing in (random_builder(1, list(EXAMPLES.values()), "x"), THINGS):
        mbs.save_model(thing, tmp_path / "model.json")
        check.validate(json.loads((tmp_path / "model.json").read_text()))
    text = (tmp_path / "model.json").read_text()
    assert not check.is_valid(json.loads(text.replace('"jaxmbs model": 1', '"jaxmbs model": "1"')))


def small():
    b = mbs.SystemBuilder()
    b.body("arm", 2.0, (0.5, 0.0, 0.0), (0.0, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.force("spring", mbs.SpringDamper(20.0), joint="pin")
    return b


def test_a_person_can_read_it(tmp_path):
    mbs.save_model(small(), tmp_path / "model.json")
    lines = (tmp_path / "model.json").read_text().splitlines()
    assert lines[0] == "{" and lines[1] == ' "jaxmbs model": 1,' and len(lines) < 20
    assert any('"arm": {"mass": 2.0, "com": [0.5, 0.0, 0.0]' in line for line in lines), lines


@pytest.mark.parametrize(
    "old, new, message",
    [
        ('"jaxmbs model": 1', '"jaxmbs model": 7', "it is of version 7; this release reads version 1"),
        ('"Revolute"', '"Revolut"', "model.joints.pin.kind: there is no type 'Revolut': did you mean 'Revolute'"),
        ('"axis"', '"axes"', "model.joints.pin.kind: there is no field 'axes': did you mean 'axis'"),
        ('"axis": [0.0, 1.0, 0.0]', '"axis": [0.0, 1.0]', "model.joints.pin.kind.axis: .* is no array"),
        ('"mass": 2.0', '"mass": "two"', "model.bodies.arm.mass: 'two' is no"),
        ('"mass": 2.0', '"mass": -2.0', "body 'arm': mass is -2.0"),
        ('"mass": 2.0, ', "", "model.bodies.arm: mass is missing"),
        ('"bodies"', '"bodys"', "no table 'bodys': did you mean 'bodies'"),
        ('"mass": 2.0', '"mass": NaN', "NaN is not JSON"),
        ('"mass": 2.0', '"mass": 2.0, "mass": 3.0', "'mass' is defined twice"),
        ('"ground"', '"grund"', "joint 'pin', parent: there is no body or frame 'grund': did you mean 'ground'"),
        ('"type": "SpringDamper"', '"type": "Pose"', "model.forces.spring.law: .*"),
        ("}", "", "it is not readable JSON"),
    ],
)
def test_faults_of_files(old, new, message, tmp_path):
    file = tmp_path / "model.json"
    mbs.save_model(small(), file)
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(mbs.ModelFileError, match=message):
        mbs.load_model(file)


def test_functions_need_a_name(tmp_path):
    b = small()
    b.force("motor", mbs.Actuator(lambda x, v, t: -x), joint="pin")
    with pytest.raises(mbs.ModelError, match=r"model.forces.motor.law.function: .* has no name: `mbs.io.register"):
        mbs.save_model(b, tmp_path / "model.json")
    assert not list(tmp_path.iterdir())  # nothing half written

    class Own(mbs.forces.AbstractScalarLaw):
        def effort(self, x, v, t):
            return -x

    b = small()
    b.force("own", Own(), joint="pin")
    with pytest.raises(mbs.ModelError, match="Own is no class of the library: `mbs.io.register"):
        mbs.save_model(b, tmp_path / "model.json")
    mbs.io.register("own law", Own)
    assert isinstance(again(b, tmp_path).declared.forces["own"].law, Own)
    with pytest.raises(ValueError, match="'Revolute' is that of a class of the library"):
        mbs.io.register("Revolute", Own)
    with pytest.raises(TypeError, match="only functions and classes have names"):
        mbs.io.register("number", 3.0)


def test_a_name_that_is_not_registered(tmp_path):
    b = small()
    b.force("motor", mbs.Actuator(test_scalar_laws.torque_curve), joint="pin")
    mbs.save_model(b, tmp_path / "model.json")
    file = tmp_path / "model.json"
    file.write_text(file.read_text().replace("torque curve", "os.system"))
    with pytest.raises(mbs.ModelFileError, match="no function 'os.system' is registered"):
        mbs.load_model(file)


def test_traced_models_and_faulty_ones_are_not_saved(tmp_path):
    def traced(mass):
        b = mbs.SystemBuilder()
        b.body("arm", mass)
        b.joint("pin", mbs.Revolute("y"), "ground", "arm")
        mbs.save_model(b, tmp_path / "model.json")
        return mass

    with pytest.raises(mbs.ModelError, match="model.bodies.arm.mass is traced"):
        jax.grad(traced)(2.0)
    b = small()
    b.body("arm", 1.0)
    with pytest.raises(mbs.ModelError, match="the name is taken"):
        mbs.save_model(b, tmp_path / "model.json")
