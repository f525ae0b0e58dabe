# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A double wishbone from its hardpoints
#
# A table of hardpoints gives a suspension. How do camber, toe and scrub radius change over wheel travel? What do the
# tie rod, the strut and the pick-ups carry when the wheel brakes, corners or meets a kerb? How much do the bushings
# give? And which hardpoints make bump steer vanish, while the tie rod and the steering stay within limits?

# %%
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## The hardpoints
# Left wheel; x forwards, y outwards, z up [m]. `F` and `R` are the front and rear pick-ups of the lower (`L`) and
# upper (`U`) arm, `O` their balls; `TI`, `TO` the ends of the tie rod; `AI`, `AO` two points of the axle, `AO` the
# wheel centre; the strut goes from `S` on the body to `D` on the lower arm.

# %%
POINTS = {
    **{"LF": (0.250, 0.400, 0.200), "LR": (-0.250, 0.450, 0.200), "LO": (0.000, 0.900, 0.200)},
    **{"UF": (0.225, 0.350, 0.500), "UR": (-0.275, 0.350, 0.500), "UO": (-0.025, 0.750, 0.500)},
    **{"TI": (0.050, 0.200, 0.250), "TO": (0.150, 0.800, 0.275)},
    **{"AI": (-0.020, 0.800, 0.308426), "AO": (-0.020, 0.950, 0.313426)},
    **{"S": (0.000, 0.650, 0.600), "D": (0.010, 0.740, 0.215)},
}
POINTS = {name: jnp.array(x) for name, x in POINTS.items()}
RADIUS, UP = 0.3136, jnp.array([0.0, 0.0, 1.0])
AXES = jnp.eye(3)


def bodies(b, H):
    """Upright and arms; they stand in the world frame at design, so that hardpoints are points of bodies too."""
    b.body("upright", 20.0, com=H["AO"], inertia=0.5)
    for arm, (front, rear, ball) in {"lower": ("LF", "LR", "LO"), "upper": ("UF", "UR", "UO")}.items():
        b.body(arm, 4.0, com=(H[front] + H[rear] + H[ball]) / 3.0, inertia=0.1)
    b.joint("float", mbs.Free(), "ground", "upright")


def suspension(H, travel=0.0, rack=0.0, force=(0.0, 0.0, 0.0), place=None, like=None):
    """Rigid arms in balls; the wheel centre is led to a travel [m]; a force [N] at a place of the upright."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    bodies(b, H)
    for arm, points in {"lower": ("LF", "LR", "LO"), "upper": ("UF", "UR", "UO")}.items():
        for name, (first, second) in zip(points, (("ground", arm), ("ground", arm), (arm, "upright")), strict=True):
            b.joint(name, mbs.Spherical(), first, second, at=H[name])
    tie = mbs.joints.Distance(jnp.linalg.norm(H["TO"] - H["TI"]))
    b.constraint("tie rod", tie, between=(("ground", H["TI"] + rack * AXES[1]), ("upright", H["TO"])))
    strut(b, H)
    lead = mbs.joints.FramePath((H["AO"][2] + travel) * UP, hold=("z",))
    b.constraint("travel", lead, between=("ground", ("upright", H["AO"])))
    b.force("road", mbs.Force(jnp.asarray(force, float)), on=("upright", H["AO"] if place is None else place))
    return b.build(like=like, cut=["foot", "LR", "LO", "UR", "UO"])


def strut(b, H):
    """A tube and a rod that slide in each other."""
    along = H["D"] - H["S"]
    x = along / jnp.linalg.norm(along)
    y = jnp.cross(x, AXES[0]) / jnp.linalg.norm(jnp.cross(x, AXES[0]))
    for part in ("tube", "rod"):
        b.body(part, 2.0, inertia=0.05)
    axes = jnp.stack([x, y, jnp.cross(x, y)], axis=1)
    b.joint("top", mbs.Universal(("y", "z")), "ground", "tube", parent_frame=mbs.Pose(H["S"], axes))
    b.joint("strut", mbs.Prismatic("x"), "tube", "rod")
    foot = jnp.linalg.norm(along) * AXES[0]
    b.joint("foot", mbs.Spherical(), "rod", "lower", parent_frame=foot, child_frame=H["D"])


first = suspension(POINTS)
print(first.describe().splitlines()[1])

# %% [markdown]
# ## Camber, toe, scrub radius
# `FramePath` leads the wheel centre; `State.at` closes the loops. All poses are one program.


# %%
def pose(H, travel, rack=0.0):
    """(state, curves): camber and toe [deg], scrub radius [mm], and the contact point from the upright's origin."""
    system = suspension(H, travel, rack, like=first)
    state = mbs.State.at(system)
    at = lambda point: mbs.position(system, state, ("upright", H[point]))
    axle = at("AO") - at("AI")
    axle = axle / jnp.linalg.norm(axle)
    down = axle * axle[2] - UP
    patch = at("AO") + RADIUS * down / jnp.linalg.norm(down)
    pin = at("UO") - at("LO")
    pivot = at("LO") + pin * (patch[2] - at("LO")[2]) / pin[2]  # of the steering axis, on the road
    camber, toe = -jnp.arcsin(axle[2]), jnp.arctan2(axle[0], axle[1])
    place = mbs.rotation(system, state, "upright").T @ (patch - mbs.position(system, state, "upright"))
    return state, (jnp.rad2deg(camber), jnp.rad2deg(toe), 1e3 * (patch[1] - pivot[1])), place


