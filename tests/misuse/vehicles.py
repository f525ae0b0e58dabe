"""Examples of questions about vehicles."""

import functools

import jaxmbs as mbs
from jaxmbs.vehicles import RandomRoad

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


CASES = {
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
