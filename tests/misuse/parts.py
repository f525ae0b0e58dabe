"""Examples of what is declared: joints, laws, signals, elements and the numbers of bodies, judged at build."""

import functools
import inspect

import numpy as np

import jaxmbs as mbs
from jaxmbs import elements, fem, hydraulics
from jaxmbs.contact import (
    ClosedCurve,
    HeightField,
    HuntCrossley,
    RollerOnCurve,
    SphereOnPlane,
    WheelOnRoad,
)
from tests.elements.test_elements import CASES as ELEMENTS
from tests.vehicles.tyres import WHOLE as SAMPLE_TYRE

from .attempts import call
from .cases import case


def _through(use):
    """Of a class: a function of its arguments that makes one and uses it."""

    def wrapper(kind):
        @functools.wraps(kind, updated=())
        def made(*args, **options):
            return use(kind(*args, **options))

        made.__signature__ = inspect.signature(kind)
        return made

    return wrapper


def _two_bodies():
    b = mbs.SystemBuilder()
    for name in ("arm", "hand"):
        b.body(name, mass=1.0, com=(0.1, 0.0, 0.0), inertia=(0.01, 0.02, 0.02))
    b.joint("shoulder", mbs.Revolute("z"), "ground", "arm")
    return b


def _joint(kind):
    b = _two_bodies()
    b.joint("wrist", kind, "arm", "hand")
    return b.build()


def _rub(model):
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("z"), "arm", "hand")
    b.friction("rub", "wrist", model, radius=0.02)
    return b.build()


def _rub_by_old_name(model):
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("z"), "arm", "hand")
    b.friction("rub", "wrist", 0.1, radius=0.02, model=model)
    return b.build()


def _law(**port):
    def use(law):
        b = _two_bodies()
        b.joint("wrist", mbs.Revolute("y"), "arm", "hand")
        b.force("law", law, **port)
        return b.build()

    return use


def _block(block):
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("y"), "arm", "hand")
    b.force("push", mbs.Actuator(0.0), joint="wrist")
    b.measure("angle", joint="wrist")
    b.block("block", block, reads="angle", drives="push")
    return b.build()


def _contact(pair, force=HuntCrossley(2.0), friction=None):  # noqa: B008
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("y"), "arm", "hand")
    b.contact("touch", pair, "hand", "ground", force, friction)
    return b.build()


def _contact_by(kind):
    return lambda surface: _contact(kind(surface))


def _cable(item):
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("y"), "arm", "hand")
    forces = mbs.forces
    first = (
        item if isinstance(item, forces.Attachment | forces.Winch) else forces.Attachment(("ground", (0.0, 0.0, 1.0)))
    )
    between = [] if first is item else [item]
    b.cable("cable", [first, *between, forces.Attachment(("hand", (1.0, 0.2, 0.0)))], stiffness=2.0)
    return b.build()


def _section(section):
    b = mbs.SystemBuilder()
    b.beam("rod", section, [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], 1)
    b.joint("clamp", mbs.Revolute("y"), "ground", "rod.0")
    return b.build()


def _constraint(kind):
    b = _two_bodies()
    b.joint("wrist", mbs.Free(), "arm", "hand")
    b.constraint("tie", kind, **({} if isinstance(kind, mbs.Coupler) else {"between": ("ground", "hand")}))
    return b.build()


def _tied_by_cable(cable):
    b = _two_bodies()
    b.joint("wrist", mbs.Free(), "arm", "hand")
    b.constraint("tie", cable, between=(("ground", (0.0, 0.0, 3.0)), "arm", "hand"))
    return b.build()


def _coupled(kind):
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("y"), "arm", "hand")
    b.constraint("tie", kind)
    return b.build()


def _drive(signal):
    b = _two_bodies()
    b.joint("wrist", mbs.Revolute("y"), "arm", "hand", drive=signal)
    return b.build()


def _circuit(**options):
    """An element between two volumes (a valve between four), or a node beside an orifice."""

    def use(element):
        b = _two_bodies()
        b.joint("wrist", mbs.Revolute("y"), "arm", "hand")
        ports = getattr(element, "ports", None)
        b.hydraulic("part", element, ports and {port: f"volume {port}" for port in ports}, **options)
        for port in ports or "a":
            b.hydraulic(f"volume {port}", hydraulics.Volume(1.0, 2.0))
        if ports is None:
            b.hydraulic("gap", hydraulics.Orifice(1.0), {"a": "part", "b": "volume a"})
        return b.build()

    return use


