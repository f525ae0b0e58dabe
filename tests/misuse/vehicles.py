"""Examples of questions about vehicles."""

import functools
import inspect

import numpy as np

import jaxmbs as mbs
from jaxmbs.vehicles import RandomRoad
from tests.vehicles.test_suspensions import KINDS

from .attempts import call
from .cases import case
from .parts import PLAIN_TYRE, _law, _through

TRACKS = "words for tracks are free"
CORNERS = ("front left", "front right", "rear left", "rear right")


@functools.cache
def quarter():
    """A quarter car on a driven road, linearised."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in ("plate", "wheel", "body"):
        b.body(name, mass=2.0)
    b.joint("road", mbs.Prismatic("z"), "ground", "plate", drive=mbs.forces.Constant(0.0))
    b.joint("tyre", mbs.Prismatic("z"), "plate", "wheel")
    b.joint("strut", mbs.Prismatic("z"), "wheel", "body")
    for name, damping in (("tyre", 0.5), ("strut", 2.0)):
        b.force(name, mbs.SpringDamper(stiffness=50.0, damping=damping), joint=name)
    system = b.build()
    return mbs.linearise(system, mbs.State.at(system), inputs=["road"], outputs=["tyre", "strut"])


@functools.cache
def on_posts():
    """Four masses on springs on posts, linearised."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in CORNERS:
        b.body(f"{name} post", mass=2.0)
        b.body(name, mass=2.0)
        b.joint(f"{name} post", mbs.Prismatic("z"), "ground", f"{name} post", drive=mbs.forces.Constant(0.0))
        b.joint(name, mbs.Prismatic("z"), f"{name} post", name)
        b.force(name, mbs.SpringDamper(stiffness=50.0, damping=2.0), joint=name)
    system = b.build()
    inputs = [f"{name} post" for name in CORNERS]
    return mbs.linearise(system, mbs.State.at(system), inputs=inputs, outputs=CORNERS)


@functools.cache
def rig():
    return mbs.vehicles.kc_rig(mbs.vehicles.trailing_arm(ARM, 0.25))


def _kind(name):
    return case(lambda z: call(KINDS[name], 0.25), positive="radius")


def _built(mount):
    """A function that mounts on a new builder with a chassis and two hubs, and builds it."""

    def mounted(*args, **options):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("chassis", mass=2.0, inertia=0.5)
        b.joint("chassis", mbs.Weld(), "ground", "chassis")
        for name in ("left", "right"):
            b.body(name, mass=2.0, inertia=0.5)
            b.joint(name, mbs.Revolute("y"), "chassis", name)
        parts = mount(b, *args, **options)
        return b.build(cut=parts.cut)

    whole = inspect.signature(mount)
    mounted.__signature__ = whole.replace(parameters=list(whole.parameters.values())[1:])
    return mounted


def _built_car(car):
    def built(*args, **options):
        return car(*args, **options)[0].build()

    built.__signature__ = inspect.signature(car)
    return built


def _followed(kind):
    """A class of drivers, of a car that is built with one."""

    def built(*args, **options):
        b = mbs.vehicles.SingleTrack(1e3, 1.5e3, 1.25, 1.5, PLAIN_TYRE, PLAIN_TYRE).builder(8.0)
        for axis in "xy":
            b.measure(axis, on="car", axis=axis)
        b.measure("heading", lambda at: at.coordinates["car"][2])
        b.block("driver", kind(*args, **options), reads=("x", "y", "heading"), drives="front axle.steer")
        return b.build()

    built.__signature__ = inspect.signature(kind)
    return built


def _axle(x):
    own = mbs.vehicles.trailing_arm(ARM, 0.25)
    tyre = mbs.vehicles.Tyre(PLAIN_TYRE)
    return mbs.vehicles.CarAxle(own, (x, 0.0, 0.0), (tyre, tyre), SPRING)


