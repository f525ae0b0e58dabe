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
# # Ten thousand linkages
#
# A crank turns and a rocker swings. A large swing with a small load in the pins is wanted; which lengths give it?
# First ten thousand designs, spread over a box and kept on disk as a dataset with named axes. Then the Pareto front
# of the trade-off by gradients, through the corner of the cloud that chance hardly finds.

# %%
import os
import tempfile

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs.design import pareto

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## One linkage
# The crank, 0.1 m, turns with 10 rad/s. The design is the lengths of the coupler, the rocker and the ground. A driven
# mechanism without freedom needs no integration: `State.at` closes the loop at each time.

# %%
PIN, CRANK, SPEED = mbs.Revolute("z"), 0.1, 10.0
ts = jnp.linspace(0.0, 2 * np.pi / SPEED, 17)[:-1]


def linkage(design, like=None):
    x = jnp.array([1.0, 0.0, 0.0])
    lengths = {"crank": jnp.asarray(CRANK), "coupler": design["coupler"], "rocker": design["rocker"]}
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name, length in lengths.items():
        mass = 8.0 * length
        b.body(name, mass, com=length * x / 2, inertia=mass * length**2 / 12 * jnp.array([0.01, 1.0, 1.0]))
    b.joint("A", PIN, "ground", "crank", drive=mbs.Ramp(0.0, SPEED))
    b.joint("B", PIN, "crank", "coupler", parent_frame=lengths["crank"] * x)
    b.joint("D", PIN, "ground", "rocker", parent_frame=design["ground"] * x)
    b.joint("C", PIN, "coupler", "rocker", parent_frame=lengths["coupler"] * x, child_frame=lengths["rocker"] * x)
    return b.build(like=like)


middle = {"coupler": 0.3, "rocker": 0.2, "ground": 0.3}
first = linkage(middle)


def turn(design):
    """The system and its states over a turn."""
    system = linkage(design, like=first)

    def state(t):
        near = {"A": SPEED * t, "B": 0.8 - SPEED * t, "D": 1.7}  # the coupler keeps its direction, roughly
        return mbs.State.at(system, guess=near, t=t)

    return system, jax.vmap(state)(ts)


def forces(system, states):
    """Square of the forces (4, 16) in the pins [N^2]."""
    loads = mbs.reactions(system, states)
    return jnp.stack([jnp.sum(loads[name].force ** 2, axis=-1) for name in "ABCD"])


def answers(design):
    """Swing of the rocker [deg] and the largest force in the pins [N] over a turn."""
    system, states = turn(design)
    rocker = system.coordinates(states)["D"]
    swing = jnp.rad2deg(jnp.max(rocker) - jnp.min(rocker))
    return {"swing": swing, "load": jnp.sqrt(jnp.max(forces(system, states)))}


print({name: float(x) for name, x in mbs.jit(answers, compile="quick")(middle).items()})

# %% [markdown]
# ## Ten thousand
# `sweep` saves each chunk of designs in a folder when it is complete; stopped, it goes on there. Linkages
# that cannot turn keep their row: numbers that are not a number, a status and a reason.

# %%
box = {"coupler": (0.15, 0.45), "rocker": (0.12, 0.4), "ground": (0.15, 0.45)}
plan = mbs.studies.sobol(box, 64 if FAST else 8192, 0)
units = {"swing": "deg", "load": "N", **dict.fromkeys(box, "m")}
with tempfile.TemporaryDirectory() as folder:
    how = {"chunk": 64, "compile": "quick"} if FAST else {"chunk": 1024}
    cloud = mbs.sweep(answers, plan, folder, units=units, progress=False, **how)
turning = cloud.where(cloud["status"] == 0, drop=True)
print(f"{cloud.sizes['design']} designs, {turning.sizes['design']} turn")
reasons, counts = np.unique(cloud["reason"], return_counts=True)
print(dict(zip(reasons.tolist(), counts.tolist(), strict=True)))


# %% [markdown]
# ## The Pareto front
# Both objectives by gradients: the least load for every swing. The force is a maximum over instants, so a smooth one
# stands for it while the search runs. Grashof's rule keeps the crank turning: the shortest and the longest are
# together no longer than the other two; the box of the search stays within it.


# %%
def load(design):
    """The largest force [N], by a mean of high power."""
    return jnp.mean(forces(*turn(design)) ** 8) ** (1 / 16)


def swing(design):
    """The swing [deg], likewise."""
    system, states = turn(design)
    rocker = system.coordinates(states)["D"]
    return jnp.rad2deg(2.0 * jnp.mean((rocker - jnp.mean(rocker)) ** 8) ** (1 / 8))


inside = {"coupler": (0.27, 0.33), "rocker": (0.22, 0.3), "ground": (0.27, 0.32)}
front = pareto(
    load,
    lambda design: -swing(design),
    middle | {"rocker": 0.25},
    inside,
    points=3 if FAST else 7,
    steps=10 if FAST else 60,
    gradient="forward",
    compile="quick",
    progress=False,
)
print(front.table())
best = mbs.jit(jax.vmap(answers), compile="quick")(front.designs)

# %%
fig, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.scatter(turning["swing"], turning["load"], s=3, c="0.7", label="designs that turn")
ax.plot(best["swing"], best["load"], "o-", label="Pareto front by gradients")
ax.set_yscale("log")
ax.set_xlabel("swing of the rocker [deg]")
ax.set_ylabel("largest force in the pins [N]")
ax.legend()
