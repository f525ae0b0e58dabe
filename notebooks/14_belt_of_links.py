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
# # A belt of 200 links
#
# A track, a roller chain, a belt: hundreds of links in one loop. Closed loops are solved in linear time (the frontal
# method), so that such a model builds in a second and moves in milliseconds a step. Here a belt of 200 links with
# elastic joints hangs from a nail: it starts as a circle, falls and swings.

# %%
import os
import time

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs.viz import scene

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))
LINKS = 60 if FAST else 200

# %% [markdown]
# ## The model
# Link k lies along a side of a regular polygon of one metre radius; all pins are given by their places in the world,
# so that zero coordinates are the circle. Each pin bends like a belt of 0.02 N m^2 and 1.5 kg/m, with damping.

# %%
RADIUS, WEIGHT, BENDING, DAMPING = 1.0, 1.5, 0.02, 1e-4
angle = 2.0 * np.pi * np.arange(LINKS) / LINKS + np.pi / 2.0
corner = RADIUS * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
along = np.roll(corner, -1, axis=0) - corner
side = float(np.linalg.norm(along[0]))


def belt():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    pin = mbs.Revolute(axis="z")
    for k in range(LINKS):
        axes = np.stack([along[k] / side, np.cross([0.0, 0.0, 1.0], along[k] / side), [0.0, 0.0, 1.0]], axis=1)
        rod = mbs.inertia.rod(WEIGHT * side, side, axis="x")
        b.body(f"link {k}", WEIGHT * side, (side / 2.0, 0.0, 0.0), rod, position=corner[k], rotation=axes)
    b.joint("nail", pin, "ground", "link 0", at=corner[0])
    for k in range(LINKS):
        following = (k + 1) % LINKS
        b.joint(f"pin {k}", pin, f"link {k}", f"link {following}", at=corner[following])
    for k in range(LINKS - 1):
        bending = mbs.SpringDamper(stiffness=BENDING / side, damping=DAMPING / side)
        b.force(f"bend {k}", bending, joint=f"pin {k}")
    return b.build()


start = time.perf_counter()
system = belt()
print(f"built in {time.perf_counter() - start:.1f} s")
print(system.describe()[:400])

# %% [markdown]
# ## The fall
# The circle is released at rest.

# %%
END = 0.3 if FAST else 2.0
state = mbs.State.at(system)
times = jnp.linspace(0.0, END, 31)
start = time.perf_counter()
motion = mbs.simulate(system, state, ts=times, rtol=1e-6, atol=1e-6, max_steps=20_000)
steps = int(motion.diagnostics.num_steps)
print(f"{steps} steps in {time.perf_counter() - start:.1f} s, compilation included; ok: {bool(motion.ok)}")

# %%
shown = [f"link {k}" for k in range(0, LINKS, 4)]


@mbs.jit
def places(states):
    return jax.vmap(lambda state: jnp.stack([mbs.position(system, state, name)[:2] for name in shown]))(states)


shapes = np.asarray(places(motion.states))
fig, ax = plt.subplots(figsize=(5, 5))
for k in range(0, 31, 6):
    loop = np.concatenate([shapes[k], shapes[k][:1]])
    ax.plot(*loop.T, label=f"{float(times[k]):.2f} s", color=plt.cm.viridis(k / 30))
ax.set_aspect("equal")
ax.legend(title="time")
ax.set(xlabel="x [m]", ylabel="y [m]", title=f"A belt of {LINKS} links falls")
plt.show()

# %% [markdown]
# The scene is a page for the browser, to be turned and played.

# %%
page = scene(system, motion, None, traces=["link 0"], title="A falling belt")

# %% [markdown]
# ## The loads of all pins, at all times
# One block-sparse solve gives the reactions of every pin along the whole motion. At the nail they carry the weight,
# and what the acceleration of the belt adds to it.

# %%
loads = mbs.reactions(system, motion)
nail = np.asarray(loads["nail"].force)[:, 1]
tension = np.stack([np.linalg.norm(np.asarray(loads[f"pin {k}"].force), axis=-1) for k in range(LINKS)], axis=1)
weight = 9.81 * WEIGHT * side * LINKS
fig, (left, right) = plt.subplots(1, 2, figsize=(10, 3.5))
left.plot(times, nail)
left.axhline(weight, color="0.5", ls="--", label="weight")
left.set(xlabel="time [s]", ylabel="force of the nail [N]")
left.legend()
image = right.imshow(tension.T, aspect="auto", origin="lower", extent=(0, END, 0, LINKS))
right.set(xlabel="time [s]", ylabel="pin")
fig.colorbar(image, label="force [N]")
plt.show()

# %% [markdown]
# Nothing is lost on the way: what the joints dissipated, and the energy that is left, are what it began with, and the
# loop is closed to rounding at every step.

# %%
lost = float(jnp.abs(motion.diagnostics.energy_residual).max())
gap = float(jnp.max(motion.diagnostics.constraint_drift))
print(f"energy unaccounted for: {lost:.1e} J of {weight * RADIUS:.0f} J; loop open by {gap:.1e} m")
assert bool(motion.ok) and lost < 1e-3 * weight * RADIUS and gap < 1e-9
