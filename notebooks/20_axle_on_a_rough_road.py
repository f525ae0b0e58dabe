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
# # A five-link axle on a rough road
#
# A transport machine: a frame that twists, a cab on mounts, and an axle of two wheels on five links each. It drives
# over a road of class C. What do the hardpoints carry, how long do the links live, and how light can they be while
# they live long enough and the wheels still point straight over their travel?

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import fatigue, vehicles, viz

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## The axle by its hardpoints
# Left wheel; x forwards, y outwards, z up [m]. Links 1 to 4 hold the wheel, link 5 is the toe link.

# %%
POINTS = {
    **{"I1": (0.40, 0.45, 0.42), "O1": (0.06, 0.86, 0.38), "I2": (-0.42, 0.45, 0.43), "O2": (-0.10, 0.86, 0.39)},
    **{"I3": (0.35, 0.50, 0.74), "O3": (0.04, 0.84, 0.72), "I4": (-0.30, 0.50, 0.74), "O4": (-0.08, 0.84, 0.72)},
    **{"I5": (-0.26, 0.42, 0.560), "O5": (-0.24, 0.86, 0.530)},
    **{"AI": (0.0, 0.84, 0.50), "AO": (0.0, 1.00, 0.50), "S": (0.02, 0.66, 1.00), "D": (0.02, 0.80, 0.44)},
}
POINTS = {name: jnp.array(x) for name, x in POINTS.items()}
LINKS = [f"link_{k}" for k in range(1, 6)]
MIRROR = np.array([1.0, -1.0, 1.0])
RADIUS, SPEED, LOAD = 0.50, 20.0, 20e3  # of the wheel [m]; [m/s]; on a wheel [N]
ROAD = vehicles.RandomRoad.of_class("C")
STEEL, YOUNG = 7850.0, 210e9

rig = vehicles.kc_rig(vehicles.five_link(POINTS, RADIUS))
travel = np.linspace(-0.08, 0.08, 9)
fig, ax = plt.subplots(figsize=(4.5, 3), layout="constrained")
ax.plot(1e3 * travel, np.rad2deg(rig.curves(travel).toe))
ax.set(xlabel="wheel travel [mm]", ylabel="toe [deg]")

# %% [markdown]
# ## The machine
# Links are bars with balls in rubber at their ends: springs along them, in series with the bar of their area. Two
# halves of the frame twist against each other; tyres stand on plates that the road moves.


# %%
def machine(design, like=None):
    """Frame, cab, two corners; `design`: areas of the links [cm^2] and the height of I5 [m]."""
    b, H = mbs.SystemBuilder(), hardpoints(design)
    b.body("frame", 3600.0, com=(0.0, 0.0, 1.1), inertia=(1400.0, 2500.0, 3000.0))
    b.body("slide", 1.0)
    b.joint("heave", mbs.Prismatic("z"), "ground", "slide")
    b.joint("roll", mbs.Revolute("x"), "slide", "frame", at=(0.0, 0.0, 0.9))
    b.body("front", 2500.0, com=(0.0, 0.0, 1.0), inertia=(1100.0, 2000.0, 2000.0))
    b.joint("twist", mbs.Revolute("x"), "frame", "front", at=(0.0, 0.0, 1.0))
    b.force("twist", mbs.SpringDamper(4e5, 4e3), joint="twist")
    b.body("cab", 600.0, com=(1.0, 0.0, 1.6), inertia=300.0)
    b.joint("cab", mbs.Prismatic("z"), "front", "cab")
    b.force("cab mounts", mbs.SpringDamper(1.2e5, 7e3, preload=600.0 * 9.81), joint="cab")
    b.force("front axle", mbs.SpringDamper(2.5e5, 1.5e4, preload=6700.0 * 9.81 - 2 * LOAD), joint="heave")
    b.force("front roll", mbs.Bushing((0, 0, 0, 1.2e5, 0, 0), (0, 0, 0, 8e3, 0, 0)), between=("ground", "front"))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        corner(b, {name: x * jnp.array([1.0, sign, 1.0]) for name, x in H.items()}, side, design["area"])
    return b.build(like=like)


def corner(b, H, side, area):
    """An upright with its wheel on five elastic links, a spring and a tyre."""
    upright, plate = f"{side} upright", f"{side} plate"
    b.body(upright, 180.0, com=H["AO"], inertia=(9.0, 14.0, 9.0))
    b.joint(f"{side} float", mbs.Free(), "ground", upright)
    b.body(plate, 1.0)
    b.joint(f"{side} road", mbs.Prismatic("z"), "ground", plate, drive=mbs.forces.Constant(0.0))
    for k, name in enumerate(LINKS):
        length = jnp.linalg.norm(H[f"I{k + 1}"] - H[f"O{k + 1}"])
        stiffness = 1.0 / (1.0 / 1.5e7 + length / (YOUNG * 1e-4 * area[k]))
        ends = ("frame", H[f"I{k + 1}"]), (upright, H[f"O{k + 1}"])
        b.force(f"{side} {name}", mbs.SpringDamper(stiffness, 2e-4 * stiffness, length), between=ends)
        b.measure(f"{side} {name}", force=f"{side} {name}")
    length = jnp.linalg.norm(H["S"] - H["D"])
    b.force(
        f"{side} spring", mbs.SpringDamper(1.6e5, 9e3, length + 0.13), between=(("frame", H["S"]), (upright, H["D"]))
    )
    foot = H["AO"] * jnp.array([1.0, 1.0, 0.0])
    b.force(
        f"{side} tyre", mbs.SpringDamper(8e5, 8e2, RADIUS + LOAD / 8e5), between=((plate, foot), (upright, H["AO"]))
    )
    for what in ("spring", "tyre"):
        b.measure(f"{side} {what}", force=f"{side} {what}")


