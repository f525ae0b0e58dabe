"""Wrong models and calls: each gives its own error, and the message names the culprit."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import hydraulics
from jaxmbs.friction import SmoothCoulomb
from tests.models import four_bar

PIN, SLIDE, BALL = mbs.Revolute(axis="z"), mbs.Prismatic(axis="x"), mbs.Spherical()
PUMP = hydraulics.Pump(1e-6)
SPRING = mbs.SpringDamper(stiffness=1.0)


def model():
    """Two pinned bodies, free of faults."""
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.1, 0.0, 0.0), inertia=np.ones(3))
    b.body("hand", mass=1.0, com=(0.1, 0.0, 0.0), inertia=np.ones(3))
    b.frame("eye", on="arm", position=(0.2, 0.0, 0.0))
    b.joint("shoulder", PIN, "ground", "arm")
    b.joint("wrist", PIN, "arm", "hand", parent_frame="eye")
    return b


def test_the_model_without_a_fault_builds():
    assert model().build().topology.mobility == 2


def spare(b):
    """One more body, hung on a joint so that only what follows is wrong."""
    b.body("spare", mass=1.0, inertia=np.ones(3))
    return b


def body(name="spare", joint=True, **options):
    def declare(b):
        b.body(name, **({"mass": 1.0, "inertia": np.ones(3)} | options))
        if joint:
            b.joint("hang", PIN, "ground", name)

    return declare


def joint(kind=PIN, parent="ground", child="spare", **options):
    def declare(b):
        spare(b).joint("hang", kind, parent, child, **options)

    return declare


def force(law=SPRING, name="pull", **port):
    return lambda b: b.force(name, law, **port)


def constraint(law, **ends):
    return lambda b: b.constraint("tie", law, **ends)


def friction(joint="wrist", model=0.1, **options):
    return lambda b: b.friction("rub", joint, model, **({"radius": 0.01} | options))


def rub_twice(b):
    b.friction("rub", "wrist", 0.1, radius=0.01)
    b.friction("more", "wrist", 0.1, radius=0.01)


def rub_on_weld(b):
    spare(b).joint("hang", mbs.Weld(), "ground", "spare")
    b.friction("rub", "hang", 0.1)


def rub_on_slide(b):
    spare(b).joint("hang", SLIDE, "ground", "spare")
    b.friction("rub", "hang", 0.1, radius=0.1)


def pump(kind, shaft, **options):
    """A pump or another element between two volumes, on a shaft."""

    def declare(b):
        for name in ("one", "two"):
            b.hydraulic(name, hydraulics.Volume(1e-3))
        b.hydraulic("pump", kind, {"a": "one", "b": "two"}, shaft=shaft, **options)

    return declare


def twice(b):
    b.force("pull", SPRING, joint="wrist")
    b.force("pull", SPRING, joint="shoulder")


def drive_twice(b):
    b.drive("wrist", lambda t: t)
    b.drive("wrist", lambda t: 2 * t)


def case(name, declare, message):
    return pytest.param(declare, message, id=name)


MODELS = [
    case("negative mass", body(mass=-1.0), "body 'spare': mass is -1.0; it must be finite and not negative"),
    case("infinite mass", body(mass=np.inf), "body 'spare': mass is inf"),
    case("three masses", body(mass=np.ones(3)), r"body 'spare': mass must be one number, got shape \(3,\)"),
    case("flat com", body(com=(1.0, 2.0)), "body 'spare': com must be three finite numbers"),
    case("com nan", body(com=(1.0, np.nan, 0.0)), "body 'spare': com must be three finite numbers"),
    case("inertia shape", body(inertia=np.ones(2)), r"body 'spare': inertia must be 0, three .* got shape \(2,\)"),
    case(
        "thin inertia", body(inertia=(1.0, 1.0, 2.5)), "body 'spare': principal inertias 1, 1, 2.5 break A . B >= C"
    ),
    case("skew inertia", body(inertia=np.eye(3) + np.eye(3, k=1)), "body 'spare': inertia is not symmetric"),
    case(
        "negative inertia",
        body(inertia=(1.0, -1.0, 1.0)),
        "body 'spare': inertia has the negative principal value -1",
    ),
    case("inertia nan", body(inertia=np.nan * np.ones(3)), "body 'spare': inertia is not finite"),
    case("huge mass", body(mass=1e200), "body 'spare': mass is 1e.200; it must be finite"),
    case("huge com", body(com=(1e200, 0.0, 0.0)), "body 'spare': com must be three finite numbers"),
    case("huge inertia", body(inertia=(1e308, 1e308, 1e308)), "body 'spare': inertia is not finite, or larger than"),
    case("inertia, no mass", body(mass=0.0), "body 'spare': has inertia but no mass"),
    case("body twice", body("arm", joint=False), "body 'arm': the name is taken"),
    case("body ground", body("ground", joint=False), "body 'ground': the name is taken"),
    case("body as frame", body("eye", joint=False), "body 'eye': the name is taken"),
    case("loose body", body(joint=False), "body 'spare' is not connected to the ground"),
    case("frame on air", lambda b: b.frame("nowhere", on="leg"), "frame 'nowhere': there is no body or frame 'leg'"),
    case("frame twice", lambda b: b.frame("eye", on="hand"), "frame 'eye': the name is taken"),
    case("joint twice", lambda b: b.joint("wrist", PIN, "ground", "hand"), "joint 'wrist': the name is taken"),
    case("no parent", joint(parent="leg"), "joint 'hang', parent: there is no body or frame 'leg'"),
    case("no child", joint(child="leg"), "joint 'hang', child: there is no body or frame 'leg'"),
    case("to itself", joint(parent="spare"), "joint 'hang': parent and child are both 'spare'"),
    case("not a joint", joint("revolute"), "joint 'hang': its kind must be a joint .* got 'revolute'"),
    case("a class", joint(mbs.Revolute), "joint 'hang': its kind must be a joint"),
    case("a closure", joint(mbs.joints.Distance(1.0)), "joint 'hang': its kind must be a joint"),
    case("no frame", joint(parent_frame="ear"), "joint 'hang': parent_frame 'ear' is not a frame"),
    case(
        "frame elsewhere", joint(child_frame="eye"), "joint 'hang': child_frame 'eye' lies on 'arm', not on 'spare'"
    ),
    case("zero axis", joint(mbs.Revolute(axis=np.zeros(3))), "joint 'hang': its axis has no direction"),
    case("axis nan", joint(mbs.Prismatic(axis=(np.nan, 0.0, 1.0))), "joint 'hang': its axis has no direction"),
    case("zero normal", joint(mbs.Planar(normal=np.zeros(3))), "joint 'hang': its axis has no direction"),
    case("no pitch", joint(mbs.Screw(axis="z")), "joint 'hang': its pitch is zero or not finite"),
    case("parallel axes", joint(mbs.Universal(axes=("x", "x"))), "joint 'hang': its two axes are zero, parallel"),
    case("skew axes", joint(mbs.Universal(axes=("x", (1.0, 1.0, 0.0)))), "joint 'hang': .* not at right angles"),
    case(
        "driven ball", joint(BALL, drive=lambda t: t), "joint 'hang': only joints with one coordinate can be driven"
    ),
    case(
        "backwards ball",
        joint(BALL, "spare", "ground"),
        r"joint 'hang' \(Spherical\) is declared from its outer to its inner body",
    ),
    case(
        "drive what",
        lambda b: b.drive("elbow", lambda t: t),
        "drive: there is no joint 'elbow'; there are: shoulder",
    ),
    case("drive twice", drive_twice, "drive: joint 'wrist' is driven already"),
    case(
        "free loop",
        lambda b: b.joint("tie", mbs.Free(), "ground", "hand"),
        "joint 'tie' .*Free.* cannot close a loop",
    ),
    case("force twice", twice, "force 'pull': the name is taken"),
    case("rubs nowhere", friction("elbow"), "friction 'rub': there is no joint 'elbow'"),
    case("no radius", friction(radius=None), "friction 'rub': joint 'wrist' is a Revolute; give radius="),
    case("rubs twice", rub_twice, "friction 'more': joint 'wrist' has the friction 'rub' already"),
    case("rubbing weld", rub_on_weld, "friction 'rub': joint 'hang' is a Weld; friction is for"),
    case("slide with radius", rub_on_slide, "friction 'rub': joint 'hang' is a Prismatic, which does not turn"),
    case("negative mu", friction(model=-0.1), "friction 'rub': dynamic must not be negative"),
    case("many mus", friction(model=np.ones(2)), "friction 'rub': every number of SmoothCoulomb must be one number"),
    case("weak start", friction(model=SmoothCoulomb(0.1, 0.09)), "friction 'rub': static must be at least dynamic"),
    case(
        "no transition",
        friction(model=SmoothCoulomb(0.1, transition_speed=0.0)),
        "friction 'rub': transition_speed must be positive",
    ),
    case("endless bearing", friction(length=np.inf), "friction 'rub': length must be one finite number"),
    case("no shaft", pump(PUMP, "elbow"), "'pump': shaft: there is no joint 'elbow'"),
    case("driven shaft", pump(PUMP, "wrist", signal=1.0), "'pump': give its speed as a signal, or the joint"),
    case("slit on a shaft", pump(hydraulics.Orifice(1e-6), "wrist"), "'pump': shaft= goes with a Pump, not with a"),
    case("not a law", force("spring", joint="wrist"), "force 'pull': 'spring' is not a force law"),
    case("no port", force(), "force 'pull': SpringDamper takes between=... or joint=..., got none"),
    case("two ports", force(joint="wrist", on="hand"), "force 'pull': SpringDamper takes .*, got joint, on"),
    case(
        "load on a joint", force(mbs.Force(np.ones(3)), joint="wrist"), "force 'pull': Force takes on=..., got joint"
    ),
    case("bushing on", force(mbs.Bushing((1.0, 1.0)), on="hand"), "force 'pull': Bushing takes between=..., got on"),
    case("law on what", force(joint="elbow"), "force 'pull': there is no joint 'elbow'; there are: shoulder, wrist"),
    case("between what", force(between=("ground", "leg")), "force 'pull': there is no body or frame 'leg'"),
    case("between one", force(between=("ground",)), "force 'pull': between= takes two frames, got 1"),
    case("on a number", force(mbs.Force(np.ones(3)), on=3.0), "force 'pull': 3.0 is not a body name, frame name"),
    case(
        "bad damper",
        force(mbs.SpringDamper(damping=-1.0), joint="wrist"),
        "force 'pull': damping must not be negative",
    ),
    case(
        "rod of no length",
        constraint(mbs.joints.Distance(0.0), between=("ground", "hand")),
        "constraint 'tie': its length",
    ),
    case(
        "rod to what",
        constraint(mbs.joints.Distance(1.0), between=("ground", "leg")),
        "constraint 'tie': there is no body or frame 'leg'",
    ),
    case(
        "rod to none",
        constraint(mbs.joints.Distance(1.0)),
        r"constraint 'tie': Distance takes between=\(frame, frame\)",
    ),
    case("gear on what", constraint(mbs.Coupler({"elbow": 1.0})), "constraint 'tie': there is no joint 'elbow'"),
    case("idle gear", constraint(mbs.Coupler({"wrist": 0.0})), "constraint 'tie': all its coefficients are zero"),
    case("not a constraint", constraint(SPRING), "constraint 'tie': .* is not a constraint"),
]


@pytest.mark.parametrize("declare, message", MODELS)
def test_wrong_models(declare, message):
    b = model()
    declare(b)
    with pytest.raises(mbs.ModelError, match=message):
        b.build()


def law_on_a_ball(b):
    b.joint("hang", BALL, "ground", "spare")
    b.force("pull", SPRING, joint="hang")


def gear_on_a_ball(b):
    b.joint("hang", BALL, "ground", "spare")
    b.constraint("tie", mbs.Coupler({"hang": 1.0, "wrist": 1.0}))


def weightless(b):
    b.body("ghost", mass=0.0)
    b.joint("haunt", PIN, "ground", "ghost")


@pytest.mark.parametrize(
    "declare, message",
    [
        (law_on_a_ball, "force 'pull': joint 'hang' does not have exactly one coordinate"),
        (gear_on_a_ball, "constraint 'tie': joint 'hang' does not have exactly one coordinate"),
    ],
)
def test_laws_of_one_coordinate_on_a_ball(declare, message):
    b = spare(model())
    declare(b)
    with pytest.raises(mbs.ModelError, match=message):
        b.build()


def test_a_motion_without_inertia():
    b = model()
    weightless(b)
    with pytest.raises(mbs.ModelError, match="joint.* haunt moves no inertia"):
        b.build()


def test_an_empty_model():
    with pytest.raises(mbs.ModelError, match="the model has no bodies"):
        mbs.SystemBuilder().build()


def test_gravity_of_two_numbers():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81))
    b.body("arm", mass=1.0)
    b.joint("shoulder", SLIDE, "ground", "arm")
    with pytest.raises(mbs.ModelError, match=r"gravity must be three numbers, got shape \(2,\)"):
        b.build()


@pytest.mark.parametrize(
    "options, message",
    [
        ({"cut": ["elbow"]}, "cut: there is no joint 'elbow'"),
        ({"cut": ["wrist"]}, "body 'hand' is not connected to the ground"),
        ({"independent": ["elbow"]}, "independent: there is no joint 'elbow'"),
        ({"independent": ["wrist"]}, "independent: joints wrist give 1 velocities .* the mobility is 2"),
    ],
)
def test_wrong_options_of_build(options, message):
    with pytest.raises(mbs.ModelError, match=message):
        model().build(**options)


@pytest.mark.long
def test_loops_that_cannot_close():
    with pytest.raises(mbs.ModelError, match=r"the loops cannot be closed; still open .*: C;"):
        four_bar((3.0, 0.3, 0.9, 0.7))


def test_all_faults_come_in_one_report():
    """Faults of bodies, frames, joints, forces and constraints together."""
    b = model()
    b.body("heavy", mass=-2.0)
    b.body("thin", mass=1.0, inertia=(1.0, 1.0, 5.0))
    b.frame("nowhere", on="leg")
    b.joint("bad", mbs.Revolute(axis=np.zeros(3)), "ground", "heavy")
    b.joint("worse", "weld", "arm", "thin")
    b.force("pull", SPRING, joint="elbow")
    b.force("push", SPRING, joint="worse")
    b.constraint("tie", mbs.Coupler({"knee": 1.0}))
    with pytest.raises(mbs.ModelError) as caught:
        b.build()
    faults = caught.value.faults
    for part in ("'heavy': mass", "'thin': principal", "'nowhere'", "'bad': its axis", "'worse': its kind"):
        assert sum(part in fault for fault in faults) == 1, part
    for part in ("force 'pull': there is no joint", "constraint 'tie': there is no joint"):
        assert sum(part in fault for fault in faults) == 1, part
    assert len(faults) == 7
    assert str(caught.value).startswith("the model has 7 faults:\n  1. body 'heavy'")


# ------------------------------------------------------------------------------------------------- states
@pytest.fixture(scope="module")
def system():
    return model().build()


@pytest.fixture(scope="module")
def loop():
    return four_bar()


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"elbow": 0.1}, "state: there is no joint 'elbow'; there are: shoulder, wrist"),
        ({"wrist": np.ones(2)}, r"state: joint 'wrist' takes 1 coordinates, got shape \(2,\)"),
        ({"velocities": {"wrist": np.ones(3)}}, r"state: joint 'wrist' takes 1 velocities, got shape \(3,\)"),
        ({"guess": {"knee": 0.1}}, "state: there is no joint 'knee'"),
    ],
)
def test_wrong_states(system, arguments, message):
    with pytest.raises(mbs.ModelError, match=message):
        mbs.State.at(system, **arguments)


def test_a_cut_joint_has_no_velocity(loop):
    with pytest.raises(mbs.ModelError, match="state: joint 'C' closes a loop and takes no velocities"):
        mbs.State.at(loop, velocities={"C": 0.1})


def test_faults_of_a_state_come_together(system):
    with pytest.raises(mbs.ModelError) as caught:
        mbs.State.at(system, {"elbow": 1.0, "wrist": np.ones(2)}, velocities={"knee": 1.0})
    assert len(caught.value.faults) == 3


def test_a_held_coordinate_that_contradicts_a_drive():
    b = model()
    b.drive("wrist", lambda t: 0.5 + t)
    with pytest.raises(mbs.AssemblyError, match="cannot be assembled") as caught:
        mbs.State.at(b.build(), wrist=0.1)
    assert set(caught.value.residuals) == {"wrist"}


@pytest.mark.parametrize(
    "ask", [mbs.position, mbs.rotation, mbs.velocity, mbs.kinematics.jacobian, mbs.dynamics.acceleration]
)
def test_unknown_frames(system, ask):
    state = mbs.State(jnp.zeros(()), jnp.zeros(2), jnp.zeros(2))
    with pytest.raises(mbs.UnknownNameError, match="there is no body or frame 'leg'; there are: ground, arm"):
        ask(system, state, "leg")


@pytest.mark.parametrize(
    "make, error, message",
    [
        (lambda: mbs.Revolute(axis="w"), ValueError, "axis 'w' is not one of x, y, z"),
        (lambda: mbs.Revolute(axis=(1.0, 0.0)), ValueError, r"an axis needs three numbers, got shape \(2,\)"),
        (lambda: mbs.Force(np.ones(3), axes="joint"), ValueError, "axes must be 'world' or 'body', not 'joint'"),
        (lambda: mbs.Bushing(np.ones((5, 5))), ValueError, r"\(6,\) or \(6, 6\)"),
        (lambda: mbs.inertia.combine([]), ValueError, "combine needs at least one part"),
    ],
)
def test_wrong_parts(make, error, message):
    with pytest.raises(error, match=message):
        make()