NODES = {
    1: {"a": (0.0, 0.0, 0.0)},
    2: {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)},
    3: {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (0.0, 1.0, 0.0)},
    4: {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (1.0, 1.0, 0.0), "d": (0.0, 1.0, 0.0)},
}


_PLACES = {type(element): places for element, places, _ in ELEMENTS.values()}  # of more than four nodes


def _element(element):
    count = element.num_nodes
    nodes = NODES[count] if count <= 4 else dict(zip(map(str, range(count)), _PLACES[type(element)], strict=True))
    if isinstance(element, elements.Tetrahedron):
        nodes = dict(zip("abcd", _PLACES[elements.Tetrahedron], strict=True))
    return fem.assemble_dense(fem.Structure(nodes, {"parts": (element, [tuple(nodes)])}))


def joint(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_joint))


def in_circuit(arguments, *fine, positive="", **options):
    return case(arguments, *fine, positive=positive, through=_through(_circuit(**options)))


def on_joint(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_law(joint="wrist")))


def _model(arguments, more=""):
    """A model of friction: its numbers by the names that all models share."""
    return case(arguments, positive=f"dynamic static transition_speed {more}", through=_through(_rub))


def pair(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_contact))


def on_body(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_law(on="hand")))


def tie(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_constraint))


def block(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_block))


def signal(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_drive))


def element(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(_element))


AXIS = np.array([0.0, 1.0, 1.0])
POINTS, EFFORTS = np.array([-1.0, 0.0, 2.0]), np.array([-3.0, 0.0, 4.0])
MANY = "any number of points"
NO_LIMIT = "nothing breaks that way"
SECTION = elements.ShellSection(np.eye(3), np.eye(3), np.eye(2), None, 1.0, 0.5)
OUTLINE = np.array([(np.cos(x), np.sin(x)) for x in np.arange(12) * np.pi / 6])

PLAIN_NUMBERS = {"nominal_load": 4e3, "radius": 0.5, "stiffness": 2e5, "vertical_damping": 0.5, "resistance": 0.25}
PLAIN_TYRE = mbs.vehicles.LinearTyre(9e4, 6e4, **PLAIN_NUMBERS)


def _tyre(model, road=None):
    road = mbs.vehicles.FlatRoad() if road is None else road
    return _law(between=("ground", "hand"))(mbs.vehicles.Tyre(model, road))


def _road(arguments, *fine, positive=""):
    return case(arguments, *fine, positive=positive, through=_through(lambda road: _tyre(PLAIN_TYRE, road)))


def _plain_tyre(positive="", **own):
    return case(
        lambda z: call(9e4, 6e4, relaxation=np.array([0.25, 0.5]), **PLAIN_NUMBERS, **own),
        positive=f"slip_slope cornering nominal_load radius stiffness vertical_damping resistance {positive}",
        through=_through(_tyre),
    )


def _oscillator():
    return mbs.LinearSystem(mass=np.eye(1), stiffness=np.eye(1), damping=np.eye(1), coordinates=["x"])


def _rotor():
    shaft = mbs.rotors.Shaft([0.0, 0.5, 1.0], 0.02)
    return mbs.rotors.Rotor(shaft, [mbs.rotors.Disk(1, 5.0, 0.1, 0.2)], [mbs.rotors.Bearing(k, 1e6) for k in (0, 2)])