def hardpoints(design):
    return POINTS | {"I5": POINTS["I5"].at[2].set(design["height"])}


FIRST = {"area": jnp.full(5, 5.0), "height": jnp.asarray(0.560)}
like = machine(FIRST)
start = mbs.equilibrium(like, mbs.State.at(like))
print(start.ok, like.topology.mobility, "freedoms")

# %% [markdown]
# ## Spectra of every hardpoint, and lives of the links
# The linearised machine on both tracks of the road, coherent as on a surface. A link's stress is its force over its
# area; its damage follows from the spectrum (Dirlik).

# %%
OUT = [f"left {name}" for name in (*LINKS, "spring", "tyre")]
TRACKS = {"left road": (0.0, 1.0), "right road": (0.0, -1.0)}
CURVE = fatigue.SN(1e12, 5.0)  # of amplitudes [MPa], with the notch of a weld
HOURS = 3600.0


class Moments:
    """Moments of the spectrum of one stress."""

    def __init__(self, values):
        self.values = values

    def moments(self, orders):
        return self.values[np.array([(0, 1, 2, 4).index(n) for n in orders])]


def ride(design):
    """Random response of the machine in its rest."""
    system = machine(design, like=like)
    rest = mbs.equilibrium(system, start.state)
    linear = mbs.linearise(system, rest.state, inputs=list(TRACKS), outputs=OUT)
    inputs, coherence = vehicles.wheel_inputs(ROAD, SPEED, TRACKS, 0.3, 60.0)
    return mbs.random_response(linear, inputs, coherence=coherence)


def values(design):
    """Mass of the links of a side [kg], logarithm of their lives [h], and largest change of the toe [deg]."""
    H, response = hardpoints(design), ride(design)
    lengths = jnp.stack([jnp.linalg.norm(H[f"I{k}"] - H[f"O{k}"]) for k in range(1, 6)])
    stress = response.moments[:5] / (1e2 * design["area"][:, None]) ** 2  # N^2 to MPa^2
    damage = jax.vmap(lambda row: fatigue.spectral_damage(Moments(row), CURVE))(stress)
    toe = rig.curves(travel, hardpoints={"I5": H["I5"]}).toe
    change = jnp.rad2deg(toe - toe[len(travel) // 2])
    return jnp.sum(STEEL * 1e-4 * design["area"] * lengths), {"life": -jnp.log10(damage * HOURS), "toe": change}


before = mbs.jit(ride, compile="quick")(FIRST)
print(before)
f = np.geomspace(0.3, 60.0, 300)
fig, ax = plt.subplots(figsize=(6, 4), layout="constrained")
viz.plot_psd(before, f, OUT, ax=ax)
mass, numbers = mbs.jit(values, compile="quick")(FIRST)
print(f"links of a side {float(mass):.2f} kg; lives", [f"{10 ** float(x):.3g} h" for x in numbers["life"]])

# %% [markdown]
# ## As light as life and toe allow
# Every link lives 2000 h on this road; toe changes by at most 0.45 degrees over 80 mm of travel, both ways.

# %%
LIMITS = [
    mbs.Limit("life [log h]", "life", lower=np.log10(2000.0)),
    mbs.Limit("toe [deg]", "toe", lower=-0.45, upper=0.45),
]
best = mbs.minimise(
    values,
    FIRST,
    bounds={"area": (jnp.full(5, 1.0), jnp.full(5, 15.0)), "height": (0.5, 0.62)},
    limits=LIMITS,
    steps=2 if FAST else 60,
    tolerance=1e-3,
    compile="quick",
    progress=False,
)
print(best.table())
light, held = mbs.jit(values, compile="quick")(best.design)
print(f"{float(mass):.2f} kg, then {float(light):.2f} kg; areas", np.round(best.design["area"], 2), "cm^2")
assert FAST or (best.ok and light < mass)
toes = [rig.curves(travel, hardpoints={"I5": hardpoints(d)["I5"]}).toe for d in (FIRST, best.design)]
fig, ax = plt.subplots(figsize=(4.5, 3), layout="constrained")
for toe, label in zip(toes, ("first", "best"), strict=True):
    ax.plot(1e3 * travel, np.rad2deg(toe), label=label)
ax.set(xlabel="wheel travel [mm]", ylabel="toe [deg]")
ax.legend()
