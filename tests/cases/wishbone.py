"""The double wishbone of V1 and V2: an upright on links, or on rigid arms; the wheel centre is led by a frame path.

Lengths in m.  Members are massless rods, the strut is a slide whose effort holds the wheel against the load.
"""

import jax.numpy as jnp

import jaxmbs as mbs

RADIUS = 0.3136
LINKS = {"lower_front": "LF LO", "lower_rear": "LR LO", "upper_front": "UF UO", "upper_rear": "UR UO"}
UP = jnp.array([0.0, 0.0, 1.0])


def suspension(H, arms=False, travel=0.0, rack=0.0, force=None, place="AO", like=None):
    """The mechanism of hardpoints H [m] with its wheel centre led to a travel [m], the rack moved [m].

    Args: arms: whether rigid arms carry the upright, else links; force (3,) [N] on the upright at `place`, a hard
    point or a point of its frame at design.
    """
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("upright", 1.0, com=H["AO"], inertia=0.1)
    b.joint("float", mbs.Free(), "ground", "upright")
    place = H[place] if isinstance(place, str) else place
    zero = jnp.zeros(3) if force is None else jnp.asarray(force, float)
    b.force("load", mbs.Force(zero), on=("upright", place))
    _rod(b, "tie_rod", H, ("ground", "TI"), ("upright", "TO"), moved=jnp.stack([0.0, 1.0, 0.0]) * rack)
    if arms:
        for arm, points in (("lower", "LF LR LO"), ("upper", "UF UR UO")):
            front, rear, ball = points.split()
            b.body(arm, 1.0, com=H[ball], inertia=0.1)
            for name, first, second in ((front, "ground", arm), (rear, "ground", arm), (ball, arm, "upright")):
                b.joint(name, mbs.Spherical(), first, second, at=H[name])
    else:
        for name, ends in LINKS.items():
            inner, outer = ends.split()
            _rod(b, name, H, ("ground", inner), ("upright", outer))
    _strut(b, H, *(("lower", "D") if arms else ("upright", "LO")))
    height = H["AO"][2] + travel
    lead = mbs.joints.FramePath(height * UP, hold=("z",))
    b.constraint("travel", lead, between=("ground", ("upright", H["AO"])))
    return b.build(like=like, cut=["strut_foot", *(("LR", "LO", "UR", "UO") if arms else ())])


def _rod(b, name, H, inner, outer, moved=0.0):
    length = jnp.linalg.norm(H[inner[1]] - H[outer[1]])
    b.constraint(
        name, mbs.joints.Distance(length), between=((inner[0], H[inner[1]] + moved), (outer[0], H[outer[1]]))
    )


def _strut(b, H, body, foot):
    """A tube and a rod, sliding in each other, from S to a foot."""
    along = H[foot] - H["S"]
    x = along / jnp.linalg.norm(along)
    y = jnp.cross(x, jnp.array([1.0, 0.0, 0.0]))
    y = y / jnp.linalg.norm(y)
    axes = jnp.stack([x, y, jnp.cross(x, y)], axis=1)
    for part in ("tube", "rod"):
        b.body(part, 1.0, inertia=0.1)
    b.joint("strut_top", mbs.Universal(("y", "z")), "ground", "tube", parent_frame=mbs.Pose(H["S"], axes))
    b.joint("strut", mbs.Prismatic("x"), "tube", "rod")
    there = jnp.stack([1.0, 0.0, 0.0]) * jnp.linalg.norm(along)
    b.joint("strut_foot", mbs.Spherical(), "rod", body, parent_frame=there, child_frame=H[foot])


def contact(H, system, state):
    """Lowest point of the wheel, in the upright's axes at design."""
    R, origin = mbs.rotation(system, state, "upright"), mbs.position(system, state, "upright")
    axle = R @ (H["AO"] - H["AI"])
    axle = axle / jnp.linalg.norm(axle)
    down = axle * axle[2] - UP
    patch = mbs.position(system, state, ("upright", H["AO"])) + RADIUS * down / jnp.linalg.norm(down)
    return R.T @ (patch - origin)


def curves(H, system, state):
    """Camber, toe, caster, kingpin inclination [deg]; wheel centre and contact point [m]."""
    at = lambda point: mbs.position(system, state, ("upright", point))
    axle, pin = at(H["AO"]) - at(H["AI"]), at(H["UO"]) - at(H["LO"])
    slopes = jnp.stack(
        [-axle[2] / jnp.hypot(axle[0], axle[1]), axle[0] / axle[1], -pin[0] / pin[2], -pin[1] / pin[2]]
    )
    return jnp.rad2deg(jnp.arctan(slopes)), jnp.concatenate([at(H["AO"]), at(contact(H, system, state))])


def tension(H, loads, state, system, name):
    """Force of a rod on the upright, positive towards its inner end [N]."""
    inner, outer = (LINKS | {"tie_rod": "TI TO"})[name].split()
    along = H[inner] - mbs.position(system, state, ("upright", H[outer]))
    return jnp.dot(loads[name].force, along) / jnp.linalg.norm(along)