@functools.cache
def standing():
    """A suspension on a spring, its system, a state and its parts."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("chassis", mass=2.0, inertia=0.5)
    b.joint("chassis", mbs.Weld(), "ground", "chassis")
    parts = mbs.vehicles.mount_suspension(b, mbs.vehicles.trailing_arm(ARM, 0.25), "rear", "chassis", spring=SPRING)
    system = b.build()
    return system, mbs.State.at(system), parts


TIMES = np.arange(0.0, 2.125, 0.125)
RISING, FALLING = 1.0 - 0.5**TIMES, 0.5**TIMES
FREE_NAMES = "name name: names are free"
SPRING = mbs.SpringDamper(stiffness=50.0, damping=0.5)
BAR = {"M": (0.0, 0.25, 0.25), "E": (-0.25, 0.5, 0.25), "L": (-0.25, 0.5, 0.5)}
SOLID = {
    "AO": (0.0, 0.75, 0.25),
    "A": (0.5, 0.5, 0.25),
    "B": (0.0, 0.5, 0.25),
    "S": (0.0, 0.5, 1.0),
    "D": (0.0, 0.5, 0.5),
}
TWIST = {
    "P": (0.5, 0.5, 0.25),
    "B": (0.25, 0.5, 0.25),
    "AO": (0.0, 0.75, 0.25),
    "S": (0.0, 0.5, 1.0),
    "D": (0.0, 0.5, 0.5),
}
SECTION = mbs.forces.BeamSection((1e6, 1e6, 1e6, 1e3, 1e3, 1e3), 1.0, (0.5, 0.5, 0.5))
ARM = KINDS["trailing_arm"]
LIFE = mbs.fatigue.SN(1e6, 3.0)
MIX = {"rough": mbs.vehicles.RoadShare(RandomRoad(0.5), 2.0, 1.0)}
RECORDS = {"rough": mbs.vehicles.RoadRecord({"rod": np.cos(TIMES), "LF": np.ones((17, 3))}, 2.0, 1.0)}
CASES = {
    **{f"vehicles.{name}": _kind(name) for name in ("double_wishbone", "mcpherson", "five_link", "trailing_arm")},
    "vehicles.Suspension": case(
        lambda z: call(ARM, 0.25, mbs.vehicles.Strut("S", "D"), hinge=("P", "Q"), kingpin=None), positive="radius"
    ),
    "vehicles.kc_rig": case(lambda z: call(mbs.vehicles.trailing_arm(ARM, 0.25))),
    "vehicles.load_cases": case(
        lambda z: call(rig(), {"pothole": (3.0, 0.0, 1.0)}, "g", 4e3, 0.25, 0.125, "centre", {"P": ARM["P"]}),
        "cases name: names of cases are free",
        "hardpoints none: those of the suspension",
        positive="wheel_load",
    ),
    "vehicles.roll_curves": case(
        lambda z: call(rig(), 0.25, SPRING, {"P": ARM["P"]}),
        "hardpoints none: those of the suspension",
        "opposite sign: one wheel or the other is higher",
        "opposite array: curves over several",
    ),
    "vehicles.mount_suspension": case(
        lambda z: call(
            mbs.vehicles.trailing_arm(ARM, 0.25),
            "rear",
            "chassis",
            "left",
            (0.5, 0.0, 0.25),
            8.0,
            (0.5, 0.5, 0.5),
            2.0,
            SPRING,
        ),
        "spring none: without one",
        FREE_NAMES,
        "rack name: it has no tie rod",
        positive="mass arm_mass",
        through=_built,
    ),
    "vehicles.mount_wheel": case(
        lambda z: call("rear", "left", (0.0, 0.5, 0.25), 8.0, (0.5, 1.0, 0.5), None, (0.0, 1.0, 0.0), "ground"),
        "road name: it has no tyre",
        FREE_NAMES,
        positive="mass",
        through=_built,
    ),
    "vehicles.mount_solid_axle": case(
        lambda z: call(
            SOLID, {"link": ("A", "B")}, "rear", "chassis", 8.0, (0.5, 0.5, 0.5), SPRING, (0.5, 0.0, 0.25)
        ),
        "spring none: without one",
        FREE_NAMES,
        "links name: names of links are free",
        "hardpoints name: names of further points are free",
        positive="mass",
        through=_built,
    ),
    "vehicles.mount_twist_beam": case(
        lambda z: call(TWIST, SECTION, "rear", "chassis", 8.0, (0.5, 0.5, 0.5), SPRING, (0.5, 0.0, 0.25)),
        "spring none: without one",
        FREE_NAMES,
        positive="mass",
        through=_built,
    ),
    "vehicles.mount_anti_roll_bar": case(
        lambda z: call(BAR, 500.0, "bar", "chassis", "left", "right", (0.5, 0.0, 0.25), 2.0),
        FREE_NAMES,
        positive="stiffness mass",
        through=_built,
    ),
    "vehicles.mount_steering": case(
        lambda z: call("front", "chassis", (0.5, 0.0, 0.25), 4.0, 0.25, 8.0, 0.5, 0.25),
        FREE_NAMES,
        positive="mass stiffness damping",
        through=_built,
    ),
    "vehicles.mount_differential": case(
        lambda z: call("rear", "chassis", "left", "right", 4.0, 0.5, (0.5, 0.0, 0.25)),
        FREE_NAMES,
        positive="inertia",
        through=_built,
    ),
    "vehicles.car": case(
        lambda z: call(_axle(1.0), _axle(-1.5), 512.0, (0.0, 0.0, 0.5), (128.0, 256.0, 256.0), 0.0, 16.0, 9.75),
        positive="mass",
        through=_built_car,
    ),
    "vehicles.hardpoint_loads": case(lambda z: call(*standing(), "chassis")),
    "vehicles.linearise_hardpoints": case(lambda z: call(*standing()[:2], (), standing()[2], "chassis")),
    "vehicles.road_mix_damage": case(
        lambda z: call(quarter(), MIX, {"road": (0.5, 0.25)}, LIFE, 512.0, "dirlik", 0.5, 8.0),
        "mix name: names are free",
        positive="distance",
    ),
    "vehicles.road_records_damage": case(
        lambda z: call(RECORDS, LIFE, 512.0), "records name: names are free", positive="distance"
    ),
    "vehicles.four_post": case(
        lambda z: call(on_posts(), np.array([0.5, 2.0]), [f"{name} post" for name in CORNERS], ["heave", "roll"]),
        "posts none: those of a car",
        "frequencies shape: as many as are asked",
        positive="frequencies",
    ),
    "vehicles.post_heights": case(
        lambda z: call(TIMES, RISING, 2.0, {"front": (0.5, "left"), "rear": (-1.5, "left")}),
        "wheels name: names are free",
        positive="speed",
    ),
    "vehicles.step_steer_response": case(lambda z: call(TIMES, RISING, 0.5, 0.25, 0.125)),
    "vehicles.sine_steer_response": case(lambda z: call(TIMES, RISING, FALLING, 0.5)),
    "vehicles.slopes_over": case(lambda z: call(TIMES, RISING)),
    "vehicles.brake_in_turn": case(lambda z: call(TIMES, RISING, 8.0 + RISING, FALLING, 32.0, 0.5)),
    "vehicles.LaneChange": case(lambda z: call(1.75, 0.5, 3.25), positive="width"),
    "vehicles.ObstacleAvoidance": case(lambda z: call(1.75, 0.5, 1.25, 2.75), positive="width exit_width"),
    "vehicles.PathFollower": case(
        lambda z: call(mbs.vehicles.LaneChange(1.75), 2.5, 8.0, 1.5), positive="wheelbase preview", through=_followed
    ),
    "vehicles.BrakeTorque": case(lambda z: call(4.0, 0.5), positive="slow", through=_through(_law(joint="shoulder"))),
    "vehicles.CruiseControl": case(lambda z: call(4.0, 0.5), positive="gain", through=_through(_law(on="hand"))),
    "vehicles.AxleTyres": case(
        lambda z: call(PLAIN_TYRE, 4e3, 0.25, True),
        positive="load",
        through=_through(_law(between=("ground", "hand"))),
    ),
    "vehicles.SingleTrack": case(
        lambda z: call(1e3, 1.5e3, 1.25, 1.5, PLAIN_TYRE, PLAIN_TYRE, 0.5, 9.75),
        positive="mass yaw_inertia a b gravity",
        through=_through(lambda car: car.understeer_gradient(0.5)),
    ),
    "vehicles.RandomRoad": case(lambda z: call(0.5, 2.5), positive="level"),
    "vehicles.ride": case(
        lambda z: call(quarter(), RandomRoad(0.5), 2.0, {"road": (0.5, "left")}, 0.25, {"strut": "Wk"}),
        "wheels none: all in one place",
        "weightings none: no weighted outputs",
        positive="speed",
    ),
    "vehicles.wheel_inputs": case(
        lambda z: call(RandomRoad(0.5), 2.0, {"front": (0.5, 0.25), "rear": (-1.5, 0.25)}, 0.5, 8.0),
        f"wheels name: {TRACKS}",
        positive="speed",
    ),
    "vehicles.weighting": case(lambda z: call("Wk")),
}