CASES = {
    "rotors.Shaft": case(
        lambda z: call([0.0, 0.5, 1.0], 0.02, 0.01, 2e11, 7800.0, 0.25, 2),
        "stations shape: any number of stations",
        "outer shape: one radius for each section",
        "inner shape: one radius for each section",
        positive="outer inner young density",
    ),
    "rotors.Disk": case(lambda z: call(1, 5.0, 0.25, 0.5), positive="mass diametral polar"),
    "rotors.Bearing": case(
        lambda z: call(1, 1e6, 0.5), "damping shape: by directions", "stiffness shape: by directions"
    ),
    "rotors.BearingTable": case(lambda z: call(1, [1.0, 2.0], np.ones((2, 2, 2)), np.ones((2, 2, 2)))),
    "rotors.PlainBearing": case(
        lambda z: call(1, 0.125, 0.0625, 1e-4, 0.125, 512.0), positive="diameter length clearance viscosity load"
    ),
    "rotors.Rotor": case(
        lambda z: call(_rotor().shaft, _rotor().disks, _rotor().bearings),
        "disks empty: a shaft alone",
        "bearings empty: a free shaft",
        "shaft nan inside: judged by its answers",
        "disks nan inside: judged by its answers",
        "bearings nan inside: judged by its answers",
    ),
    "engines.CrankTrain": case(lambda z: call([0.25, 0.5], [3.0])),
    "engines.CylinderPressure": case(lambda z: call(np.linspace(0.0, 12.0, 24), np.linspace(1.0, 2.0, 24), 0.25)),
    "engines.orders": case(lambda z: call(np.linspace(1.0, 2.0, 64), 1, 4), "values shape: any number of them"),
    "cycles.harmonic_balance": case(
        lambda z: call(_oscillator(), [1.0, 2.0], {"x": 0.5}, {"law": ("x", lambda x, v: -x)}, (1, 3), 16),
        "omega shape: any number of frequencies",
    ),
    "rotors.critical_speeds": case(lambda z: call(_rotor(), 2)),
    "rotors.critical_speed_map": case(
        lambda z: call(_rotor(), [1e5, 1e6], 2), "stiffness shape: any number of them", positive="stiffness"
    ),
    "rotors.whirl_speeds": case(lambda z: call(_rotor(), [1.0, 2.0], 2), "speeds shape: any number of speeds"),
    "rotors.unbalance_response": case(
        lambda z: call(_rotor(), [1.0, 2.0], {1: 0.5}), "speeds shape: any number of speeds"
    ),
    "rotors.resonance": case(lambda z: call(_rotor(), (1.0, 200.0), {1: 0.5}, 1)),
    "rotors.run_up": case(
        lambda z: call(_rotor(), lambda t: 2.0 * t, {1: 0.5}, [0.0, 0.25, 0.5], 1, 2), "unbalance complex: of a phase"
    ),
    "rotors.separation_margin": case(lambda z: call(4.0, "above"), "factor shape: any number of them"),
    **{f"joints.{name}": joint(lambda z: call(AXIS)) for name in ("Revolute", "Prismatic", "Cylindrical", "Planar")},
    "joints.Screw": joint(lambda z: call(AXIS, pitch=0.5)),
    "joints.Universal": joint(lambda z: call(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))),
    **{f"joints.{name}": joint(lambda z: call()) for name in ("Spherical", "Free", "Weld")},
    "joints.Distance": tie(lambda z: call(0.5), positive="length"),
    "joints.FramePath": tie(
        lambda z: call(np.array([0.5, 0.25, 0.0]), np.array([0.0, 0.0, 0.5]), ("x", "rz")),
        "position none: no path for it",
        "rotation none: no path for it",
        "hold none: all of them",
    ),
    "joints.PointOnPlane": tie(lambda z: call()),
    "joints.PointOnLine": tie(lambda z: call()),
    "joints.RollingSphere": tie(lambda z: call(0.5), positive="radius"),
    "joints.RollingDisk": tie(lambda z: call(0.5, np.array([0.0, 1.0, 0.0])), positive="radius"),
    "joints.KnifeEdge": tie(lambda z: call(np.array([1.0, 0.0, 0.0]))),
    "joints.Coupler": case(
        lambda z: call({"shoulder": 1.0, "wrist": 2.0}, 0.5, lambda a, b: a - b), through=_through(_coupled)
    ),
    "joints.PositionRows": case(lambda z: call(lambda psi, t: psi[0] - psi[1]), through=_through(_coupled)),
    "joints.VelocityRows": case(lambda z: call(lambda psi, u, t: u[0] - u[1]), through=_through(_coupled)),
    "forces.SpringDamper": on_joint(lambda z: call(2.0, 1.0, 0.5, 0.25), positive="damping"),
    "forces.PolynomialSpring": on_joint(
        lambda z: call(np.array([2.0, 0.5]), np.array([1.0, 0.5]), -0.25, 0.25),
        "stiffness shape: of any order",
        "damping shape: of any order",
        positive="damping",
    ),
    "forces.Bushing": case(
        lambda z: call(np.ones(6), np.ones(6), np.zeros(6)),
        through=_through(_law(between=("ground", "hand"))),
        positive="damping",
    ),
    "forces.BeamElement": case(
        lambda z: call(np.eye(6), np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.5),
        through=_through(_law(between=("ground", "hand"))),
        positive="damping",
    ),
    "forces.BeamSection": case(
        lambda z: call(np.ones(6), 2.0, np.ones(3), 0.5),
        through=_through(_section),
        positive="stiffness mass inertia",
    ),
    "contact.SphereOnPlane": pair(lambda z: call(0.5), positive="radius"),
    "contact.SphereOnSphere": pair(lambda z: call(0.5, 2.0), positive="radius other_radius"),
    "contact.SphereInCylinder": pair(lambda z: call(0.5, 0.25), positive="radius clearance"),
    "contact.CylinderOnPlane": pair(lambda z: call(0.5, 2.0), positive="radius length"),
    "contact.JournalInBush": pair(lambda z: call(0.5, 0.25, 2.0, 3), positive="radius clearance length"),
    "contact.RollerOnCurve": pair(lambda z: call(ClosedCurve(OUTLINE), 0.5, 2.0), positive="radius width"),
    "contact.WheelOnRoad": pair(lambda z: call(HeightField(POINTS, np.zeros(3)), 0.5), positive="radius"),
    "contact.ClosedCurve": case(
        lambda z: call(OUTLINE), f"points shape: {MANY}", through=_through(_contact_by(RollerOnCurve))
    ),
    "contact.HeightField": case(
        lambda z: call(POINTS, 0.1 * EFFORTS),
        "y none: the same for every y",
        through=_through(_contact_by(WheelOnRoad)),
    ),
    "contact.HuntCrossley": case(
        lambda z: call(2.0, 1.5, 0.5, 0.25),
        positive="stiffness exponent damping transition",
        through=_through(lambda force: _contact(SphereOnPlane(0.5), force)),
    ),
    "contact.DryFriction": case(
        lambda z: call(0.5, 1.5, 0.25, "coulomb"),
        positive="mu static_ratio transition_speed",
        through=_through(lambda friction: _contact(SphereOnPlane(0.5), friction=friction)),
    ),
    **{
        f"forces.{name}": case(lambda z: call(), through=_through(_rub_by_old_name))
        for name in ("SmoothCoulomb", "BrownMcPhee")
    },
    "forces.BearingFriction": case(
        lambda z: call(2.0, 0.5), positive="viscous seal", through=_through(_rub_by_old_name)
    ),
    "forces.JointLuGre": case(
        lambda z: call(1e4, 2.0, 0.5), positive="sigma0 sigma1 sigma2", through=_through(_rub_by_old_name)
    ),
    "friction.SmoothCoulomb": _model(lambda z: call(0.5, 0.75, 0.25, 2.0), "stribeck_speed"),
    "friction.BearingFriction": _model(lambda z: call(0.5, 0.75, 0.25, 2.0, 3.0, 4.0), "stribeck_speed viscous seal"),
    "friction.BrownMcPhee": _model(lambda z: call(0.5, 0.75, 0.25)),
    "friction.LuGre": case(
        lambda z: call(0.5, 1e3, 2.0, 0.25, 0.75, 0.125),
        positive="dynamic sigma0 sigma1 sigma2 static stribeck_speed",
        through=_through(_rub),
    ),
    "forces.FrictionForce": on_joint(
        lambda z: call(mbs.friction.SmoothCoulomb(0.5), 2.0, 0.25), positive="load radius"
    ),
    "forces.BristleForce": on_joint(lambda z: call(mbs.friction.LuGre(0.5, 1e3), 2.0, 0.25), positive="load radius"),
    "contact.Contact": case(
        lambda z: call(SphereOnPlane(0.5), HuntCrossley(2.0), mbs.friction.SmoothCoulomb(0.5), 0.25, 0.5),
        "friction none: smooth surfaces",
        "max_depth none: no bound",
        positive="max_depth wear",
        through=_through(_law(between=("ground", "hand"))),
    ),
    "contact.ContactLuGre": case(
        lambda z: call(0.5, 1e3, 2.0, 0.5, 1.5, 0.25),
        positive="mu sigma0 sigma1 sigma2 static_ratio transition_speed",
        through=_through(lambda friction: _contact(SphereOnPlane(0.5), friction=friction)),
    ),
    "contact.BristleContact": case(
        lambda z: call(SphereOnPlane(0.5), HuntCrossley(2.0), mbs.friction.LuGre(0.5, 1e3), 0.25, 0.5),
        "max_depth none: no bound",
        positive="max_depth wear",
        through=_through(_law(between=("ground", "hand"))),
    ),
    "vehicles.FlatRoad": case(lambda z: call(), through=_through(lambda road: _tyre(PLAIN_TYRE, road))),
    "vehicles.SineRoad": _road(lambda z: call(0.5, 2.0, 0.25, 0.125), positive="wavelength"),
    "vehicles.CleatRoad": _road(lambda z: call(1.0, 0.5, 0.25, 0.125), positive="length ramp"),
    "vehicles.SurfaceRoad": _road(lambda z: call(HeightField(POINTS, np.zeros(3)))),
    "vehicles.TandemCams": _road(
        lambda z: call(mbs.vehicles.FlatRoad(), 0.25, 0.5, 0.5, 1.5, 81),
        positive="base half_length half_height exponent",
    ),
    "vehicles.Tyre": case(
        lambda z: call(PLAIN_TYRE, mbs.vehicles.FlatRoad(), 2e5, True, 0.25),
        "pressure none: the nominal one",
        positive="pressure tread_damping",
        through=_through(_law(between=("ground", "hand"))),
    ),
    "vehicles.MagicFormula": case(
        lambda z: call(SAMPLE_TYRE, "5.2", "opentire", True), through=_through(lambda model: _tyre(model))
    ),
    "vehicles.LinearTyre": _plain_tyre(camber_stiffness=2e3, trail=0.25),
    "vehicles.FialaTyre": _plain_tyre("width", friction=np.array([0.75, 0.5]), width=0.25),
    "vehicles.BrushTyre": _plain_tyre("friction half_length", friction=0.75, half_length=0.125),
    "contact.hertz_stiffness": case(
        lambda z: call((0.5, 2.0), (3.0, 4.0), (0.25, 0.125)), "radii inf: a plane", "moduli inf: a rigid body"
    ),
    "forces.BumpStop": on_joint(
        lambda z: call(2.0, -1.0, 1.0, 2.0, 0.25),
        "lower inf: no stop",
        "upper inf: no stop",
        positive="stiffness damping",
    ),
    "forces.CoulombFriction": on_joint(
        lambda z: call(2.0, 1.5, 0.5, 0.25, 0.5),
        positive="effort_limit static_ratio slip_speed viscous stribeck_speed",
    ),
    "forces.AirSpring": on_joint(
        lambda z: call(2.0, 3.0, 4.0, 1.5, 0.5, 0.25), positive="area pressure height exponent ambient"
    ),
    "blocks.PI": block(lambda z: call(2.0, 1.0, 0.5, 3.0, 0.2), positive="tracking"),
    "blocks.PID": block(
        lambda z: call(2.0, 1.0, kd=0.5, target=3.0, limit=0.2, tracking=0.1, filter=0.05), positive="tracking filter"
    ),
    "blocks.FirstOrder": block(lambda z: call(0.5, 2.0), positive="time_constant"),
    "blocks.TransferFunction": block(
        lambda z: call(np.array([1.0, 2.0]), np.array([1.0, 2.0, 3.0])),
        "numerator shape: polynomials of any degree",
        "denominator shape: polynomials of any degree",
    ),
    "blocks.StateSpace": block(lambda z: call(-np.eye(2), np.ones((2, 1)), np.ones((1, 2)), np.zeros((1, 1)))),
    "blocks.Delay": block(lambda z: call(0.1, 2), positive="duration pade"),
    "blocks.RateLimit": block(lambda z: call(2.0, 1.0, 0.1), positive="rising falling time_constant"),
    "blocks.Saturation": block(lambda z: call(-1.0, 1.0), "lower inf: no limit there", "upper inf: no limit there"),
    "blocks.LookUp": block(lambda z: call(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 4.0]))),
    "blocks.Function": block(lambda z: call(lambda u, t: 2.0 * u)),
    "forces.Maxwell": on_joint(lambda z: call(2.0, 1.0), positive="stiffness damping"),
    "forces.Zener": on_joint(lambda z: call(2.0, 1.0, 0.5, 0.25), positive="stiffness damping static_stiffness"),
    "forces.Prony": on_joint(
        lambda z: call(2.0, np.array([1.0, 2.0]), np.array([0.5, 4.0]), 0.25), positive="stiffness branches times"
    ),
    "forces.PronyBushing": case(
        lambda z: call(np.ones(6), np.ones((2, 6)), np.array([0.5, 4.0])),
        through=_through(_law(between=("ground", "hand"))),
        positive="stiffness branches times",
    ),
    "forces.LuGre": on_joint(
        lambda z: call(2.0, 1e3, 1.0, 1.5, 0.25, 0.5),
        positive="effort_limit bristle_stiffness bristle_damping static_ratio viscous stribeck_speed",
    ),
    "forces.ElastoPlastic": on_joint(
        lambda z: call(2.0, 1.0, 0.5, 3.0, 0.25), positive="stiffness yield_force hardening sharpness"
    ),
    "forces.Motor": on_joint(
        lambda z: call(12.0, 2.0, 0.5, 0.25, 0.25, 3.0, 9.0, 5.0, 0.1),
        positive="resistance inductance max_voltage max_torque limit_time",
    ),
    "forces.HydraulicCylinder": on_joint(
        lambda z: call(np.array([2.0, 1.0]), np.ones(2), 1e3, 0.5, 0.25, 4.0, 1.0, 0.1, 0.1, 0.5, 0.25),
        positive="areas volumes bulk_modulus flow_gain leakage damping laminar",
    ),
    "hydraulics.Orifice": in_circuit(
        lambda z: call(2.0, 0.5, 3.0, 4.0), positive="area discharge density laminar", signal=1.0
    ),
    "hydraulics.Valve": in_circuit(
        lambda z: call(2.0, 3.0, 0.25, 4.0, 0.5),
        positive="rated_flow rated_drop laminar rounding",
        signal=0.5,
    ),
    "hydraulics.ReliefValve": in_circuit(lambda z: call(2.0, 3.0, 0.5), positive="cracking slope rounding"),
    "hydraulics.CheckValve": in_circuit(
        lambda z: call(2.0, 3.0, 0.5, 0.25), positive="rated_flow rated_drop cracking laminar"
    ),
    "hydraulics.Pump": in_circuit(lambda z: call(2.0, 0.5, 0.25), positive="displacement leakage drag", signal=3.0),
    "hydraulics.Line": in_circuit(
        lambda z: call(2.0, 0.5, 3.0, 0.25, 1.0), positive="length diameter density viscosity loss"
    ),
    "hydraulics.Volume": in_circuit(lambda z: call(2.0, 3.0, 0.5), positive="volume bulk_modulus"),
    "hydraulics.Accumulator": in_circuit(
        lambda z: call(2.0, 3.0, 1.5, 4.0, 0.5, 1.0, 2.0, 0.25),
        positive="volume precharge exponent ambient dead_volume bulk_modulus rounding",
    ),
    "hydraulics.Tank": in_circuit(lambda z: call(0.5)),
    "forces.Table": on_joint(
        lambda z: call(POINTS, EFFORTS, POINTS, EFFORTS), "x_points shape: refused with efforts of another number"
    ),
    "forces.PD": on_joint(lambda z: call(mbs.forces.Constant(0.5), 2.0, 1.0), positive="kp kd"),
    "forces.Actuator": on_joint(lambda z: call(lambda x, v, t: -x), "function no function: a constant effort"),
    "forces.Cable": case(
        lambda z: call(
            *(("point", "sheave", "point"), np.array([0.5]), np.array([[0.0, 0.0, 1.0]]), np.array([1.0])),
            **{"stiffness": 2.0, "damping": 0.5, "free_length": mbs.forces.Constant(1.0), "friction": np.ones(3)},
        ),
        through=_through(_law(between=("ground", "arm", "hand"))),
        positive="radii stiffness damping friction",
    ),
    "forces.PathForce": case(
        lambda z: call(
            *(("point", "sheave", "point"), np.array([0.25]), np.array([[0.0, 0.0, 1.0]]), np.array([0.0])),
            **{"law": mbs.SpringDamper(2.0)},
        ),
        through=_through(_law(between=("ground", "arm", "hand"))),
        positive="radii",
    ),
    "forces.InextensibleCable": case(
        lambda z: call(
            *(("point", "sheave", "point"), np.array([0.25]), np.array([[0.0, 1.0, 0.0]]), np.array([0.0])),
            **{"free_length": mbs.forces.Constant(4.0)},
        ),
        through=_through(_tied_by_cable),
        positive="radii",
    ),
    "forces.GearPair": case(
        lambda z: call((20, 30), 2e-3, 0.35, 0.25, False, 2.0, 0.5, 1e-4, 0.25, 1e-3),
        through=_through(_law(between=("arm", "hand"))),
        positive="module stiffness damping backlash transition",
    ),
    "forces.BevelGear": case(
        lambda z: call((20, 30), 2e-3, 0.35, 2.0, 0.5, 1e-4, 0.25, 1e-3),
        through=_through(_law(between=("arm", "hand"))),
        positive="module stiffness damping backlash transition",
    ),
    "forces.WormGear": case(
        lambda z: call(2, 30, 2e-3, 0.02, False, 0.35, 0.25, None, 2.0, 0.5, 1e-4, 0.25, 1e-3),
        "slip_speed none: deprecated",
        through=_through(_law(between=("arm", "hand"))),
        positive="module radius friction stiffness damping backlash transition",
    ),
    "forces.Attachment": case(lambda z: call("arm"), through=_through(_cable)),
    "forces.Winch": case(lambda z: call(("ground", (0.0, 0.0, 1.0)), "shoulder", 0.5), through=_through(_cable)),
    "forces.Eyelet": case(lambda z: call("arm", 0.5), through=_through(_cable), positive="friction"),
    "forces.Sheave": case(
        lambda z: call("arm", 0.5, "+", "z", 1, 0.25), through=_through(_cable), positive="radius friction"
    ),
    "forces.WrapCylinder": case(
        lambda z: call("arm", 0.5, "+", "z", 1, 0.25), through=_through(_cable), positive="radius friction"
    ),
    "forces.WrapSphere": case(
        lambda z: call("arm", 0.5, "+", "z", 0.25), through=_through(_cable), positive="radius friction"
    ),
    "forces.GeneralisedEffort": case(lambda z: call(lambda q, u, t: -u), through=_through(_law())),
    "forces.Force": on_body(lambda z: call(np.array([1.0, 2.0, 3.0]), "world")),
    "forces.Torque": on_body(lambda z: call(np.array([1.0, 2.0, 3.0]), "body")),
    "forces.Wrench": on_body(lambda z: call(lambda R, x, w, v, t: (0.0 * x, 0.0 * x))),
    "forces.Constant": signal(lambda z: call(0.5)),
    "forces.Ramp": signal(lambda z: call(0.5, 2.0)),
    "forces.Harmonic": signal(lambda z: call(0.5, 2.0, 3.0, 0.25)),
    "forces.Polynomial": signal(lambda z: call(np.array([1.0, 2.0])), f"coefficients shape: {MANY}"),
    "forces.Step": signal(lambda z: call(0.5, 2.0, 1.0, 3.0), positive="duration"),
    "forces.Trapezoid": signal(lambda z: call(0.5, 2.0, 1.0, 3.0, 0.25, 0.5), positive="speed acceleration jerk"),
    "forces.CamRise": signal(lambda z: call(0.5, 2.0, "3-4-5", 0.25, 1.0), positive="duration"),
    "forces.Chirp": signal(lambda z: call(0.5, 2.0, 1.0, 3.0, 0.25, 0.5, 4.0), positive="duration"),
    "forces.Multisine": signal(lambda z: call(np.array([1.0, 2.0]), 0.5, np.array([0.1, 0.2]), 0.25)),
    "forces.Spline": signal(lambda z: call(POINTS, EFFORTS, np.array([0.5, 1.0]))),
    "elements.Beam": element(
        lambda z: call(
            *(8.0, 4.0, 2.0, 1.0, 1.0, 2.0, 1.0, np.array([1.0, 1.0]), np.array([0.0, 1.0, 0.0])),
            *(np.zeros((2, 3)), ("rz1",), np.zeros((2, 2)), 0.5),
        ),
        "fibres *: matrices do not depend on it",
        positive="young shear_modulus area inertia_y inertia_z torsion density line_mass",
    ),
    "elements.Rod": element(lambda z: call(8.0, 2.0, 1.0), positive="young area density"),
    "elements.Triangle": element(lambda z: call(8.0, 0.25, 0.5, 1.0), positive="young thickness density"),
    "elements.Quadrilateral": element(
        lambda z: call(8.0, 0.25, 0.5, 1.0, 1.0, 0.5), positive="young thickness density"
    ),
    **{
        f"elements.{kind}": element(
            lambda z: call(8.0, 0.25, 1.0, np.eye(6)), "young shape: not used beside an elasticity"
        )
        for kind in (
            "Hexahedron",
            "QuadraticHexahedron",
            "Tetrahedron",
            "QuadraticTetrahedron",
            "Wedge",
            "QuadraticWedge",
        )
    },
    "elements.ShearPanel": element(lambda z: call(8.0, 0.5, 1.0), positive="shear_modulus thickness density"),
    "elements.QuadraticTriangle": element(lambda z: call(SECTION, 0.25, 0.5)),
    "elements.QuadraticQuadrilateral": element(lambda z: call(SECTION, 0.25, 0.5)),
    "elements.LayeredTriangle": element(lambda z: call(SECTION, 0.25)),
    "elements.LayeredQuadrilateral": element(lambda z: call(SECTION, 0.25, 0.5)),
    "elements.ShellSection": case(lambda z: call(np.eye(3), np.eye(3), np.eye(2), np.eye(3), 1.0, 0.5)),
    "elements.Laminate": case(
        lambda z: call(np.ones(2), np.ones(2), np.ones((2, 3, 3)), np.ones((2, 2, 2)), np.ones(2), 0.5, 1.0)
    ),
    "elements.orthotropic": case(lambda z: call(8.0, 2.0, 0.25, 1.0), "* shape: many plies at once"),
    "elements.tsai_wu_reserve": case(lambda z: call(np.ones(3), np.ones(5), 0.1), f"strengths inf: {NO_LIMIT}"),
    "elements.hill_reserve": case(lambda z: call(np.ones(3), np.ones(5)), f"strengths inf: {NO_LIMIT}"),
    "elements.Spring": element(lambda z: call(np.ones(6), np.ones(6), np.eye(3), 0.5)),
    "elements.GroundSpring": element(lambda z: call(np.ones(6), np.ones(6), np.eye(3))),
    "elements.PointMass": element(lambda z: call(2.0, np.array([1.0, 0.0, 0.0]), np.eye(3)), positive="value"),
    "rotations.from_quaternion": case(lambda z: call(np.array([0.5, 0.5, 0.5, 0.5]))),
    "rotations.from_vector": case(lambda z: call(np.array([0.1, 0.2, 0.3]))),
    "rotations.from_axis_angle": case(lambda z: call(AXIS, 0.3), "angle shape: leading axes go through"),
    "rotations.to_quaternion": case(lambda z: call(np.eye(3)[[1, 2, 0]])),
    "rotations.to_vector": case(lambda z: call(np.eye(3)[[1, 2, 0]])),
    "inertia.rod": case(lambda z: call(2.0, 3.0, AXIS), positive="length"),
    "inertia.box": case(lambda z: call(2.0, np.array([1.0, 2.0, 3.0])), positive="size"),
    "inertia.cylinder": case(lambda z: call(2.0, 1.0, 3.0, AXIS), positive="radius length"),
    "inertia.tube": case(lambda z: call(2.0, 1.0, 2.0, 3.0, AXIS), positive="inner_radius outer_radius length"),
    "inertia.sphere": case(lambda z: call(2.0, 1.0), positive="radius"),
    "inertia.spherical_shell": case(lambda z: call(2.0, 1.0), positive="radius"),
    "inertia.rotate": case(lambda z: call(np.array([1.0, 2.0, 2.0]), np.eye(3)[[1, 2, 0]])),
    "inertia.as_matrix": case(lambda z: call(np.array([1.0, 2.0, 2.0]))),
    "inertia.combine": case(lambda z: call([(2.0, np.array([1.0, 0.0, 0.0]), 0.0), (1.0, np.zeros(3), np.eye(3))])),
    "inertia.point": case(lambda z: call()),
    "model.Pose": case(
        lambda z: call(np.array([1.0, 2.0, 3.0]), np.eye(3)),
        "* nan: what the pose is for refuses it by name",
        "* inf: likewise",
    ),
    "flexible.ElasticBody": case(
        lambda z: call(
            inertia=z.frame.body.inertia,
            stiffness=z.frame.body.stiffness,
            damping=z.frame.body.damping,
            places=z.frame.body.places,
            interfaces=("a", "b"),
        ),
        "interfaces name: names are free",
        "interfaces number for a name: likewise",
        through=_through(lambda body: _elastic(body)),
    ),
}


def _elastic(body):
    b = mbs.SystemBuilder()
    b.elastic("beam", body)
    b.joint("pin", mbs.Revolute("y"), "ground", f"beam.{body.interfaces[0]}")
    return b.build()
