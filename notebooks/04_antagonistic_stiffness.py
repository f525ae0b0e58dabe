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
# # Antagonistic stiffness: preload that stiffens, and preload that buckles
#
# Local stiffness has two parts: the springs' own rates seen through their influence coefficients, and what the
# preload makes of the changing geometry, $K = \sum K_i G_C^T G_C + \sum K_i\, \delta q_C^T \{dG_C/d\varphi\}$.

# %%
import os

import jax
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## A mast between two stays
# A rigid mast on a pin, a heavy top, and two equal stays from the ground to the top. The stays' free length sets
# the preload.

# %%
HEIGHT, REACH, RATE = 1.0, 0.6, 2000.0
LENGTH = np.hypot(HEIGHT, REACH)


def mast(preload, like=None):
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("mast", mass=5.0, com=(0, HEIGHT, 0), inertia=0.2)
    b.joint("foot", mbs.Revolute(axis="z"), "ground", "mast")
    for side, x in (("left", -REACH), ("right", REACH)):
        law = mbs.SpringDamper(stiffness=RATE, damping=5.0, free_length=LENGTH - preload / RATE)
        b.force(side, law, between=(("ground", (x, 0, 0)), ("mast", (0, HEIGHT, 0))))
    return b.build(like=like)


# %% [markdown]
# By hand: each stay's elastic part is `k (dL/dphi)^2`, the antagonistic part `T d2L/dphi2`, gravity `-m g h`.

# %%
K = mbs.stiffness(mast(100.0), mbs.State.at(mast(100.0)))
slope = HEIGHT * REACH / LENGTH
curve = -(slope**2) / LENGTH
print("elastic     ", K.elastic, 2 * RATE * slope**2)
print("antagonistic", K.antagonistic, 2 * 100.0 * curve)
print("gravity     ", K.gravity, -5.0 * 9.81 * HEIGHT)

# %% [markdown]
# The stays pull the mast down: tension makes it softer here, and at `T = K / (2 |d2L/dphi2|)` unstable.

# %%
preloads = np.linspace(0.0, 3000.0, 4 if FAST else 25)
system = mast(0.0)
at = mbs.jit(lambda T: mbs.stiffness(mast(T), mbs.State.at(system)))
shares = [at(T) for T in preloads]
total = np.array([float(s.total[0, 0]) for s in shares])
limit = (2 * RATE * slope**2 - 5.0 * 9.81 * HEIGHT) / (-2 * curve)
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.plot(preloads, [float(s.elastic[0, 0]) for s in shares], label="elastic")
ax.plot(preloads, [float(s.antagonistic[0, 0]) for s in shares], label="antagonistic")
ax.plot(preloads, total, "k", label="total")
ax.axhline(0, color="0.7", lw=0.8)
ax.axvline(limit, color="0.7", ls=":")
ax.set_xlabel("preload of each stay [N]")
ax.set_ylabel("stiffness [N m/rad]")
ax.legend(frameon=False)

# %% [markdown]
# The verdict of `equilibrium`, and the motion, agree: below the limit the mast stands, above it falls.

# %%
for preload in (0.9 * limit, 1.1 * limit):
    system = mast(preload)
    rest = mbs.equilibrium(system, mbs.State.at(system))
    nudged = mbs.State.at(system, foot=1e-3)
    motion = mbs.simulate(system, nudged, t1=3.0)
    swing = float(np.max(np.abs(motion.states.coordinates)))
    print(f"preload {preload:6.0f} N: stable {bool(rest.stable)}, a nudge of 0.001 rad grows to {swing:.3g} rad")
    assert bool(rest.stable) == (swing < 0.1)
