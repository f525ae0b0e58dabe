"""Examples of questions about vehicles."""

import functools

import jaxmbs as mbs
from jaxmbs.vehicles import RandomRoad
from tests.vehicles.test_suspensions import KINDS

from .attempts import call
from .cases import case
from .parts import PLAIN_TYRE, _law, _through

TRACKS = "words for tracks are free"


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
def rig():
    return mbs.vehicles.kc_rig(mbs.vehicles.trailing_arm(ARM, 0.25))


def _kind(name):
    return case(lambda z: call(KINDS[name], 0.25), positive="radius")


ARM = KINDS["trailing_arm"]
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
