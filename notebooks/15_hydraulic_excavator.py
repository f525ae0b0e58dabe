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
# # An excavator on its valves
#
# The excavator of notebook 11, eleven bodies in four loops, now moves by its oil: three cylinders, three valves, a
# pump and a relief valve. A controller raises the boom. Which gains, and which orifice in the boom's line, follow the
# wanted path best, without more load on the pin and more pressure than allowed?

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import blocks, forces, hydraulics

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## The machine
# As in notebook 11. A cylinder is a barrel, a rod and the slide between them; its coordinate is the distance of its
# pins.

# %%
PIN, ROD = mbs.Revolute("z"), mbs.inertia.rod
PLACES = {  # of the cylinders' pins [m]: foot and eye
    "boom_cyl": ((0.5, 0.9), (2.3, 0.45)),
    "stick_cyl": ((2.6, 0.85), (-0.75, 0.25)),
    "bucket_cyl": ((0.1, 0.55), (0.5, 0.0)),
}
CARRIERS = {"boom_cyl": ("ground", "boom"), "stick_cyl": ("boom", "stick"), "bucket_cyl": ("stick", "rocker")}
CYLINDERS = tuple(PLACES)


def machine():
    """Bodies and joints."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("boom", mass=1800.0, com=(2.6, 0.35, 0), inertia=ROD(1800.0, 5.2))
    b.body("stick", mass=900.0, com=(0.9, 0.1, 0), inertia=ROD(900.0, 3.6))
    b.body("bucket", mass=800.0, com=(0.6, -0.35, 0), inertia=250.0)
    b.body("rocker", mass=60.0, com=(0.25, 0, 0), inertia=ROD(60.0, 0.5))
    b.body("link", mass=50.0, com=(0.28, 0, 0), inertia=ROD(50.0, 0.56))
    b.joint("boom_pin", PIN, "ground", "boom", parent_frame=(0, 1.5, 0))
    b.joint("stick_pin", PIN, "boom", "stick", parent_frame=(5.2, 0, 0))
    b.joint("bucket_pin", PIN, "stick", "bucket", parent_frame=(2.7, 0, 0))
    b.joint("rocker_pin", PIN, "stick", "rocker", parent_frame=(2.3, 0.02, 0))
    b.joint("knuckle", PIN, "rocker", "link", parent_frame=(0.5, 0, 0))
    b.joint("link_pin", PIN, "link", "bucket", parent_frame=(0.56, 0, 0), child_frame=(0.05, 0.42, 0))
    for name, (on, to) in CARRIERS.items():
        foot, eye = PLACES[name]
        b.body(f"{name}_barrel", mass=120.0, com=(0.8, 0, 0), inertia=ROD(120.0, 1.6))
        b.body(f"{name}_rod", mass=72.0, com=(-0.8, 0, 0), inertia=ROD(72.0, 1.6))
        b.joint(f"{name}_foot", PIN, on, f"{name}_barrel", parent_frame=(*foot, 0))
        b.joint(name, mbs.Prismatic("x"), f"{name}_barrel", f"{name}_rod")
        b.joint(f"{name}_eye", PIN, f"{name}_rod", to, child_frame=(*eye, 0))
    return b


# %% [markdown]
# ## The oil
# The pump fills the supply, the relief valve limits its pressure. Each cylinder hangs on a four-way valve. Between
# the boom's valve and its cylinder there is a hose, and an orifice. A PI controller sees the boom's angle and moves
# the boom's spool; the other two spools move as told.

# %%
SIZES = {  # of the cylinders: areas [m^2] and volumes [m^3]
    "boom_cyl": ((2.3e-2, 1.3e-2), (2.5e-2, 1e-2)),
    "stick_cyl": ((1.5e-2, 0.85e-2), (1.5e-2, 1e-2)),
    "bucket_cyl": ((1.2e-2, 0.7e-2), (1.2e-2, 0.8e-2)),
}
WANTED = mbs.Step(0.2, 1.4, 0.33, 0.47)  # boom's angle [rad]
SPOOLS = {"stick_cyl": mbs.Step(0.5, 0.5, 0.0, 0.12), "bucket_cyl": mbs.Step(0.8, 0.5, 0.0, -0.12)}
TIMES = np.linspace(0.0, 2.2, 23)


def excavator(design, like=None):
    """The machine with its circuit; design: gains kp, ki and the orifice's area [cm^2]."""
    b = machine()
    b.hydraulic("tank", hydraulics.Tank(2e5))
    b.hydraulic("supply", hydraulics.Volume(1e-2, pressure=2e7))
    pump = hydraulics.Pump(displacement=4e-5, leakage=2e-12)
    b.hydraulic("pump", pump, ports={"a": "tank", "b": "supply"}, signal=190.0)
    b.hydraulic("relief", hydraulics.ReliefValve(2.2e7, 5e-9), ports={"a": "supply", "b": "tank"})
    b.measure("angle", joint="boom_pin")
    b.block("controller", blocks.PI(design["kp"], design["ki"], target=WANTED, limit=1.0), reads="angle")
    b.hydraulic("hose", hydraulics.Volume(3e-3, pressure=PRESSURES["boom_cyl.p0"]))
    orifice = hydraulics.Orifice(design["area"] * 1e-4)
    b.hydraulic("orifice", orifice, ports={"a": "hose", "b": "boom_cyl.p0"})
    for name, (areas, volumes) in SIZES.items():
        law = forces.HydraulicCylinder(areas, volumes, 1.2e9, damping=2e4, leakage=5e-13)
        b.force(name, law, joint=name)
        to = "hose" if name == "boom_cyl" else f"{name}.p0"
        ways = {"p": "supply", "t": "tank", "a": to, "b": f"{name}.p1"}
        signal = "controller" if name == "boom_cyl" else SPOOLS[name]
        b.hydraulic(f"{name} valve", hydraulics.Valve(6e-3, 3.5e6, overlap=0.03), ports=ways, signal=signal)
    return b.build(like=like)


