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
# # Closed loops and kinematic influence coefficients
#
# A four-bar has three joint coordinates and one freedom. `Gi` says how the dependent joints follow, `Hi` how `Gi`
# changes; the coefficients of a body say how it moves per unit rate of the independent joint.

# %%
import os

import jax
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs.constraints import internal_kic_second, internal_kic_second_printed

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %%
pin = mbs.Revolute(axis="z")
b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
    b.body(name, mass=length, com=(length / 2, 0, 0), inertia=mbs.inertia.rod(length, length))
b.joint("A", pin, "ground", "crank")
b.joint("B", pin, "crank", "coupler", parent_frame=(0.3, 0, 0))
b.joint("D", pin, "ground", "rocker", parent_frame=(1.0, 0, 0))
b.joint("C", pin, "coupler", "rocker", parent_frame=(0.9, 0, 0), child_frame=(0.7, 0, 0))
system = b.build(independent=["A"])
print(system.describe())

# %% [markdown]
# The loop is redundant in space: three of five closing rows would do in the plane. Nothing is dropped; the influence
# coefficients come from a least-squares solution of full column rank.

# %%
state = mbs.State.at(system, A=0.7, guess={"B": -0.3, "D": 1.5}, velocities={"A": 2.0})
K = mbs.constraints.kic(system, state)
print("Gi =", np.asarray(K.internal).ravel())
print("rates B, D per rate of A:", np.asarray(state.velocities)[1:] / 2.0)
forms = internal_kic_second(system, state), internal_kic_second_printed(system, state)
print("Hi by forward mode and as printed differ by", float(np.max(np.abs(forms[0] - forms[1]))))

# %% [markdown]
# ## Over a turn
# `Gi` of the rocker swings through zero at its two dead centres.

# %%
angles = np.linspace(0.7, 0.7 + 2 * np.pi, 9 if FAST else 121)
turn, follow = [], state
for angle in angles:
    joints = system.coordinates(follow)
    follow = mbs.State.at(system, A=angle, guess={name: joints[name] for name in ("B", "D")})
    turn.append(
        (float(system.coordinates(follow)["D"]), np.asarray(mbs.constraints.kic(system, follow).internal)[1, 0])
    )
turn = np.array(turn)
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.plot(angles, turn[:, 0], label="rocker angle [rad]")
ax.plot(angles, turn[:, 1], label="Gi of the rocker")
ax.axhline(0, color="0.7", lw=0.8)
ax.set_xlabel("crank angle [rad]")
ax.legend(frameon=False)

# %% [markdown]
# Differences of the angle give the coefficient back.

# %%
check = np.gradient(turn[:, 0], angles)[1:-1]
if not FAST:
    print("largest difference:", np.max(np.abs(check - turn[1:-1, 1])))
    assert np.max(np.abs(check - turn[1:-1, 1])) < 5e-3

# %% [markdown]
# ## Reactions, and what statics cannot know
# Components out of the plane are marked: they take a least-norm value.

# %%
loads = mbs.reactions(system, state)
for name, load in loads.items():
    print(name, np.asarray(load.force).round(4), "unique:", load.unique_force)
