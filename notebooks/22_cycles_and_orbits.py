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
# # Machines that run in a cycle
#
# Three questions about steady running: a slider-crank at the speed that its motor and its load agree on, a screen on
# hardening springs that may shake in two ways at one frequency, and the orbits of a rotor on soft bearings.

# %%
import os

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import rotors, viz

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## A slider-crank
# The motor slackens with the speed, so the crank speeds up and slows down twice in every turn. Nobody gives the
# period: it is free, and the crank gains a turn over it.

# %%
CRANK, ROD = 0.15, 0.5  # [m]
b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
b.body("crank", 1.2, (CRANK / 2, 0, 0), 0.004)
b.body("rod", 2.0, (ROD / 2, 0, 0), 0.06)
b.body("slider", 3.0, inertia=0.01)
b.joint("main", mbs.Revolute("z"), "ground", "crank")
b.joint("crank pin", mbs.Revolute("z"), "crank", "rod", parent_frame=(CRANK, 0, 0))
b.joint("wrist", mbs.Revolute("z"), "rod", "slider", parent_frame=(ROD, 0, 0))
b.joint("guide", mbs.Prismatic("x"), "ground", "slider")
b.force("motor", mbs.Actuator(lambda angle, speed, t: 8.0 * (20.0 - speed)), joint="main")
system = b.build(cut=("wrist",))
start = mbs.State.at(system, velocities={"main": 20.0}, guess={"main": 0.0, "guide": CRANK + ROD})
cycle = mbs.periodic(system, 2 * np.pi / 20, start, free="period", turns={"main": 1})
print(cycle)
assert cycle.stable
print(f"mean speed {cycle.mean_speed(system, 'main'):.3f} rad/s, "
      f"coefficient of fluctuation {cycle.fluctuation(system, 'main'):.3f}")  # fmt: skip
np.testing.assert_allclose(cycle.mean_powers["motor"], 0.0, atol=1e-6)  # nothing else takes energy

# %%
loads = mbs.reactions(system, cycle)
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.0), layout="constrained")
turn = np.degrees(cycle.states.coordinates[:, 0])
left.plot(turn, cycle.states.velocities[:, 0])
left.set_xlabel("angle of the crank [deg]")
left.set_ylabel("speed [rad/s]")
for name in ("main", "crank pin", "wrist"):
    right.plot(turn, np.linalg.norm(loads[name].force, axis=1), label=name)
right.set_xlabel("angle of the crank [deg]")
right.set_ylabel("force [N]")
right.legend()
plt.show()

# %% [markdown]
# The scene turns over and over: its last state is its first.

# %%
page = viz.scene(system, cycle, loads=loads, title="A slider-crank in its cycle")
page  # noqa: B018

# %% [markdown]
# ## A screen with two ways to run
# On hardening springs the resonance bends over. Between two folds there are three cycles at one frequency, the middle
# one of which no run shows; along the arc the branch goes through all of them.


# %%
class Push(eqx.Module):
    """The push of the unbalanced masses, and the part of the springs that hardens."""

    omega: jax.Array

    def __call__(self, x, v, t):
        return 0.3 * jnp.cos(self.omega * t) - 0.5 * x**3


def screen(omega, like=None):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("deck", 1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "deck")
    b.force("spring", mbs.SpringDamper(stiffness=1.0, damping=0.1), joint="x")
    b.force("push", mbs.Actuator(Push(jnp.asarray(omega))), joint="x")
    return b.build(like=like)


like = screen(1.0)
first, last = (1.1, 1.75) if FAST else (0.5, 2.5)
branch = mbs.cycles.cycles_along(
    lambda omega: screen(omega, like), (first, last), lambda omega: 2 * np.pi / omega, name="frequency [rad/s]"
)
print(branch)
np.testing.assert_allclose([p.value for p in branch.of_kind("fold")], [1.5555786, 1.2616102], atol=1e-6)
three = branch.all_at(1.5)
print([f"{'stable' if c.stable else 'not stable'}, largest multiplier {abs(c.multipliers[0]):.3f}" for c in three])
assert [bool(c.stable) for c in three] == [True, False, True]

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
viz.plot_branches(branch, "x", ax=left)
for c, style in zip(three, ("-", "--", "-"), strict=True):
    right.plot(c.states.coordinates[:, 0], c.states.velocities[:, 0], style)
right.set_xlabel("displacement at 1.5 rad/s [m]")
right.set_ylabel("velocity [m/s]")
plt.show()

# %% [markdown]
# ## Orbits of a rotor
# Bearings that are softer one way than the other split the critical speed in two. Between them the rotor whirls
# against its rotation, and at each of them its orbit is nearly a line.

# %%
shaft = rotors.Shaft(np.linspace(0.0, 1.5, 7), outer=0.025)
disks = [rotors.Disk(k, mass=32.6, diametral=0.178, polar=0.33) for k in (2, 4)]
bearings = [rotors.Bearing(k, [[1.5e6, 0.0], [0.0, 0.8e6]], 300.0) for k in (0, 6)]
rotor = rotors.Rotor(shaft, disks, bearings)
critical = rotors.critical_speeds(rotor, 2).speeds
print("critical speeds", np.round(np.asarray(critical), 2), "rad/s")
speeds = np.linspace(0.7 * critical[0], 1.3 * critical[1], 400)
orbit = rotors.unbalance_response(rotor, speeds, {2: 1e-3}).orbit(2)
between = float(np.mean(critical))
assert orbit.sense[np.argmin(np.abs(speeds - between))] == -1  # backward

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
left.semilogy(speeds, orbit.major, label="larger half axis")
left.semilogy(speeds, np.abs(orbit.minor), label="smaller half axis")
left.set_xlabel("speed [rad/s]")
left.set_ylabel("deflection [m]")
left.legend()
viz.plot_orbits(orbit, at=[0.8 * critical[0], between, 1.25 * critical[1]], ax=right)
plt.show()