travels = jnp.linspace(-0.06, 0.06, 25)
poses = mbs.jit(jax.vmap(pose, (None, 0)), compile="quick")  # run a few times: compiled in half the time
states, curves, patches = poses(POINTS, travels)
print(f"camber {float(curves[0][0]):.6f} deg at -60 mm")  # case V1 of the tests: -1.947872
fig, axes = plt.subplots(1, 3, figsize=(9, 2.8), layout="constrained")
for ax, curve, label in zip(axes, curves, ("camber [deg]", "toe [deg]", "scrub radius [mm]"), strict=True):
    ax.plot(1e3 * travels, curve)
    ax.set_xlabel("wheel travel [mm]")
    ax.set_title(label)

# %% [markdown]
# ## Loads of members and pick-ups
# Seven load cases. The strut is named as the actuator: its effort holds the wheel, and what led the wheel centre is
# taken away. What each pick-up takes along the hinge axis of its arm is not determined by statics; two equal balls
# share it.

# %%
CASES = {  # [N], at the contact point, or at the wheel centre
    "vertical": ((0.0, 0.0, 4000.0), True),
    "bump": ((0.0, 0.0, 12000.0), True),
    "braking": ((-4500.0, 0.0, 5500.0), True),
    "cornering": ((0.0, -4800.0, 5200.0), True),
    "brake, corner": ((-2000.0, 3000.0, 4000.0), True),
    "drive": ((3000.0, 0.0, 4200.0), False),
    "kerb": ((-3000.0, -1500.0, 6000.0), True),
}
PICKUPS = ("LF", "LR", "UF", "UR")


def carried(H, state, patch, force, at_contact):
    """Tension of the tie rod, force of the strut, forces (4,) at the pick-ups [kN] in a state."""
    system = suspension(H, force=force, place=jnp.where(at_contact, patch, H["AO"]), like=first)
    still = jnp.zeros(15)  # quasi-static
    loads = mbs.reactions(system, state, accelerations=still, actuators=["strut"])
    along = H["TI"] - mbs.position(system, state, ("upright", H["TO"]))
    tie = jnp.dot(loads["tie rod"].force, along) / jnp.linalg.norm(along)
    pickups = jnp.stack([jnp.linalg.norm(loads[name].force) for name in PICKUPS])
    return jnp.concatenate([jnp.stack([tie, loads["strut"].effort[0]]), pickups]) / 1e3


forces, places = (jnp.array(part) for part in zip(*CASES.values(), strict=True))
middle = jax.tree.map(lambda x: x[12], (states, patches))  # at design
table = mbs.jit(jax.vmap(lambda *case: carried(POINTS, *middle, *case)), compile="quick")(forces, places)
print(f"{'[kN]':15}" + "".join(f"{name:>9}" for name in ("tie rod", "strut", *PICKUPS)))
for name, row in zip(CASES, table, strict=True):
    print(f"{name:15}" + "".join(f"{x:9.2f}" for x in row))