# %% [markdown]
# The machine begins at rest: what its cylinders must carry gives the pressures.

# %%
POSE = {"boom_pin": 0.33, "stick_pin": -1.04, "bucket_pin": -0.49}
guess = {"rocker_pin": 1.5, "knuckle": -1.5, "boom_cyl_foot": 1.0, **dict.fromkeys(CYLINDERS, 2.0)}
frame = machine().build(guess=POSE | guess)
pose = mbs.State.at(frame, **POSE, guess=guess)
still = jnp.zeros(frame.topology.num_velocities)
carried = mbs.inverse_dynamics(frame, pose, still, actuators=CYLINDERS)
PRESSURES = {}
for name, ((area0, area1), _) in SIZES.items():
    force = float(carried[name][0])
    low = 1e6  # in the chamber that does not carry [Pa]
    PRESSURES[f"{name}.p0"] = p0 = max(low, (force + area1 * low) / area0)
    PRESSURES[f"{name}.p1"] = p1 = max(low, (area0 * low - force) / area1)
    print(f"{name}: {force / 1e3:.0f} kN, {p0 / 1e5:.0f} and {p1 / 1e5:.0f} bar")

# %% [markdown]
# ## The first design
# Pressures are stiff beside the mechanism, so the solver is linearly implicit. Three numbers are to be chosen:
# forward derivatives are the cheapest.

# %%
FIRST = {"kp": 8.0, "ki": 1.0, "area": 1.2}
first = excavator(FIRST)
start = mbs.State.at(first, **POSE, guess=guess, internal=PRESSURES)
CHAMBERS = ("boom_cyl.p0", "hose.p", "supply.p")


def raise_boom(design):
    """Motion, load of the boom's pin (T,) [kN] and pressures (T, 3) [MPa]."""
    system = excavator(design, like=first)
    options = dict(ts=TIMES, dt=0.01, solver=mbs.ode.Rodas5P(), gradient="forward")
    motion = mbs.simulate(system, start, **options)
    pin = jnp.linalg.norm(mbs.reactions(system, motion.states)["boom_pin"].force, axis=-1)
    return motion, pin / 1e3, jnp.stack([motion.internal(name) for name in CHAMBERS], axis=-1) / 1e6


run = mbs.jit(raise_boom, compile="quick")
motion, pin, pressures = run(FIRST)
assert motion.ok
wanted = np.asarray(jax.vmap(WANTED)(TIMES))


def show(axes, motion, pin, pressures, style, label):
    angle = first.coordinates(motion.states)["boom_pin"]
    for ax, values in zip(axes, (angle, pin, pressures[:, 0]), strict=True):
        ax.plot(TIMES, values, style, label=label)
        ax.set_xlabel("time [s]")


fig, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
axes[0].plot(TIMES, wanted, "k:", label="wanted")
show(axes, motion, pin, pressures, "-", "first")
for ax, label in zip(axes, ("boom's angle [rad]", "load of its pin [kN]", "pressure [MPa]"), strict=True):
    ax.set_ylabel(label)
axes[0].legend(fontsize=8)
print(f"pin {pin.max():.0f} kN, boom's cylinder {pressures[:, 0].max():.1f} MPa")

# %% [markdown]
# ## Gains and orifice by their gradients
# The squared error of the path, under limits on the pin's load and on the pressure of the boom's cylinder. The
# gradient goes through the pump, the valves, the four loops and the reactions. A large gain alone would double the
# load of the pin.

# %%
LIMITS = [mbs.Limit("pin [kN]", "pin", upper=300.0)]
LIMITS += [mbs.Limit("pressure [MPa]", "pressure", upper=16.0)]


def path_error(design):
    """Mean squared error [mrad^2], and what the limits see."""
    motion, pin, pressures = raise_boom(design)
    angle = first.coordinates(motion.states)["boom_pin"]
    return 1e6 * jnp.mean((angle - wanted) ** 2), {"pin": pin, "pressure": pressures[:, 0]}


best = mbs.minimise(
    path_error,
    FIRST,
    bounds={"kp": (2.0, 30.0), "ki": (0.0, 20.0), "area": (0.3, 3.0)},
    limits=LIMITS,
    steps=2 if FAST else 40,
    tolerance=1e-3,
    gradient="forward",
    compile="quick",
    progress=False,
)
print(best.table())
assert FAST or best.ok

# %%
after = run(best.design)
fig, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
axes[0].plot(TIMES, wanted, "k:", label="wanted")
show(axes, motion, pin, pressures, "-", "first")
show(axes, *after, "--", "best")
for ax, label in zip(axes, ("boom's angle [rad]", "load of its pin [kN]", "pressure [MPa]"), strict=True):
    ax.set_ylabel(label)
axes[0].legend(fontsize=8)
errors = [1e3 * np.sqrt(np.mean((first.coordinates(m.states)["boom_pin"] - wanted) ** 2)) for m in (motion, after[0])]
print(f"error of the path {errors[0]:.1f} mrad, then {errors[1]:.1f} mrad")
assert errors[1] < errors[0]
