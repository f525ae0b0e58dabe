"""The double wishbone of `batch_of_motions.py`: an upright on six two-force members, cases V1 and V2.

Five rods leave the upright one freedom; the travel of the wheel centre fixes it.  At each pose the strut is the
sixth rod, and statics alone determines the forces of all six.
"""

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

POINTS = {  # hardpoints at design [m]: x forwards, y outwards, z up
    "LF": (0.25, 0.4, 0.2),
    "LR": (-0.25, 0.45, 0.2),
    "LO": (0.0, 0.9, 0.2),
    "UF": (0.225, 0.35, 0.5),
    "UR": (-0.275, 0.35, 0.5),
    "UO": (-0.025, 0.75, 0.5),
    "TI": (0.05, 0.2, 0.25),
    "TO": (0.15, 0.8, 0.275),
    "AI": (-0.02, 0.8, 0.308426),
    "AO": (-0.02, 0.95, 0.313426),
    "S": (0.0, 0.65, 0.6),
}
RODS = {
    "lower front": "LF LO",
    "lower rear": "LR LO",
    "upper front": "UF UO",
    "upper rear": "UR UO",
    "tie rod": "TI TO",
}
RADIUS = 0.3136
LOAD = (-2000.0, 3000.0, 4000.0)  # "brake and corner" at the contact point [N]
TRAVELS = np.linspace(-0.06, 0.06, 61)
TENSIONS = {  # case V2, tension [N] of the five rods and the strut by travel [m]
    -0.03: (9266.580209990883, 1507.8506773161027, -3062.755373560788, 86.53502511087898, -1553.26953808768710),
    0.0: (9131.370957850424, 1435.8698738413257, -2964.746997989757, 111.71271302834118, -1486.4649807904184),
    0.05: (8955.26583483412, 1349.2052370477602, -2842.510844574037, 140.97555142420433, -1405.6244610715953),
}
STRUT = {-0.03: -5065.686858697157, 0.0: -4788.973965366512, 0.05: -4317.357219227832}


def table(number, seed=0):
    """Hardpoints (number, 3) within 10 mm of the design."""
    random = np.random.default_rng(seed)
    return {name: np.array(x) + random.uniform(-0.01, 0.01, (number, 3)) for name, x in POINTS.items()}


def _upright(points, b):
    """The upright on a chain of slides and a ball at the wheel centre, with its five rods."""
    carriers = ("ground", "up", "out", "front")
    for below, name, axis in zip(carriers, carriers[1:], "zyx", strict=False):
        b.body(name, mass=1.0)
        place = points["AO"] if below == "ground" else None
        b.joint(f"slide {axis}", mbs.Prismatic(axis), below, name, parent_frame=place)
    b.body("upright", mass=1.0, inertia=(1.0, 1.0, 1.0))
    b.joint("ball", mbs.Spherical(), "front", "upright")
    for name, ends in RODS.items():
        inner, outer = (points[end] for end in ends.split())
        length = jnp.linalg.norm(outer - inner)
        b.constraint(
            name, mbs.joints.Distance(length), between=(("ground", inner), ("upright", outer - points["AO"]))
        )


def free(points, like=None):
    """The upright on five rods, its travel open."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    _upright(points, b)
    return b.build(like=like)


def loaded(points, length, place, force=LOAD, like=None):
    """As `free`, with the strut of a given length and a force [N] at a point of the upright."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    _upright(points, b)
    ends = (("ground", points["S"]), ("upright", points["LO"] - points["AO"]))
    b.constraint("strut", mbs.joints.Distance(length), between=ends)
    b.force("load", mbs.Force(force), on=("upright", place))
    return b.build(like=like)


_DESIGN = {name: jnp.asarray(x) for name, x in POINTS.items()}
FREE = free(_DESIGN)
LOADED = loaded(_DESIGN, jnp.linalg.norm(_DESIGN["S"] - _DESIGN["LO"]), jnp.array([0.0, 0.0, -RADIUS]))


def pose(points, travel):
    """State, rotation (3, 3) of the upright and place (3,) of the wheel centre at a travel of it [m]."""
    system = free(points, like=FREE)
    state = mbs.State.at(system, {"slide z": travel})
    return state, mbs.rotation(system, state, "upright"), mbs.position(system, state, "upright")


def contact(points, R):
    """Lowest point of the wheel from its centre (3,), world axes."""
    axle = R @ (points["AO"] - points["AI"])
    axle = axle / jnp.linalg.norm(axle)
    down = axle * axle[2] - jnp.array([0.0, 0.0, 1.0])
    return RADIUS * down / jnp.linalg.norm(down)


def tensions(points, travel, force=LOAD, at_contact=1.0):
    """Tensions (6,) [N] of the rods and the strut at a travel of the wheel centre [m], under a force (3,) [N] at the
    contact point, or at the wheel centre where `at_contact` is 0."""
    state, R, centre = pose(points, travel)
    place = at_contact * (R.T @ contact(points, R))
    length = jnp.linalg.norm(centre + R @ (points["LO"] - points["AO"]) - points["S"])
    loads = mbs.reactions(loaded(points, length, place, force, like=LOADED), state, frame="world")
    return jnp.stack([_tension(points, loads, name, R, centre) for name in (*RODS, "strut")])


def _tension(points, loads, name, R, centre):
    """Force [N] of a rod on the upright, positive towards the ground's end."""
    inner, outer = (points[end] for end in (RODS | {"strut": "S LO"})[name].split())
    along = inner - (centre + R @ (outer - points["AO"]))
    return jnp.dot(loads[name].force, along) / jnp.linalg.norm(along)


def study(travels=TRAVELS):
    """Function of hardpoints to the tensions (travels, 6) [N]."""
    return lambda points: jax.vmap(lambda travel: tensions(points, travel))(jnp.asarray(travels))


def check():
    """Largest difference [N] from the tensions of case V2."""
    found = jax.jit(study(list(TENSIONS)))(_DESIGN)
    return float(np.abs(found - np.array([(*TENSIONS[t], STRUT[t]) for t in TENSIONS])).max())