# %% [markdown]
# ## Compliance
# The pick-ups sit in rubber, the strut is a spring. `stiffness` is that of the whole mechanism about the design
# position; with the influence coefficients J of the contact point, `J K^-1 J^T` is what the wheel gives per force and
# moment there.


# %%
def bushed(H):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    bodies(b, H)
    for arm, ball in (("lower", "LO"), ("upper", "UO")):
        b.joint(ball, mbs.Spherical(), "upright", arm, at=H[ball])
        for name in PICKUPS:
            if name[0] == ball[0]:
                rubber = mbs.Bushing(stiffness=(2e6, 50.0), damping=(2e3, 0.05))
                b.force(name, rubber, between=(("ground", H[name]), (arm, H[name])))
    tie = mbs.joints.Distance(jnp.linalg.norm(H["TO"] - H["TI"]))
    b.constraint("tie rod", tie, between=(("ground", H["TI"]), ("upright", H["TO"])))
    spring = mbs.SpringDamper(60e3, free_length=jnp.linalg.norm(H["D"] - H["S"]))
    b.force("spring", spring, between=(("ground", H["S"]), ("lower", H["D"])))
    return b.build()


soft = bushed(POINTS)
design = mbs.State.at(soft)
coefficients = mbs.constraints.kic(soft, design)  # of the upright: turning, and sliding at its centre of mass
turning, sliding = (np.asarray(part["upright"]) for part in (coefficients.rotational, coefficients.translational))
arm = np.asarray(patches[12] - POINTS["AO"])
J = np.concatenate([sliding + np.cross(turning, arm, axis=0), turning])
stiffness = mbs.jit(mbs.stiffness, compile="quick")(soft, design).total
compliance = J @ np.linalg.solve(stiffness, J.T)
for name in ("braking", "cornering"):
    give = compliance[:, :2] @ CASES[name][0][:2]
    toe, camber = -np.rad2deg(give[5]), np.rad2deg(give[3])
    print(
        f"{name}: contact point {1e3 * give[0]:.2f}, {1e3 * give[1]:.2f} mm; toe {toe:.3f}, camber {camber:.3f} deg"
    )

# %% [markdown]
# ## No bump steer, within limits
# Four coordinates of the tie rod's ends; the objective is little toe over travel; the tie rod may carry 3 kN in
# "brake and corner", and 10 mm of the rack have to steer at least 3.2 degrees.


# %%
def moved(design):
    return POINTS | {name: POINTS[name] + jnp.concatenate([jnp.zeros(1), design[name]]) for name in ("TI", "TO")}


def bump_steer(design):
    """Mean square of toe over travel [deg^2], and what has limits."""
    H = moved(design)
    travel, rack = jnp.array([-0.05, -0.025, 0.0, 0.025, 0.05, 0.0]), jnp.array([0.0, 0.0, 0.0, 0.0, 0.0, -0.01])
    states, (_, toe, _), patches = jax.vmap(lambda *x: pose(H, *x))(travel, rack)
    middle = jax.tree.map(lambda x: x[2], (states, patches))
    force, at_contact = CASES["brake, corner"]
    tie = carried(H, *middle, jnp.array(force), jnp.array(at_contact))[0]
    return jnp.mean((toe[:5] - toe[2]) ** 2), {"tie rod": tie, "steering": toe[5] - toe[2]}


reach = (-0.03, 0.03)  # [m]
best = mbs.minimise(
    bump_steer,
    {"TI": np.zeros(2), "TO": np.zeros(2)},
    {"TI": reach, "TO": reach},
    limits=[
        mbs.Limit("tie rod [kN]", "tie rod", upper=3.0, lower=-3.0),
        mbs.Limit("steering [deg]", "steering", lower=3.45),
    ],
    gradient="forward",
    compile="quick",
    steps=40,
    progress=False,
)
print(best.table())

# %%
after = poses(moved(best.design), travels)[1][1]
fig, ax = plt.subplots(figsize=(5, 3), layout="constrained")
ax.plot(1e3 * travels, curves[1], label="before")
ax.plot(1e3 * travels, after, label="after")
ax.set_xlabel("wheel travel [mm]")
ax.set_ylabel("toe [deg]")
ax.legend()
